// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cloud.hpp"
#include "algorithm/evidence.hpp"
#include "algorithm/moments.hpp"
#include "algorithm/prior.hpp"
#include "algorithm/support.hpp"
#include "common/limits.hpp"
#include "gpureg/statistics.hpp"
#include "settings/settings.hpp"

#include <vector>

/// Data of the pipeline: plain types without Eigen, so that stages may be compiled with flags of
/// their own.
namespace gpureg {

/// A validated PointCloudView (host memory).
struct RawCloud {
  const float* points;
  std::size_t size, point_stride;
  const float* normals;
  std::size_t normal_stride;
  const float* features;
  std::size_t feature_dimension, feature_stride;
  const float* viewpoints;
  std::size_t viewpoint_count;
  /// Points, normals and features are tight rows in memory of the engine's device, see
  /// DeviceEngine::adopt().
  bool on_device;
  /// Features alone are wanted: what poses are verified by may be left out, which takes less time.
  bool matched_only;
};

/// One pair for the stages. custom_*: given correspondences instead of features; null and 0
/// otherwise.
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
  Pose<double> pose = identity_pose<double>();
  std::uint32_t hypothesis = 0;  ///< seed of the candidate
  std::uint32_t iterations = 0;
  /// Index of the mode that this one was perturbed from (degeneracy search), or its own index.
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
  Pose<double> pose = identity_pose<double>();
  Support support{0, 0, 0};
  Moments source_moments{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
  Moments target_moments{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
  std::vector<ModeOutcome> modes;  ///< distinct poses, in order of their coarse_score
  /// Normal weights of all matches; MatchEvidence is relative to them.
  std::uint64_t match_weight_source = 0, match_weight_target = 0;
  RegistrationStatistics statistics;
  StageTimings timings;
};

/// Poses of a pair to refine and verify, in local coordinates of both clouds.
struct PosesOfPair {
  std::uint32_t origin_mode = 0;  ///< index of the mode that they were perturbed from, if any
  std::vector<Pose<double>> poses;
  ReturnTest returned{};  ///< of perturbed poses
};

}  // namespace gpureg
