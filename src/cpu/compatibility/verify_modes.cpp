// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "cpu/common/stages.hpp"
#include "cpu/compatibility/moved_points.hpp"
#include "cpu/compatibility/observations.hpp"
#include "pipeline/conclude.hpp"

namespace gpureg::cpu {
namespace {

float smaller_share(const MatchEvidence& m, const MatchSet& set) {
  const float s = static_cast<float>(m.source_weight) / static_cast<float>(set.source_total);
  const float t = static_cast<float>(m.target_weight) / static_cast<float>(set.target_total);
  return s < t ? s : t;
}

EvidenceTest test_of(const RegistrationOptions& options) {
  return {
      inlier_test(options.prepare.max_correspondence_distance, options.evidence.max_normal_angle),
      options.evidence.free_space_margin, options.evidence.min_range};
}

/// True where the summaries may confirm inliers; otherwise they only refute.
bool decides(const RegistrationOptions& options) {
  return options.evidence.max_normal_angle <= 90.0f;
}

/// One direction of a pair: points of `moved` against `other`.
struct Side {
  const CloudView &moved, &other;
  const ScoringOrder& order;
  const SummaryLimits& limits;
};

/// The points of a cloud in the coarse score.
struct Sample {
  ScoringOrder order;
  std::vector<std::uint32_t> normal_weight;  ///< in that order, 0 for padding
  std::uint64_t weight = 0;
};

Sample sample_of(const CloudView& cloud, std::uint32_t most) {
  Sample out;
  out.order = sampled_order(executor_data(cloud), sample_stride(cloud.size, most));
  for (const std::uint32_t i : out.order.index) {
    out.normal_weight.push_back(i == kNoValue ? 0 : cloud.normal_weight[i]);
    out.weight += out.normal_weight.back();
  }
  return out;
}

/// Observations of a group by the first `maps` maps of the other cloud, with incidences if
/// requested.
Observations observations_of(const Side& side, const Rigid& pose, std::size_t group,
                             std::uint64_t present, const EvidenceTest& test, std::uint32_t maps,
                             Incidences* incidences = nullptr) {
  Observations out;
  if (maps == 0) return out;
  const std::size_t first = group * MovedPoints::kGroup;
  MovedGroup places, normals;
  places.move(pose, side.order.x.data() + first, side.order.y.data() + first,
              side.order.z.data() + first);
  if (incidences)
    normals.turn(pose, side.order.nx.data() + first, side.order.ny.data() + first,
                 side.order.nz.data() + first);
  for (std::uint32_t m = 0; m < maps; ++m)
    add_observations(side.other.visibility, m, places, test.margin, test.min_range, out, &normals,
                     incidences);
  out.observed &= present;
  out.violating &= present;
  out.surface &= present;
  return out;
}

std::uint32_t count(std::uint64_t mask) {
  return static_cast<std::uint32_t>(__builtin_popcountll(mask));
}

/// Side evidence for coarse_score(): verify_point() of the sampled points that the cell summaries
/// leave undecided.
SideEvidence score_sample(MovedPoints& points, const Side& side, const Sample& sample,
                          const Rigid& pose, const EvidenceTest& test, bool decide) {
  SideEvidence e{};
  const std::uint32_t maps = coarse_score_maps(side.other.visibility);
  points.for_each_group(pose, [&](std::size_t group, const PointBounds& bounds) {
    const std::uint64_t present = points.present(group),
                        certain = decide ? bounds.certain & present : 0;
    Observations s = observations_of(side, pose, group, present, test, maps);
    for (std::uint64_t left = certain; left != 0; left &= left - 1)
      e.normal_weighted += sample.normal_weight[group * MovedPoints::kGroup +
                                                static_cast<std::size_t>(__builtin_ctzll(left))];
    std::uint64_t hits = certain;
    const std::uint64_t open =
        (bounds.possible | points.near_any(group, s.violating)) & present & ~certain;
    points.closest(pose, group, open, test.inlier.max_squared, [&](std::size_t k, Vec3, Closest c) {
      if (c.index == kNoValue) return;
      hits |= std::uint64_t(1) << k % MovedPoints::kGroup;
      const bool inlier = normals_agree(rotate(pose, points.normal(k)), side.other.normals[c.index],
                                        test.inlier.min_cosine);
      e.normal_weighted += inlier ? sample.normal_weight[k] : 0u;
    });
    e.observed += count(s.observed);
    e.violating += count(s.violating & ~hits);
  });
  return e;
}

std::uint64_t sum_incidences(const float (&incidences)[64], std::uint64_t mask) {
  std::uint64_t sum = 0;
  for (int k = 0; k < 64; ++k) sum += (mask >> k & 1) != 0 ? fixed_incidence(incidences[k]) : 0u;
  return sum;
}

/// add_surface_side() of the points of a group.
void add_surface_sides(const MovedPoints& points, std::size_t group, std::uint64_t present,
                       std::uint64_t hits, const Rigid& pose, const SurfaceSideView& surface_sides,
                       SideEvidence& e) {
  if (!surface_sides.words) return;
  for (std::uint64_t left = present; left != 0; left &= left - 1) {
    const int k = __builtin_ctzll(left);
    const Vec3 p = points.point(group * MovedPoints::kGroup + static_cast<std::size_t>(k));
    add_surface_side(surface_side_at(surface_sides, apply(pose, p)), (hits >> k & 1) != 0, e);
  }
}

/// verify_point() of all points of one side. Calls visit(k, closest, inlier) for the points with a
/// closest point.
template <typename Visit>
SideEvidence verify_side(MovedPoints& points, const Side& side, const Rigid& pose,
                         const EvidenceTest& test, Visit&& visit) {
  SideEvidence e{};
  points.for_each_group(pose, [&](std::size_t group, const PointBounds&) {
    const std::uint64_t present = points.present(group);
    Incidences incidences;
    const Observations s =
        observations_of(side, pose, group, present, test, side.other.visibility.count, &incidences);
    std::uint64_t hits = 0;
    points.closest(
        pose, group, points.near_any(group, present), test.inlier.max_squared,
        [&](std::size_t k, Vec3, Closest c) {
          if (c.index == kNoValue) return;
          hits |= std::uint64_t(1) << k % MovedPoints::kGroup;
          const bool inlier = normals_agree(rotate(pose, points.normal(k)),
                                            side.other.normals[c.index], test.inlier.min_cosine);
          e.inliers += inlier ? 1u : 0u;
          e.normal_weighted += inlier ? side.moved.normal_weight[side.order.index[k]] : 0u;
          e.residual +=
              inlier ? fixed_residual(c.squared_distance, test.inlier.inverse_max_squared) : 0u;
          visit(side.order.index[k], c, inlier);
        });
    add_surface_sides(points, group, present, hits, pose, side.other.surface_sides, e);
    const std::uint64_t before = s.violating & ~hits;
    e.tested += count(present);
    e.hits += count(hits);
    e.observed += count(s.observed);
    e.violating += count(before);
    e.incidence_observed += sum_incidences(incidences.observed, s.observed);
    e.incidence_violating += sum_incidences(incidences.violating, before);
    e.occluded += count(s.observed & ~before & ~s.surface & ~hits);
  });
  return e;
}

}  // namespace

void score_candidates(Exec& exec, Span<const PairView> pairs, const std::vector<MatchSet>& matches,
                      std::vector<Candidates>& candidates, const RegistrationOptions& options) {
  const EvidenceTest test = test_of(options);
  const SummaryLimits exact(options.evidence.max_normal_angle, true),
      inexact(options.evidence.max_normal_angle, false);
  std::vector<Sample> source(pairs.size), target(pairs.size);
  exec.parallel(pairs.size, [&](std::size_t p) {
    source[p] = sample_of(pairs[p].source, options.evidence.sample);
    target[p] = sample_of(pairs[p].target, options.evidence.sample);
    candidates[p].coarse_score.resize(candidates[p].pose.size());
  });
  exec.parallel_items(
      pairs.size, [&](std::size_t p) { return candidates[p].pose.size(); }, 32,
      [&](std::size_t p, std::size_t begin, std::size_t end) {
        const CloudView &s = pairs[p].source, &t = pairs[p].target;
        const Side forth{s, t, source[p].order,
                         exact_distance(t, test.inlier.max_squared) ? exact : inexact};
        const Side back{t, s, target[p].order,
                        exact_distance(s, test.inlier.max_squared) ? exact : inexact};
        MovedPoints source_points(forth.order, t, forth.limits),
            target_points(back.order, s, back.limits);
        for (std::size_t k = begin; k < end; ++k) {
          const Rigid pose = to_rigid(candidates[p].pose[k]);
          if (!permitted(pairs[p].prior, pose)) {
            candidates[p].coarse_score[k] = 0.0f;
            continue;
          }
          const SideEvidence a =
              score_sample(source_points, forth, source[p], pose, test, decides(options));
          const SideEvidence b =
              score_sample(target_points, back, target[p], inverse(pose), test, decides(options));
          candidates[p].coarse_score[k] = coarse_score(
              smaller_share(candidates[p].matches[k], matches[p]), a,
              static_cast<float>(source[p].weight), b, static_cast<float>(target[p].weight));
        }
      });
}

void verify_modes(Exec& exec, Span<const PairView> pairs, const std::vector<MatchSet>& matches,
                  const std::vector<Candidates>& candidates,
                  const std::vector<std::vector<Mode>>& modes, const RegistrationOptions& options,
                  Span<PairOutcome> outcomes) {
  const EvidenceTest test = test_of(options);
  const SummaryLimits limits(options.evidence.max_normal_angle, false);
  const float squared_distance =
      options.compatibility.consensus_distance * options.compatibility.consensus_distance;
  for (std::size_t p = 0; p < pairs.size; ++p) outcomes[p].modes.assign(modes[p].size(), {});
  exec.parallel_items(
      pairs.size, [&](std::size_t p) { return modes[p].size(); }, 1,
      [&](std::size_t p, std::size_t k, std::size_t) {
        const CloudView &s = pairs[p].source, &t = pairs[p].target;
        const Mode& mode = modes[p][k];
        ModeOutcome& out = outcomes[p].modes[k];
        const Rigid there = to_rigid(mode.pose), back = inverse(there);
        out.pose = mode.pose;
        out.hypothesis = mode.seed;
        out.iterations = mode.iterations;
        out.matches = count_matches(matches[p], there, squared_distance);
        const Side forth{s, t, executor_data(s).order, limits},
            reverse{t, s, executor_data(t).order, limits};
        MovedPoints source_points(forth.order, t, limits), target_points(reverse.order, s, limits);
        out.source = verify_side(
            source_points, forth, there, test, [&](std::uint32_t i, const Closest& c, bool inlier) {
              if (inlier) add_information(s, there, i, out.information);
              add_moment(s.points[i] * (1.0f / s.radius), out.source_moments);
              add_moment(t.points[c.index] * (1.0f / t.radius), out.target_moments);
            });
        out.target = verify_side(target_points, reverse, back, test,
                                 [](std::uint32_t, const Closest&, bool) {});
      });
  for (std::size_t p = 0; p < pairs.size; ++p) {
    PairOutcome& out = outcomes[p];
    out.match_weight_source = matches[p].source_total;
    out.match_weight_target = matches[p].target_total;
    pipeline::count_seeds(pairs[p].source.size, pairs[p].target.size, matches[p].size(),
                          candidates[p].pose.size(), options, out.statistics);
  }
}

}  // namespace gpureg::cpu
