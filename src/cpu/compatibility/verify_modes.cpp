// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "cpu/common/stages.hpp"
#include "cpu/compatibility/moved_points.hpp"
#include "cpu/compatibility/observations.hpp"
#include "pipeline/conclude.hpp"
#include "pipeline/evidence_test.hpp"

namespace gpureg::cpu {
namespace {

/// True where the summaries may confirm inliers; otherwise they only refute.
bool decides(const RegistrationSettings& options) {
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

/// A group of 64 points under a pose.
struct PosedGroup {
  MovedGroup places, normals;
  void move(const Side& side, const Rigid& pose, std::size_t group) {
    const std::size_t k = group * MovedPoints::kGroup;
    places.move(pose, &side.order.x[k], &side.order.y[k], &side.order.z[k]);
  }
  void turn(const Side& side, const Rigid& pose, std::size_t group) {
    const std::size_t k = group * MovedPoints::kGroup;
    normals.turn(pose, &side.order.nx[k], &side.order.ny[k], &side.order.nz[k]);
  }
};

/// Observations of a group by the first `maps` maps of the other cloud, with incidences if
/// requested.
Observations observations_of(const Side& side, const PosedGroup& at, const EvidenceTest& test,
                             std::uint32_t maps, Incidences* incidences = nullptr) {
  Observations out;
  for (std::uint32_t m = 0; m < maps; ++m)
    add_observations(side.other.visibility, m, at.places, test.margin, test.min_range, out,
                     &at.normals, incidences);
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
  PosedGroup at;
  const std::uint32_t maps = coarse_score_maps(side.other.visibility);
  points.for_each_group(pose, [&](std::size_t group, const PointBounds& bounds) {
    const std::uint64_t present = points.present(group),
                        certain = decide ? bounds.certain & present : 0;
    Observations s;
    if (maps > 0) {
      at.move(side, pose, group);
      s = observations_of(side, at, test, maps);
    }
    s.violating &= present;
    for (std::uint64_t left = certain; left != 0; left &= left - 1)
      e.add(Term::normal_weighted,
            sample.normal_weight[group * MovedPoints::kGroup +
                                 static_cast<std::size_t>(__builtin_ctzll(left))]);
    std::uint64_t hits = certain;
    const std::uint64_t open =
        (bounds.possible | points.near_any(group, s.violating)) & present & ~certain;
    points.closest(pose, group, open, test.inlier.max_squared, [&](std::size_t k, Vec3, Closest c) {
      if (c.index == kNoValue) return;
      hits |= std::uint64_t(1) << k % MovedPoints::kGroup;
      const bool inlier = normals_agree(rotate(pose, points.normal(k)), side.other.normals[c.index],
                                        test.inlier.min_cosine);
      e.add(Term::normal_weighted, inlier ? sample.normal_weight[k] : 0u);
    });
    e.add(Term::observed, count(s.observed & present));
    e.add(Term::violating, count(s.violating & ~hits));
  });
  return e;
}

/// verify_point() of all points of one side. Calls visit(k, closest, inlier) for the points with a
/// closest point.
template <typename Visit>
SideEvidence verify_side(MovedPoints& points, const Side& side, const Rigid& pose,
                         const EvidenceTest& test, Visit&& visit) {
  SideEvidence e{};
  PosedGroup at;
  points.for_each_group(pose, [&](std::size_t group, const PointBounds&) {
    const std::uint64_t present = points.present(group);
    at.move(side, pose, group);
    at.turn(side, pose, group);
    Incidences incidences;
    const Observations s =
        observations_of(side, at, test, side.other.visibility.count, &incidences);
    ComparedPoint compared[MovedPoints::kGroup] = {};
    points.closest(pose, group, points.near_any(group, present), test.inlier.max_squared,
                   [&](std::size_t k, Vec3, Closest c) {
                     if (c.index == kNoValue) return;
                     const bool inlier =
                         normals_agree(rotate(pose, points.normal(k)), side.other.normals[c.index],
                                       test.inlier.min_cosine);
                     ComparedPoint& p = compared[k % MovedPoints::kGroup];
                     p.hit = true;
                     p.inlier = inlier;
                     p.squared_distance = c.squared_distance;
                     p.weight = inlier ? side.moved.normal_weight[side.order.index[k]] : 0u;
                     visit(side.order.index[k], c, inlier);
                   });
    for (std::uint64_t left = present; left != 0; left &= left - 1) {
      const int k = __builtin_ctzll(left);
      const auto in = [&](std::uint64_t mask) { return (mask >> k & 1) != 0; };
      ComparedPoint& p = compared[k];
      p.moved = at.places.at(k);
      p.normal = at.normals.at(k);
      p.seen = {in(s.observed), in(s.violating), in(s.surface), incidences.observed[k],
                incidences.violating[k]};
      add_evidence(p, side.other, test, e);
    }
  });
  return e;
}

}  // namespace

void score_candidates(Exec& exec, Span<const PairView> pairs, const std::vector<MatchSet>& matches,
                      std::vector<Candidates>& candidates, const RegistrationSettings& options) {
  const EvidenceTest test = pipeline::evidence_test(options);
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
              smaller_share(candidates[p].matches[k], matches[p].source_total,
                            matches[p].target_total),
              a, static_cast<float>(source[p].weight), b, static_cast<float>(target[p].weight));
        }
      });
}

void verify_modes(Exec& exec, Span<const PairView> pairs, const std::vector<MatchSet>& matches,
                  const std::vector<Candidates>& candidates,
                  const std::vector<std::vector<Mode>>& modes, const RegistrationSettings& options,
                  Span<PairOutcome> outcomes) {
  const EvidenceTest test = pipeline::evidence_test(options);
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
