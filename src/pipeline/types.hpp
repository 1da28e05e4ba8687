// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cloud.hpp"
#include "algorithm/evidence.hpp"
#include "algorithm/moments.hpp"
#include "algorithm/prior.hpp"
#include "algorithm/support.hpp"
#include "gpureg/options.hpp"
#include "gpureg/statistics.hpp"

#include <vector>

/// What goes through the pipeline: plain data, no Eigen, so that stages may be compiled with flags
/// of their own.
namespace gpureg {

/// A cloud as the caller has it (host memory): PointCloudView after validation.
struct RawCloud {
  const float* points;
  std::size_t size, point_stride;
  const float* normals;
  std::size_t normal_stride;
  const float* features;
  std::size_t feature_dimension, feature_stride;
  const float* viewpoints;
  std::size_t viewpoint_count;
};

/// One pair as stages see it. matches: the caller's own correspondences instead of features; count
/// 0 and null otherwise.
struct PairView {
  CloudView source;
  CloudView target;
  const std::uint32_t* custom_source;
  const std::uint32_t* custom_target;
  std::uint32_t custom_count;
  PriorTest prior{};
};

/// A refined pose with its evidence, in local coordinates of both clouds.
struct ModeOutcome {
  Pose<double> pose{1, 0, 0, 0, 0, 0, 0};
  std::uint32_t hypothesis = 0;  ///< seed that it came from
  std::uint32_t iterations = 0;
  /// Index of the mode that it was perturbed from (degeneracy search), or its own.
  std::uint32_t origin_mode = 0;
  MatchEvidence matches{0, 0, 0};
  SideEvidence source{}, target{};
  InformationSums information{};
  Moments source_moments{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
  Moments target_moments{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
};

/// Result of one pair in local coordinates of both clouds.
struct PairOutcome {
  RegistrationReason reason = RegistrationReason::none;
  bool has_pose = false;
  Pose<double> pose{1, 0, 0, 0, 0, 0, 0};
  Support support{0, 0, 0};
  Moments source_moments{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
  Moments target_moments{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
  std::vector<ModeOutcome> modes;  ///< distinct poses, in order of their coarse_score
  /// of all matches, what MatchEvidence is relative to
  std::uint64_t match_weight_source = 0, match_weight_target = 0;
  RegistrationStatistics statistics;
  StageTimings timings;
};

/// Poses of a pair to refine and verify, in local coordinates of both clouds.
struct PosesOfPair {
  std::uint32_t origin_mode = 0;  ///< index of the mode that they were perturbed from, if any
  std::vector<Pose<double>> poses;
};
/// Perturbed poses of a pair at most (degeneracy search).
constexpr std::uint32_t kMaxPerturbedPoses = 8;

}  // namespace gpureg
