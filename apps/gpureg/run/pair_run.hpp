// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gpureg/context.hpp"
#include "gpureg/options.hpp"
#include "gpureg/prior.hpp"
#include "inputs/scene.hpp"
#include "json/json_fwd.hpp"
#include "options/method_options.hpp"
#include "records/journal.hpp"
#include "records/pair_store.hpp"

namespace gpureg::cli {

/// Indices i < j into the numbers of a scene.
using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// Sets an automatic voxel size to that of some fragments of a folder, evenly chosen: it is the
/// same for a run that is resumed, whose journal says it, if there is one.
void choose_voxel_size(MethodOptions& method, const ScanInput& input,
                       const std::string& journal = "");

/// Aligns the pairs of a scene, with a journal from which an interrupted run goes on.
class PairRun {
 public:
  /// gravity: a prior for all pairs. Opens the journal; without one, nothing can be resumed. Throws
  /// IoError.
  PairRun(const PreparedFolder& scene, const Pairs& pairs, const RegistrationOptions& options,
          const std::optional<GravityPrior>& gravity, const std::optional<std::string>& journal,
          Journal::Mode mode, bool quiet);

  /// Aligns what is left, until it is done or interrupted.
  void align(const Context& context);

  bool complete() const { return done_ == size(); }
  std::size_t size() const { return size_; }  ///< of all pairs
  std::size_t done() const { return done_; }
  const PairStore& store() const { return store_; }  ///< until take_store()
  PairStore take_store() { return std::move(store_); }
  Journal* journal() { return journal_ ? &*journal_ : nullptr; }

  /// The outputs are complete: deletes the journal. Where fragments were left out it stays, for a
  /// run that finds them repaired.
  void close_journal();

  std::size_t in_this_run() const { return done_ - resumed_; }
  double seconds() const { return seconds_; }
  double rate() const;  ///< pairs per second of this run

 private:
  void open_journal(const std::string& path, const Pairs& pairs, Journal::Mode mode);

  const PreparedFolder& scene_;
  PairStore store_;
  const RegistrationOptions& options_;
  std::optional<GravityPrior> gravity_;
  std::optional<Journal> journal_;
  bool quiet_;
  std::size_t size_, done_ = 0, resumed_ = 0;
  double seconds_ = 0;
};

/// The fragments of a scene as results list them.
Json fragments_json(const PreparedFolder& scene);

/// Those that were left out, with the reasons; as a line of a summary, empty where there is none.
Json unusable_json(const FragmentFolder& scene);
std::string unusable_line(const FragmentFolder& scene);

}  // namespace gpureg::cli
