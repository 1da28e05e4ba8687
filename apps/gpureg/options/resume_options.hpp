// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "command_line.hpp"
#include "inputs/scene.hpp"

namespace gpureg::cli {

/// Note of a journal: the outputs are of its run, as far as it came.
inline constexpr std::uint64_t kOutputsWritten = 1;

/// --resume and --restart, of verbs that keep a journal.
struct ResumeOptions {
  bool resume = false, restart = false;

  /// @return --resume and --restart, for what excludes them.
  std::pair<Option, Option> add_to(Verb verb);

  PairJournal::Mode mode() const;

  /// The refusals of a journal that show before the clouds are read. Throws IoError.
  void check(const std::string& journal) const;

  /// How far an earlier run came, on stderr.
  void tell(const std::string& journal, std::size_t done, std::size_t all) const;

  /// Calls work, and says of what it throws about the journal what the user can do. Throws IoError.
  void with(const std::string& journal, const std::function<void()>& work) const;

  /// The outputs are complete: deletes the journal. Where fragments were left out it stays, for a
  /// run that finds them repaired.
  static void close(PairJournal& journal, const FragmentFolder& folder, bool quiet);

 private:
  mutable bool found_ = false;  // check() has seen the journal
};

}  // namespace gpureg::cli
