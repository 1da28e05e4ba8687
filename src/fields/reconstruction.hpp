// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/loop_consistency.hpp"
#include "fields/pose_graph.hpp"
#include "gpureg/reconstruction.hpp"

namespace gpureg::fields {

template <>
struct Fields<reconstruction::EdgeNoiseOptions> {
  static constexpr const char* kName = "EdgeNoiseOptions";
  static constexpr const char* kGroup = "noise.";
  static constexpr const char* kSentence =
      "Noise of a registered pose. A registration is never more certain than this. Lengths are in "
      "voxels.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = reconstruction::EdgeNoiseOptions;
    v(&O::translation, {"translation", kPositive.in_voxels(), "Standard deviation at the centre of the overlap."});
    v(&O::rotation, {"rotation", above(0, 180, "(0, 180]").in("degrees"), "Standard deviation of the rotation."});
    v(&O::max_translation, {"max_translation", from(-kMost, kMost, "a finite number >= noise.translation").in_voxels(), "Standard deviation along a direction that the geometry does not hold at all."});
  }
  // clang-format on
};

template <>
struct Fields<reconstruction::Options> {
  static constexpr const char* kName = "ReconstructionOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence = "Options of a reconstruction. Lengths are in voxels.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = reconstruction::Options;
    v(&O::voxel_size, {"voxel_size", kLength, "Of the clouds."});
    v(&O::consistency, {"consistency", "Loop consistency of the pairs."});
    v(&O::noise, {"noise", "Noise of registered poses."});
    v(&O::drift, {"drift", "Noise of odometry without an information matrix."});
    v(&O::information_unit, {"information_unit", kPositive.in_voxels(), "Length in which the information eigenvalues count rotations."});
    v(&O::min_edge_confidence, {"min_edge_confidence", kPositiveUpToOne, "Confidence, after loop consistency, from which a pair takes part."});
    v(&O::min_connection_confidence, {"min_connection_confidence", kPositiveUpToOne, "Probability from which the connection between two parts of the map counts: that one of the accepted edges between them is correct."});
    v(&O::modes, {"modes", from(1, 16), "Number of modes of a pair that take part."});
    v(&O::min_island, {"min_island", from(2, kInfinity), "Scans of an island; smaller ones are left out."});
    v(&O::threads, {"threads", from(0, kInfinity), "0: one per core. Results do not depend on it."});
  }
  // clang-format on
};

template <>
struct Fields<reconstruction::RefineOptions> {
  static constexpr const char* kName = "MapRefineOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence =
      "Options of the joint refinement of a map. Lengths are in voxels.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = reconstruction::RefineOptions;
    v(&O::voxel_size, {"voxel_size", kLength, "Of the registration."});
    v(&O::initial_distance, {"initial_distance", kPositive.in_voxels(), "Largest distance of a correspondence in the first iterations."});
    v(&O::final_distance, {"final_distance", above(0, kMost, "a finite number > 0 and <= initial_distance").in_voxels(), "The same in the last ones."});
    v(&O::max_normal_angle, {"max_normal_angle", above(0, 90, "(0, 90]").in("degrees"), "Between the normals of a correspondence."});
    v(&O::kernel_width, {"kernel_width", kPositive.in_voxels(), "Width of the Geman-McClure kernel on the point-to-plane distance in the last iterations."});
    v(&O::iterations, {"iterations", from(1, kInfinity), "Number of iterations."});
    v(&O::max_edge_error, {"max_edge_error", kPositive.in_voxels(), "RMS distance between the measured and the refined pose over the overlap from which an edge is rejected in the end."});
    v(&O::max_points, {"max_points", from(16, kInfinity), "Points of a scan that look for correspondences in one other scan."});
    v(&O::min_overlap, {"min_overlap", from(1, kInfinity), "Points within initial_distance of the other scan from which two scans overlap."});
    v(&O::point_noise, {"point_noise", kPositive.in_voxels(), "Standard deviation of a point-to-plane distance."});
    v(&O::correlated_points, {"correlated_points", from(1, kMost, "a finite number >= 1"), "Number of neighbouring points whose errors count as one."});
    v(&O::noise_range, {"noise_range", above(0, kInfinity, "a number > 0").in("voxels"), "Range from which the noise of a point grows with the square of its distance to the closest viewpoint."});
    v(&O::threads, {"threads", from(0, kInfinity), "0: one per core. Results do not depend on it."});
  }
  // clang-format on
};

}  // namespace gpureg::fields
