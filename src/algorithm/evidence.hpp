// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cloud.hpp"
#include "algorithm/icp.hpp"
#include "algorithm/inlier.hpp"
#include "algorithm/normal_weight.hpp"
#include "math/trigonometry.hpp"

namespace gpureg {

/// Evidence of one side of a pose: counts over the points of one cloud moved into the other.
/// Integers, so that every order of summation gives the same bits.
struct SideEvidence {
  std::uint64_t normal_weighted;  ///< sum of the normal weights of the inliers
  std::uint64_t residual;         ///< of the inliers, see fixed_residual
  /// Sums of incidence(), the maximum over the viewpoints, of the observed and of the violating
  /// points.
  std::uint64_t incidence_observed, incidence_violating;
  std::uint32_t tested;        ///< points compared
  std::uint32_t inliers;       ///< closest point within the distance, normals within the angle
  std::uint32_t hits;          ///< closest point within the distance, whatever the normals
  std::uint32_t observed;      ///< in a direction that a viewpoint of the other cloud observed
  std::uint32_t violating;     ///< in observed free space, without a point within the distance
  std::uint32_t occluded;      ///< behind every surface observed in their direction
  std::uint32_t near_surface;  ///< in a marked cell of the other cloud, see surface_sides.hpp
  /// Points without a hit outside surface cells, each counted at the first side that applies.
  std::uint32_t front_violation_near, front_violation_far, behind_surface;
};

/// Matches that a pose brings within the consensus distance: their number and the sums of their
/// normal weights (normal_weight.hpp).
struct MatchEvidence {
  std::uint64_t source_weight, target_weight;
  std::uint32_t inliers;
};

/// Thresholds of the evidence.
struct EvidenceTest {
  InlierTest inlier;
  float margin, min_range;
};

/// Sums for the information matrix of the inliers: 21 entries of J'J and the sum of the arms, as in
/// IcpSums.
struct InformationSums {
  std::int64_t v[21];
  std::int64_t arm[3];
};

/// Counts a point by its side of the surfaces. side: bits of SurfaceSide; hit: it has a closest
/// point.
GPUREG_HD void add_surface_side(std::uint32_t side, bool hit, SideEvidence& e) {
  const bool open = !hit & ((side & kOnSurface) == 0), near = (side & kFrontNear) != 0,
             far = (side & kFrontFar) != 0;
  e.near_surface += side != 0 ? 1u : 0u;
  e.front_violation_near += open & near ? 1u : 0u;
  e.front_violation_far += open & !near & far ? 1u : 0u;
  e.behind_surface += open & !near & !far & (side != 0) ? 1u : 0u;
}

/// A moved point and its closest point in the other cloud.
struct ComparedPoint {
  Vec3 moved, normal;      ///< under the pose
  bool hit, inlier;        ///< a closest point within the distance; with an agreeing normal
  float squared_distance;  ///< of a hit
  std::uint32_t weight;    ///< normal weight of the moved point
};

/// Adds the evidence of one point. maps: number of depth maps of the other cloud that are compared.
GPUREG_HD void add_evidence(const ComparedPoint& p, const CloudView& other,
                            const EvidenceTest& test, std::uint32_t maps, SideEvidence& e) {
  const bool hit = p.hit, inlier = p.inlier;
  bool observed = false, violating = false, surface = false;
  float incidence_observed = 0.0f, incidence_violating = 0.0f;
  for (std::uint32_t m = 0; m < maps; ++m) {
    const Observation s = observe(other.visibility, m, p.moved, test.margin, test.min_range);
    if (s == Observation::unknown) continue;
    const float weight = incidence(p.normal, p.moved - other.visibility.viewpoints[m]);
    observed = true;
    incidence_observed = weight > incidence_observed ? weight : incidence_observed;
    surface |= s == Observation::surface;
    if (s != Observation::free_space) continue;
    violating = true;
    incidence_violating = weight > incidence_violating ? weight : incidence_violating;
  }
  violating &= !hit;
  e.tested += 1;
  e.hits += hit ? 1u : 0u;
  e.inliers += inlier ? 1u : 0u;
  e.normal_weighted += inlier ? p.weight : 0u;
  e.residual += inlier ? fixed_residual(p.squared_distance, test.inlier.inverse_max_squared) : 0u;
  e.observed += observed ? 1u : 0u;
  e.violating += violating ? 1u : 0u;
  e.incidence_observed += fixed_incidence(incidence_observed);
  e.incidence_violating += violating ? fixed_incidence(incidence_violating) : 0u;
  e.occluded += (observed & !violating & !surface & !hit) ? 1u : 0u;
  add_surface_side(other.surface_sides.words ? surface_side_at(other.surface_sides, p.moved) : 0u,
                   hit, e);
}

/// Adds the evidence of point i of `moved` under the pose.
GPUREG_HD void verify_point(const CloudView& moved, const CloudView& other, const Rigid& pose,
                            const EvidenceTest& test, std::uint32_t maps, std::uint32_t i,
                            SideEvidence& e) {
  const Vec3 q = apply(pose, moved.points[i]), normal = rotate(pose, moved.normals[i]);
  const Closest c = find_closest(other.closest, other.points, q, test.inlier.max_squared);
  const bool hit = c.index != kNoValue;
  add_evidence(
      {q, normal, hit, hit && normals_agree(normal, other.normals[c.index], test.inlier.min_cosine),
       c.squared_distance, moved.normal_weight[i]},
      other, test, maps, e);
}

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

/// Exponent of the coarse score per unit of free-space violation: a violation of 17 % on one side
/// halves the score.
constexpr float kViolationPenalty = 4.0f;

/// Coarse score of a candidate, which orders candidates before refinement: root of the match
/// support times the normal-weighted overlap of both sides, reduced by free-space violations.
/// match_share: in [0, 1]; weight_a, weight_b: normal weight of each side's whole sample.
GPUREG_HD float coarse_score(float match_share, const SideEvidence& a, float weight_a,
                             const SideEvidence& b, float weight_b) {
  const float overlap = static_cast<float>(a.normal_weighted) / weight_a +
                        static_cast<float>(b.normal_weighted) / weight_b;
  const float va =
      a.observed > 0 ? static_cast<float>(a.violating) / static_cast<float>(a.observed) : 0.0f;
  const float vb =
      b.observed > 0 ? static_cast<float>(b.violating) / static_cast<float>(b.observed) : 0.0f;
  // 1 / (series of e^x), in float for speed.
  const float x = kViolationPenalty * (va + vb);
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
