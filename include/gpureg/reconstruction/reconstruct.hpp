// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gpureg/reconstruction.hpp"
#include "gpureg/sets/fragment_set.hpp"
#include "gpureg/sets/pair_journal.hpp"

/// From scans to an audited map in one call.
namespace gpureg::reconstruction {

/// Options of reconstruct() of a set.
struct MapOptions {
  RegistrationOptions registration = {};  ///< its voxel_size is that of all
  Options graph = {};                     ///< threads 0: those of a CPU context
  AuditOptions audit = {};
  RefineOptions refinement = RefineOptions::for_depth_cameras();
  /// Ask the scans whether they contradict each other where the map puts them.
  bool with_audit = true;
  bool with_refinement = true;  ///< of all poses together
  /// Leave the surfaces of the placed scans in the result, as pages and merged clouds need them.
  bool with_surfaces = false;
  /// Align this many pairs per scan on average, those that look most alike, and those that odometry
  /// connects; 0: all pairs.
  std::uint32_t prune = 0;
  /// File from which an interrupted run goes on; empty: none.
  std::string journal = {};
  PairJournal::Mode journal_mode = PairJournal::Mode::resume;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// What is known of a set before. All indices are those of the set.
struct MapInput {
  std::optional<std::vector<Pair>> pairs;  ///< that are aligned; none: as MapOptions::prune says
  /// Of the pairs, which are then not aligned.
  std::optional<std::vector<RegistrationResult>> results;
  /// Odometry: a pose of each scan, no_pose() where it is not known, of which those of consecutive
  /// scans count; may be empty.
  std::vector<UnalignedIsometry3d> world_from_scan;
  std::vector<Odometry> odometry;  ///< further relative poses that are known
};

/// Seconds that the steps of reconstruct() took.
struct MapSeconds {
  double prepare = 0, prune = 0, align = 0, graph = 0, surfaces = 0, refine = 0;
};

/// A map and all that it was made of.
struct MapOfSet {
  std::vector<std::size_t> scans;               ///< fragments that could be used, ascending
  std::map<std::size_t, std::string> unusable;  ///< the other ones, and why
  std::vector<PreparedFragment> prepared;       ///< one per scan; none, if nothing was prepared
  std::vector<Odometry> odometry;               ///< between scans
  std::vector<Pair> pairs;                      ///< of scans: indices into `scans`
  std::vector<RegistrationResult> results;      ///< of the pairs
  std::size_t aligned_here = 0;                 ///< pairs that this call aligned
  Reconstruction map;                           ///< of the scans
  std::optional<Audit> audit;                   ///< none without MapOptions::with_audit
  bool places_look_alike = false;               ///< AuditedReconstruction
  std::vector<Surface> surfaces;                ///< MapOptions::with_surfaces
  std::optional<RefineReport> refinement;       ///< none without MapOptions::with_refinement
  std::unique_ptr<PairJournal> journal;         ///< remove() it when the outputs are complete
  MapSeconds seconds;
};

/// The steps of reconstruct() whose progress is told.
enum class MapStep { prepare, align, surfaces, refine };

/// Called on the calling thread; each may be empty. What they throw ends the call.
struct MapCallbacks {
  std::function<void(MapStep step, std::size_t done, std::size_t total)> on_progress;
  /// Polled several times a second; true ends the call, which throws Cancelled.
  std::function<bool()> should_stop;
  std::function<void(const MapOfSet&)> on_prepared;  ///< before the first pair is aligned
  std::function<void(const MapOfSet&)> on_aligned;   ///< all results are there
};

/// Makes one map of unordered scans: prepares them, aligns their pairs, places the scans, audits
/// the map and refines it. No pose needs to be known. Scans that cannot be read or prepared, and
/// scans that cannot be placed, are no error.
/// @return the map. Independent of the number of threads, of an interruption, and of the backend.
/// @throws IoError if fewer than two scans can be used, and as PairJournal. InvalidArgument for
///   options or input out of range; Cancelled; otherwise as align_batch() and reconstruct() of
///   pairs.
MapOfSet reconstruct(const Context& context, const FragmentSet& fragments,
                     const MapInput& input = {}, const MapOptions& options = {},
                     const MapCallbacks& callbacks = {});

}  // namespace gpureg::reconstruction
