// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "gpureg/registration.hpp"

/// Evidence and confidence for poses that another method proposes: ICP, a learned network,
/// odometry, an image loop.
namespace gpureg {

struct VerificationOptions {
  /// Refine every pose by ICP (RegistrationOptions::refine_iterations) before it is verified.
  bool refine = false;
  /// Also align the pair, so that the confidence of a pose takes the alternatives into account, as
  /// that of align() does. Without, a pose competes with the other given ones only: faster, and too
  /// confident if the clouds overlap well in several poses.
  bool search_alternatives = true;
};

/// Verdict on one pose of a pair.
struct PoseVerification {
  /// As given, or refined.
  UnalignedIsometry3d target_from_source = no_pose();
  double confidence = 0;  ///< probability that the pose is correct
  /// Probability that the pose is correct and the clouds overlap by 30 % or more.
  double overlap_confidence = 0;
  PoseEvidence evidence;
  std::uint32_t inliers = 0;  ///< points of the moved cloud that overlap
  std::uint32_t points = 0;   ///< points of the moved cloud, the smaller one
  double inlier_ratio = 0;    ///< inliers / points, [0, 1]
  double inlier_rmse = 0;     ///< metres, over the inliers
  /// Moments of all correspondences within max_correspondence_distance, from which information
  /// matrices follow; see RegistrationResult.
  CorrespondenceMoments source_moments;
  CorrespondenceMoments target_moments;
};

/// Verifies poses of one pair of prepared clouds by the evidence that align() uses
/// (RegistrationMethod::compatibility): for a mode that align() returned it gives the same
/// evidence.
///
/// @param poses target_from_source in the clouds' frames, any number of them.
/// @param options as for align(); quadruples and method are not used.
/// @return one entry for each pose, in their order. Deterministic, the same bits on every backend.
/// @throws InvalidArgument naming the pose that is no rigid motion; otherwise as align().
/// Thread-safe.
std::vector<PoseVerification> verify_poses(const Context& context, const PreparedCloud& source,
                                           const PreparedCloud& target,
                                           const std::vector<UnalignedIsometry3d>& poses,
                                           const RegistrationOptions& options = {},
                                           const VerificationOptions& verification = {});

/// The same for many pairs at once: poses[k] belongs to pairs[k].
/// @throws InvalidArgument also if poses and pairs differ in number.
std::vector<std::vector<PoseVerification>> verify_poses_batch(
    const Context& context, const std::vector<PreparedCloud>& clouds,
    const std::vector<Pair>& pairs, const std::vector<std::vector<UnalignedIsometry3d>>& poses,
    const RegistrationOptions& options = {}, const VerificationOptions& verification = {});

}  // namespace gpureg
