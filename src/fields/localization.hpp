// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/coordinates.hpp"
#include "fields/options.hpp"
#include "gpureg/change.hpp"

namespace gpureg::fields {

constexpr Range kReach =
                    from(limits::kMinLength, limits::kMaxCoordinate, "a number in [1e-6, 1e12]")
                        .in_voxels(),
                kReachOrZero = from(0, limits::kMaxCoordinate, "a number in [0, 1e12]").in_voxels();

template <>
struct Fields<localization::MapOptions> {
  static constexpr const char* kName = "MapOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence =
      "Options of a map that scans are located in. Lengths are in voxels.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = localization::MapOptions;
    v(&O::voxel_size, {"voxel_size", kLength, "Every length is a multiple of it."});
    v(&O::prepare, {"prepare", "Of tiles and scans."});
    v(&O::tile_size, {"tile_size", kReach, "Largest edge of a tile."});
    v(&O::halo, {"halo", kReachOrZero, "Overlap of tiles: about half of a scan."});
  }
  // clang-format on
};

template <>
struct Fields<localization::LocateOptions> {
  static constexpr const char* kName = "LocateOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence =
      "How scans are located in a map. Lengths are in voxels of the map.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = localization::LocateOptions;
    v(&O::registration, {"registration", "Of the alignments."});
    v(&O::min_confidence, {"min_confidence", kProbability, "Confidence from which a place is found."});
    v(&O::coarse_factor, {"coarse_factor", from(1, 8), "Voxels of the coarse search, in voxels of the map."});
    v(&O::coarse_tiles, {"coarse_tiles", from(1, 1e6), "Tiles of the coarse search; of more, a coarser one chooses."});
    v(&O::fine_tiles, {"fine_tiles", from(1, 1e6), "Tiles of the fine search, if the coarse one is not sure."});
    v(&O::candidates, {"candidates", from(1, 64), "Poses of a scan that are verified."});
    v(&O::neighborhood, {"neighborhood", kReach, "Distance up to which the map verifies a pose."});
  }
  // clang-format on
};

template <>
struct Fields<localization::ChangeOptions> {
  static constexpr const char* kName = "ChangeOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence =
      "How a scan is compared with a map. Lengths are in voxels of the map.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = localization::ChangeOptions;
    v(&O::tolerance, {"tolerance", kReach, "Surfaces closer together are the same."});
    v(&O::translation_sigma, {"translation_sigma", kReachOrZero, "Uncertainty of the pose."});
    v(&O::rotation_sigma, {"rotation_sigma", from(0, 180, "degrees in [0, 180]").in("degrees"), "Uncertainty of the pose."});
    v(&O::min_extent, {"min_extent", kReachOrZero, "Smaller changes are noise."});
    v(&O::viewpoints, {"viewpoints", from(1, 4096), "Sensor positions of each cloud whose free space is compared."});
    v(&O::refine, {"refine", "Refine the pose by ICP first."});
  }
  // clang-format on
};

}  // namespace gpureg::fields
