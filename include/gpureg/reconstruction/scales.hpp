// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gpureg/reconstruction/reconstruct.hpp"
#include "gpureg/registration/scale.hpp"

/// Maps of scans of which each has an unknown scale of its own: chunks of photogrammetry or of a
/// monocular run.
namespace gpureg::reconstruction {

/// What is known of the scale of a scan.
struct ScanScale {
  /// Lengths of the unit of its part per unit of the scan.
  double scale = 1;
  /// Scans of one part have a common unit, that of its first scan; where parts meet nowhere, their
  /// units are guesses. Counted from 0, in the order of the first scans.
  std::uint32_t part = 0;
};

/// How the scales of a set are searched.
struct ScaleSearch {
  /// Of every pair: scales of the later scan to the earlier one.
  ScaleRange range = {};
  /// File from which an interrupted search goes on; empty: none.
  std::string journal = {};
  PairJournal::Mode journal_mode = PairJournal::Mode::resume;
  /// Pairs that were searched or need not be, and all.
  std::function<void(std::size_t done, std::size_t total)> on_progress = {};
  /// Polled several times a second; true ends the call, which throws Cancelled.
  std::function<bool()> should_stop = {};
};

/// What find_scales() finds.
struct FoundScales {
  std::vector<ScanScale> scans;          ///< one per fragment
  std::size_t searched = 0;              ///< pairs that this call searched
  std::unique_ptr<PairJournal> journal;  ///< remove() it when the map is complete
};

/// Finds the scales of a set. Pairs are searched with align_scaled_auto(), neighbours in the order
/// of the set first, until loops of pairs confirm the scale of every scan, or all have been
/// searched; a graph of the logarithms of the scales tells wrong pairs from right ones.
/// @param options as for align_scaled_auto().
/// @return the scales; a fragment that cannot be read is a part of its own. The same after an
///   interruption.
/// @throws InvalidArgument for a range that is none or known, and as align_scaled_auto(); as
///   PairJournal; Cancelled.
FoundScales find_scales(const Context& context, const FragmentSet& fragments,
                        const RegistrationOptions& options = {}, const ScaleSearch& search = {});

/// The fragments of another set, each multiplied by a factor.
class ScaledFragments : public FragmentSet {
 public:
  /// @param fragments must outlive this.
  /// @throws InvalidArgument for another number of scales, or one that is not finite and > 0.
  ScaledFragments(const FragmentSet& fragments, std::vector<double> scales);

  std::size_t size() const override { return fragments_.size(); }
  std::string name(std::size_t k) const override { return fragments_.name(k); }
  std::string label(std::size_t k) const override { return fragments_.label(k); }
  LoadedCloud read(std::size_t k, const RegistrationOptions& options) const override;
  std::string fingerprint(std::size_t k) const override;
  std::size_t readers() const override { return fragments_.readers(); }

 private:
  const FragmentSet& fragments_;
  std::vector<double> scales_;
};

/// A map of scans that were multiplied by their scales.
struct ScaledMapOfSet {
  MapOfSet made;               ///< of the scaled scans: its poses are rigid
  std::vector<double> scales;  ///< of each fragment, refined
  int rounds = 0;              ///< maps that were made
};

/// reconstruct() of the scaled fragments, and again with the scales that the map refines: each
/// accepted edge is aligned with a free scale, and a graph of similarities is solved for the poses
/// and scales of all scans together. The first scan of each island keeps its scale.
/// @param scales one per fragment, as of find_scales().
/// @param input world_from_scan and odometry in the unit of the scaled scans; without results.
/// @param options without a journal.
/// @throws InvalidArgument as above and as reconstruct().
ScaledMapOfSet reconstruct_scaled(const Context& context, const FragmentSet& fragments,
                                  const std::vector<double>& scales, const MapInput& input = {},
                                  const MapOptions& options = {},
                                  const MapCallbacks& callbacks = {});

}  // namespace gpureg::reconstruction
