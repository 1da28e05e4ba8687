// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cloud.hpp"
#include "algorithm/inlier.hpp"

namespace gpureg {

/// Terms of the evidence of one side of a pose: sums over the points of one cloud moved into the
/// other. Integers, so that every order of summation gives the same bits.
enum class Term : std::uint32_t {
  // Sums of fixed-point values.
  normal_weighted,  ///< normal weights of the inliers
  residual,         ///< of the inliers, see fixed_residual
  /// incidence(), the maximum over the viewpoints, of the observed and of the violating points.
  incidence_observed,
  incidence_violating,
  // Counts of points.
  tested,        ///< points compared
  inliers,       ///< closest point within the distance, normals within the angle
  hits,          ///< closest point within the distance, whatever the normals
  observed,      ///< in a direction that a viewpoint of the other cloud observed
  violating,     ///< in observed free space, without a point within the distance
  occluded,      ///< behind every surface observed in their direction
  near_surface,  ///< in a marked cell of the other cloud, see surface_sides.hpp
  // Without a hit outside surface cells, each counted at the first side that applies.
  front_violation_near,
  front_violation_far,
  behind_surface,
  count
};

constexpr std::uint32_t kTerms = static_cast<std::uint32_t>(Term::count);
/// Terms from here on grow by at most one for each point.
constexpr std::uint32_t kFirstCount = static_cast<std::uint32_t>(Term::tested);

/// Evidence of one side of a pose.
struct SideEvidence {
  std::int64_t sum[kTerms];
  GPUREG_HD std::int64_t& operator[](Term term) { return sum[static_cast<std::uint32_t>(term)]; }
  GPUREG_HD std::int64_t operator[](Term term) const {
    return sum[static_cast<std::uint32_t>(term)];
  }
  /// Of a term that counts points.
  GPUREG_HD std::uint32_t points(Term term) const {
    return static_cast<std::uint32_t>((*this)[term]);
  }
  GPUREG_HD void add(Term term, std::uint32_t value) { (*this)[term] += value; }
};

/// Thresholds of the evidence.
struct EvidenceTest {
  InlierTest inlier;
  float margin, min_range;
};

/// What the depth maps of the other cloud tell of a point, over all of their viewpoints.
struct PointObservation {
  bool observed, free_space, surface;     ///< in any map: known; before the surface; at the surface
  float incidence, free_space_incidence;  ///< the largest of the maps with that; 0: none
};

/// A moved point, its closest point in the other cloud, and what that cloud observed there.
struct ComparedPoint {
  Vec3 moved, normal;      ///< under the pose
  bool hit, inlier;        ///< a closest point within the distance; with an agreeing normal
  float squared_distance;  ///< of a hit
  std::uint32_t weight;    ///< normal weight of the moved point; read of inliers
  PointObservation seen;
};

/// maps: number of depth maps that are compared.
GPUREG_HD PointObservation observe_point(const VisibilityView& visibility, std::uint32_t maps,
                                         Vec3 moved, Vec3 normal, const EvidenceTest& test) {
  PointObservation out{false, false, false, 0.0f, 0.0f};
  for (std::uint32_t m = 0; m < maps; ++m) {
    const Observation s = observe(visibility, m, moved, test.margin, test.min_range);
    if (s == Observation::unknown) continue;
    const float weight = incidence(normal, moved - visibility.viewpoints[m]);
    out.observed = true;
    out.incidence = weight > out.incidence ? weight : out.incidence;
    out.surface |= s == Observation::surface;
    if (s != Observation::free_space) continue;
    out.free_space = true;
    out.free_space_incidence =
        weight > out.free_space_incidence ? weight : out.free_space_incidence;
  }
  return out;
}

/// Adds the evidence of one point: all terms, on all backends. Sums: SideEvidence, or sums of a
/// backend with the same add().
template <typename Sums>
GPUREG_HD void add_evidence(const ComparedPoint& p, const CloudView& other,
                            const EvidenceTest& test, Sums& e) {
  const PointObservation& seen = p.seen;
  const bool hit = p.hit, inlier = p.inlier, violating = seen.free_space & !hit;
  const std::uint32_t side =
      other.surface_sides.words ? surface_side_at(other.surface_sides, p.moved) : 0u;
  const bool open = !hit & ((side & kOnSurface) == 0), near = (side & kFrontNear) != 0,
             far = (side & kFrontFar) != 0;
  e.add(Term::tested, 1u);
  e.add(Term::hits, hit ? 1u : 0u);
  e.add(Term::inliers, inlier ? 1u : 0u);
  e.add(Term::normal_weighted, inlier ? p.weight : 0u);
  e.add(Term::residual,
        inlier ? fixed_residual(p.squared_distance, test.inlier.inverse_max_squared) : 0u);
  e.add(Term::observed, seen.observed ? 1u : 0u);
  e.add(Term::violating, violating ? 1u : 0u);
  e.add(Term::incidence_observed, fixed_incidence(seen.incidence));
  e.add(Term::incidence_violating, violating ? fixed_incidence(seen.free_space_incidence) : 0u);
  e.add(Term::occluded, (seen.observed & !violating & !seen.surface & !hit) ? 1u : 0u);
  e.add(Term::near_surface, side != 0 ? 1u : 0u);
  e.add(Term::front_violation_near, open & near ? 1u : 0u);
  e.add(Term::front_violation_far, open & !near & far ? 1u : 0u);
  e.add(Term::behind_surface, open & !near & !far & (side != 0) ? 1u : 0u);
}

/// Adds the evidence of point i of `moved` under the pose. maps: number of depth maps of the other
/// cloud that are compared.
GPUREG_HD void verify_point(const CloudView& moved, const CloudView& other, const Rigid& pose,
                            const EvidenceTest& test, std::uint32_t maps, std::uint32_t i,
                            SideEvidence& e) {
  const Vec3 q = apply(pose, moved.points[i]), normal = rotate(pose, moved.normals[i]);
  const Closest c = find_closest(other.closest, other.points, q, test.inlier.max_squared);
  const bool hit = c.index != kNoValue;
  add_evidence(
      {q, normal, hit, hit && normals_agree(normal, other.normals[c.index], test.inlier.min_cosine),
       c.squared_distance, moved.normal_weight[i],
       observe_point(other.visibility, maps, q, normal, test)},
      other, test, e);
}

}  // namespace gpureg
