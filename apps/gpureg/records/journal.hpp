// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <utility>

#include "records/json.hpp"
#include "records/pair_record.hpp"

namespace gpureg::cli {

/// Journal of a batch beside its output: a line that identifies the run, then one line per pair. A
/// kill at any moment leaves complete lines and at most one torn line at the end, which a resumed
/// run truncates.
class Journal {
 public:
  /// Treatment of an existing journal: fresh refuses one that holds pairs.
  enum class Mode { fresh, resume, restart };

  struct Entry {
    PairRecord pair;
    Json information;  ///< 6x6 of Redwood's convention, row by row
  };
  using Entries = std::map<std::pair<int, int>, Entry>;

  /// Opens or creates the journal. header: identity of the run; resume: continue an existing
  /// journal, refused where headers differ. Throws IoError, also where another process writes the
  /// same journal.
  Journal(std::string path, const Json& header, Mode mode);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Early check, before the header and hours of work: refuses a journal that another process
  /// writes, and with fresh one that holds pairs. Changes nothing. Throws IoError.
  static void check(const std::string& path, Mode mode);

  const Entries& entries() const { return entries_; }

  /// Whether the outputs are of this run, as far as it was when it was interrupted.
  bool wrote_outputs() const { return wrote_outputs_; }
  void note_outputs();

  /// Adds a pair; flush() hands all pairs added to the system. Throw IoError.
  void add(const PairRecord& pair, const Json& information);
  void flush();

  /// Deletes the file: the outputs are complete.
  void remove();

 private:
  std::size_t take_up(const std::string& text, const Json& header);

  std::string path_;
  int fd_ = -1;
  std::string pending_;
  Entries entries_;
  bool wrote_outputs_ = false;
};

}  // namespace gpureg::cli
