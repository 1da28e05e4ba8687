// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/field.hpp"
#include "gpureg/options.hpp"

namespace gpureg::fields {

template <>
struct Values<RegistrationMethod> {
  static constexpr RegistrationMethod kAll[] = {RegistrationMethod::compatibility,
                                                RegistrationMethod::quadruples};
};

template <>
struct Fields<ConfidenceCalibration> {
  static constexpr const char* kName = "ConfidenceCalibration";
  static constexpr const char* kGroup = "calibration.";
  static constexpr const char* kSentence =
      "Confidence of another sensor: log odds = offset + slope * log odds. The default changes "
      "nothing.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using C = ConfidenceCalibration;
    v(&C::slope, {"slope", above(0, kMost, "a number > 0"), "Factor of the log odds."});
    v(&C::offset, {"offset", kFinite, "Added to the log odds."});
  }
  // clang-format on
};

template <>
struct Fields<PrepareOptions> {
  static constexpr const char* kName = "PrepareOptions";
  static constexpr const char* kGroup = "prepare.";
  static constexpr const char* kSentence =
      "How a raw cloud becomes a PreparedCloud. Lengths are in voxels.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = PrepareOptions;
    v(&O::downsample, {"downsample", "One centroid per voxel; false keeps the points as they are."});
    v(&O::normal_radius, {"normal_radius", kVoxels, "Neighbourhood of a normal. Normals of the wide features use a radius that is larger by wide_feature_radius / feature_radius."});
    v(&O::feature_radius, {"feature_radius", kVoxels, "Neighbourhood of FPFH."});
    v(&O::wide_feature_radius, {"wide_feature_radius", kVoxelsOrZero, "Neighbourhood of a second FPFH; 0: none."});
    v(&O::max_correspondence_distance, {"max_correspondence_distance", kVoxels, "Largest distance of an inlier and of a correspondence of the refinement. An alignment may use a smaller one than its clouds were prepared with, never a larger one."});
    v(&O::depth_maps, {"depth_maps", from(0, limits::kMaxDepthMaps), "Viewpoints that get a depth map for free-space tests; 0: none, and given normals are never flipped."});
    v(&O::surface_side_distance, {"surface_side_distance", kVoxelsOrZero, "Range in front of and behind its surfaces within which a cloud tells the two sides apart; 0: no such evidence."});
    v(&O::keep_range_limits, {"keep_range_limits", "Keep points at the smallest and the largest range of the sensor, which are fixed to it: for a tank scanned from its centre."});
  }
  // clang-format on
};

template <>
struct Fields<RegistrationOptions> {
  static constexpr const char* kName = "RegistrationOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence = "All options of one registration.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = RegistrationOptions;
    v(&O::voxel_size, {"voxel_size", kLength, "Edge of the downsampling voxel. Every other length follows from it."});
    v(&O::quality, {"quality", from(0, kHighestQuality), "0 is the fastest, 10 finds the most (method 'compatibility')."});
    v(&O::seed, {"seed", "Same seed, same bits, on any backend and number of threads."});
    v(&O::min_confidence, {"min_confidence", kProbability, "Confidence below which no alignment is reported; of the method 'quadruples' the verified inlier ratio."});
    v(&O::accept_symmetry, {"accept_symmetry", "Report one of several poses that a symmetry of the larger cloud makes equivalent if their common confidence reaches min_confidence (method 'compatibility')."});
    v(&O::calibration, {"calibration", "Scales every confidence to a sensor (method 'compatibility')."});
    v(&O::method, {"method", "How candidate poses are found: second-order compatibility (SC2-PCR), or LoopSmart quadruples."});
    v(&O::quadruples, {"quadruples", from(1, limits::kMaxQuadruples, "1 to 2^30"), "Drawn per pair; fewer are faster and lose pairs with little overlap (method 'quadruples')."});
    v(&O::refine_iterations, {"refine_iterations", from(0, limits::kMaxIterations), "Of ICP at most; 0 switches it off."});
    v(&O::prepare, {"prepare", "How a raw cloud is prepared."});
    v(&O::tune, {"tune", "Internal constants by name, for experiments: 'evidence.sample=1024 evidence.modes=32'. They may change with any version."});
  }
  // clang-format on
};

}  // namespace gpureg::fields
