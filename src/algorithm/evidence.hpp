// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/balance.hpp"
#include "algorithm/cloud.hpp"
#include "algorithm/icp.hpp"
#include "algorithm/inlier.hpp"

namespace gpureg {

/// What speaks for and against a pose on one side: the points of one cloud moved into the other.
/// Integers only.
struct SideEvidence {
  std::uint64_t balanced;  ///< sum of the weights of the inliers
  std::uint64_t residual;  ///< of the inliers, see fixed_residual
  /// of those seen and before, sums of how squarely at best, see facing()
  std::uint64_t facing_seen, facing_before;
  std::uint32_t tested;   ///< points looked at
  std::uint32_t inliers;  ///< closest point within the distance, normals alike
  std::uint32_t hits;     ///< closest point within the distance
  std::uint32_t seen;     ///< in a direction that some viewpoint of the other cloud saw
  std::uint32_t before;   ///< in front of a seen surface without touching any: impossible places
  std::uint32_t hidden;   ///< behind every surface seen in their direction
  std::uint32_t around;   ///< in cells of the other cloud's fronts, see fronts.hpp
  /// of those that touch nothing and are in no surface's cell, by the first that holds
  std::uint32_t near_front, far_front, at_back;
};

/// Matches that a pose brings together, by number and by the weights of their points' normals (see
/// balance.hpp).
struct MatchEvidence {
  std::uint64_t source_weight, target_weight;
  std::uint32_t inliers;
};

/// What makes a point count for or against.
struct EvidenceTest {
  InlierTest inlier;
  float margin, min_range;
};

/// Sums of the information matrix of the inliers: 21 entries of J'J and the sum of the arms, as in
/// IcpSums.
struct InformationSums {
  std::int64_t v[21];
  std::int64_t arm[3];
};

struct Weighed {
  std::uint32_t closest;  ///< kNoValue: none within the distance
  bool inlier;
};

/// place: of a point, the bits of fronts.hpp.
GPUREG_HD void add_place(std::uint32_t place, bool hit, SideEvidence& e) {
  const bool open = !hit & ((place & kOnSurface) == 0), near = (place & kNearFront) != 0,
             far = (place & kFarFront) != 0;
  e.around += place != 0 ? 1u : 0u;
  e.near_front += open & near ? 1u : 0u;
  e.far_front += open & !near & far ? 1u : 0u;
  e.at_back += open & !near & !far & (place != 0) ? 1u : 0u;
}

/// One point of `moved` under the pose, against the other cloud; maps: how many of its viewpoints
/// are asked. q: the moved point, c: what is closest to it.
GPUREG_HD Weighed weigh_found(const CloudView& moved, const CloudView& other, const Rigid& pose,
                              const EvidenceTest& test, std::uint32_t maps, std::uint32_t i, Vec3 q,
                              Closest c, SideEvidence& e) {
  const Vec3 normal = rotate(pose, moved.normals[i]);
  const bool hit = c.index != kNoValue;
  const bool inlier = hit && normals_agree(normal, other.normals[c.index], test.inlier.min_cosine);
  bool seen = false, before = false, surface = false;
  float facing_seen = 0.0f, facing_before = 0.0f;
  for (std::uint32_t m = 0; m < maps; ++m) {
    const Sight s = sight(other.visibility, m, q, test.margin, test.min_range);
    if (s == Sight::unknown) continue;
    const float squarely = facing(normal, q - other.visibility.viewpoints[m]);
    seen = true;
    facing_seen = squarely > facing_seen ? squarely : facing_seen;
    surface |= s == Sight::surface;
    if (s != Sight::before) continue;
    before = true;
    facing_before = squarely > facing_before ? squarely : facing_before;
  }
  before &= !hit;
  e.tested += 1;
  e.hits += hit ? 1u : 0u;
  e.inliers += inlier ? 1u : 0u;
  e.balanced += inlier ? moved.balance[i] : 0u;
  e.residual += inlier ? fixed_residual(c.squared_distance, test.inlier.inverse_max_squared) : 0u;
  e.seen += seen ? 1u : 0u;
  e.before += before ? 1u : 0u;
  e.facing_seen += fixed_facing(facing_seen);
  e.facing_before += before ? fixed_facing(facing_before) : 0u;
  e.hidden += (seen & !before & !surface & !hit) ? 1u : 0u;
  add_place(other.fronts.words ? place_of(other.fronts, q) : 0u, hit, e);
  return {c.index, inlier};
}

GPUREG_HD Weighed weigh_point(const CloudView& moved, const CloudView& other, const Rigid& pose,
                              const EvidenceTest& test, std::uint32_t maps, std::uint32_t i,
                              SideEvidence& e) {
  const Vec3 q = apply(pose, moved.points[i]);
  return weigh_found(moved, other, pose, test, maps, i, q,
                     find_closest(other.closest, other.points, q, test.inlier.max_squared), e);
}

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

/// Step between the points that a sample of about `most` looks at.
GPUREG_HD std::uint32_t sample_stride(std::uint32_t points, std::uint32_t most) {
  return points <= most ? 1u : (points + most - 1) / most;
}

/// How many depth maps the quick look at a candidate asks.
GPUREG_HD std::uint32_t quick_maps(const VisibilityView& maps) {
  return maps.count < 1 ? maps.count : 1;
}

/// Weight of a point in [0, 1].
GPUREG_HD float balance_share(std::uint32_t weight) {
  return static_cast<float>(weight) * (1.0f / kBalanceScale);
}

/// Modes are refined twice: on a sample, then on all points with a kernel this much narrower. The
/// wide kernel pulls from afar; the narrow one ends at the surfaces, where the wide one is still
/// pulled along by what slides.
constexpr float kPolishKernel = 0.5f;
/// shares of the max distance that end the first and the second refinement
constexpr double kRoughSettled = 1e-2, kPolishSettled = 2e-3;
/// degrees between the normals of what refinement pulls together
constexpr float kRefineNormalAngle = 45.0f;

/// On the host only: trace of the rotation by that angle.
inline float mode_trace(float degrees) {
  return static_cast<float>(
      1.0 + 2.0 * std::cos(static_cast<double>(degrees) * 3.14159265358979323846 / 180.0));
}

/// Ranks candidates before the dear tests: correspondence support, overlap balanced over both
/// sides, and free space against it. match_share, overlaps: in [0, 1].
GPUREG_HD float promise(float match_share, const SideEvidence& a, float weight_a,
                        const SideEvidence& b, float weight_b) {
  const float overlap =
      static_cast<float>(a.balanced) / weight_a + static_cast<float>(b.balanced) / weight_b;
  const float va = a.seen > 0 ? static_cast<float>(a.before) / static_cast<float>(a.seen) : 0.0f;
  const float vb = b.seen > 0 ? static_cast<float>(b.before) / static_cast<float>(b.seen) : 0.0f;
  // 1 / (series of e^x): e^-x without a library's exp, whose last bit differs between machines.
  const float x = 4.0f * (va + vb);
  const float growth =
      fmaf(x, fmaf(x, fmaf(x, fmaf(x, 1.0f / 24.0f, 1.0f / 6.0f), 0.5f), 1.0f), 1.0f);
  return sqrtf(match_share) * overlap / growth;
}

/// True where two poses of the source bring it to the same place: less than the angle apart (by its
/// cosine's bound on the trace), the cloud's centre less than the distance.
GPUREG_HD bool same_mode(const Rigid& a, const Rigid& b, float min_trace, float squared_distance) {
  float trace = 0.0f;
  for (int k = 0; k < 9; ++k) trace = fmaf(a.r[k], b.r[k], trace);
  const Vec3 shift{a.t[0] - b.t[0], a.t[1] - b.t[1], a.t[2] - b.t[2]};
  return (trace >= min_trace) & (squared_norm(shift) <= squared_distance);
}

}  // namespace gpureg
