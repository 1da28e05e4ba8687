// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cloud.hpp"
#include "algorithm/icp.hpp"
#include "algorithm/normal_weight.hpp"
#include "algorithm/side_evidence.hpp"
#include "math/trigonometry.hpp"

namespace gpureg {

/// Matches that a pose brings within the consensus distance: their number and the sums of their
/// normal weights (normal_weight.hpp).
struct MatchEvidence {
  std::uint64_t source_weight, target_weight;
  std::uint32_t inliers;
};

/// Sums for the information matrix of the inliers: 21 entries of J'J and the sum of the arms, as in
/// IcpSums.
struct InformationSums {
  std::int64_t v[21];
  std::int64_t arm[3];
};

/// Adds one inlier to the point-to-plane information.
GPUREG_HD void add_information(const CloudView& moved, const Rigid& pose, std::uint32_t i,
                               InformationSums& sums) {
  const Vec3 arm = rotate(pose, moved.points[i]) * (1.0f / moved.radius);
  const Vec3 normal = rotate(pose, moved.normals[i]);
  const Vec3 turn = cross(arm, normal);
  const float j[6] = {turn.x, turn.y, turn.z, normal.x, normal.y, normal.z};
  int k = 0;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b <= a; ++b) sums.v[k++] += to_icp_fixed(j[a] * j[b]);
  sums.arm[0] += to_icp_fixed(arm.x);
  sums.arm[1] += to_icp_fixed(arm.y);
  sums.arm[2] += to_icp_fixed(arm.z);
}

/// Step between the points of a sample of about `most`.
GPUREG_HD std::uint32_t sample_stride(std::uint32_t points, std::uint32_t most) {
  return points <= most ? 1u : (points + most - 1) / most;
}

/// Number of depth maps that the coarse score compares: one, as the others cost more time than they
/// add to the ranking.
GPUREG_HD std::uint32_t coarse_score_maps(const VisibilityView& maps) {
  return maps.count < 1 ? maps.count : 1;
}

/// Weight of a point in [0, 1].
GPUREG_HD float normal_weight_share(std::uint32_t weight) {
  return static_cast<float>(weight) * (1.0f / kNormalWeightScale);
}

/// Modes are refined twice: on a sample, then on all points with a kernel narrower by this factor.
/// The wide kernel converges from farther away; the narrow one is less biased by surfaces that only
/// one of the clouds has.
constexpr float kPolishKernel = 0.5f;
/// Step length that ends the first and the second refinement, as a share of the distance limit.
constexpr double kRoughSettled = 1e-2, kPolishSettled = 2e-3;
/// Modes that are this close after the first refinement, as a share of the limits of a mode, become
/// one before the second. The second refinement moves them little, and together.
constexpr float kRoughMerge = 0.5f;
/// RMS displacement below which a perturbed pose has returned to its origin mode, or to another
/// perturbed pose, after the first refinement, as a share of the distance limit. Results drop poses
/// that end within the whole of it.
constexpr float kReturned = 0.5f;
/// Largest angle between the normals of a correspondence of the refinement, degrees.
constexpr float kRefineNormalAngle = 45.0f;

/// Host only: trace of a rotation by that angle.
inline float mode_trace(float degrees) {
  return static_cast<float>(
      1.0 + 2.0 * portable::cos(static_cast<double>(degrees) * 3.14159265358979323846 / 180.0));
}

/// Share of the matches' weights that a pose supports, of the worse side. total: of the source, of
/// the target.
GPUREG_HD float smaller_share(const MatchEvidence& m, std::uint64_t source_total,
                              std::uint64_t target_total) {
  const float s = static_cast<float>(m.source_weight) / static_cast<float>(source_total);
  const float t = static_cast<float>(m.target_weight) / static_cast<float>(target_total);
  return s < t ? s : t;
}

/// Exponent of the coarse score per unit of free-space violation: a violation of 17 % on one side
/// halves the score.
constexpr float kViolationPenalty = 4.0f;

/// Coarse score of a candidate, for the order before and after the first refinement: root of match
/// support times the normal-weighted overlap of both sides, reduced by free-space violations.
/// match_share: in [0, 1]; weight_a, weight_b: normal weight of each side's whole sample.
GPUREG_HD float coarse_score(float match_share, const SideEvidence& a, float weight_a,
                             const SideEvidence& b, float weight_b) {
  const float overlap = static_cast<float>(a[Term::normal_weighted]) / weight_a +
                        static_cast<float>(b[Term::normal_weighted]) / weight_b;
  const auto violation = [](const SideEvidence& side) {
    return side[Term::observed] > 0 ? static_cast<float>(side[Term::violating]) /
                                          static_cast<float>(side[Term::observed])
                                    : 0.0f;
  };
  // 1 / (series of e^x), in float for speed.
  const float x = kViolationPenalty * (violation(a) + violation(b));
  const float growth =
      fmaf(x, fmaf(x, fmaf(x, fmaf(x, 1.0f / 24.0f, 1.0f / 6.0f), 0.5f), 1.0f), 1.0f);
  return sqrtf(match_share) * overlap / growth;
}

/// Limits within which two poses are one mode.
struct ModeLimits {
  float min_trace, squared_distance;
};

/// Host only. share: of the limits of the options.
inline ModeLimits mode_limits(float angle, float distance, float share) {
  return {mode_trace(share * angle), (share * distance) * (share * distance)};
}

/// Mean and mean outer product (xx, xy, xz, yy, yz, zz) of points, and an origin pose of them.
struct ReturnTest {
  Pose<double> origin;
  double mean[3], outer[6];
  double squared_distance;  ///< negative: no pose returns
};

/// Mean squared displacement of the points from one pose to the other.
GPUREG_HD double squared_displacement(const Pose<double>& a, const Pose<double>& b,
                                      const ReturnTest& points) {
  double ra[9], rb[9];
  rotation_matrix(a, ra);
  rotation_matrix(b, rb);
  const double shift[3] = {a.tx - b.tx, a.ty - b.ty, a.tz - b.tz};
  const double* m = points.mean;
  const double* o = points.outer;
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double x = ra[3 * k] - rb[3 * k], y = ra[3 * k + 1] - rb[3 * k + 1],
                 z = ra[3 * k + 2] - rb[3 * k + 2];
    sum += x * (x * o[0] + 2.0 * (y * o[1] + z * o[2])) + y * (y * o[3] + 2.0 * z * o[4]) +
           z * z * o[5] + 2.0 * shift[k] * (x * m[0] + y * m[1] + z * m[2]) + shift[k] * shift[k];
  }
  return sum;
}

/// True where two poses belong to one mode: rotations within the angle (as a bound on the trace)
/// and the cloud's local origin within the distance.
GPUREG_HD bool same_mode(const Rigid& a, const Rigid& b, const ModeLimits& within) {
  float trace = 0.0f;
  for (int k = 0; k < 9; ++k) trace = fmaf(a.r[k], b.r[k], trace);
  const Vec3 shift{a.t[0] - b.t[0], a.t[1] - b.t[1], a.t[2] - b.t[2]};
  return (trace >= within.min_trace) & (squared_norm(shift) <= within.squared_distance);
}

}  // namespace gpureg
