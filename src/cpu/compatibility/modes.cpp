// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "algorithm/inlier.hpp"
#include "cpu/compatibility/icp_batch.hpp"
#include "cpu/compatibility/moved_points.hpp"

namespace gpureg::cpu {
namespace {

/// Normal equations from the points of the walk, with normal-space weights.
IcpSums mode_sums(MovedPoints& moved, const PairView& pair, const Pose<double>& pose,
                  const RegistrationSettings& options, float kernel_width, float min_cosine) {
  const Rigid rigid = to_rigid(pose);
  const CloudView &s = pair.source, &t = pair.target;
  const float max_squared =
      options.prepare.max_correspondence_distance * options.prepare.max_correspondence_distance;
  IcpBatch batch({rigid, min_cosine, kernel_width, 1.0f / s.radius,
                  1.0f / options.prepare.max_correspondence_distance});
  moved.for_each_group(rigid, [&](std::size_t group, const PointBounds& bounds) {
    moved.closest(rigid, group, bounds.possible, max_squared,
                  [&](std::size_t k, Vec3 q, Closest c) {
                    if (c.index == kNoValue || is_zero(t.normals[c.index])) return;
                    batch.add({moved.point(k), moved.normal(k), q, t.points[c.index],
                               t.normals[c.index], s.normal_weight[moved.order().index[k]]});
                  });
  });
  return batch.sums();
}

/// Iterates until it settles, at most max_iterations times.
void refine_mode(MovedPoints& moved, const PairView& pair, std::uint32_t max_iterations,
                 const RegistrationSettings& options, float kernel_width, double settled,
                 float min_cosine, Mode& mode) {
  for (std::uint32_t k = 0; k < max_iterations; ++k) {
    const IcpStep step =
        solve_icp(mode_sums(moved, pair, mode.pose, options, kernel_width, min_cosine),
                  pair.source.radius, options.prepare.max_correspondence_distance);
    ++mode.iterations;
    if (!step.valid) break;
    mode.pose = compose_small(step.omega, step.shift, mode.pose);
    if (icp_settled(step, pair.source.radius, options.prepare.max_correspondence_distance, settled))
      break;
  }
}

/// One refinement of all modes. order_of(p): the points of pair p that take part.
template <typename OrderOf>
void refine_each(Exec& exec, Span<const PairView> pairs, std::vector<std::vector<Mode>>& modes,
                 std::uint32_t max_iterations, const RegistrationSettings& options,
                 float kernel_width, double settled, const OrderOf& order_of) {
  const float min_cosine =
      inlier_test(options.prepare.max_correspondence_distance, kRefineNormalAngle).min_cosine;
  const SummaryLimits limits(kRefineNormalAngle, false);
  exec.parallel_items(
      pairs.size, [&](std::size_t p) { return modes[p].size(); }, 1,
      [&](std::size_t p, std::size_t k, std::size_t) {
        MovedPoints moved(order_of(p), pairs[p].target, limits);
        refine_mode(moved, pairs[p], max_iterations, options, kernel_width, settled, min_cosine,
                    modes[p][k]);
      });
}

/// On a sample of each source.
void refine_sample(Exec& exec, Span<const PairView> pairs, std::vector<std::vector<Mode>>& modes,
                   std::uint32_t max_iterations, const RegistrationSettings& options,
                   float kernel_width, double settled) {
  std::vector<ScoringOrder> sample(pairs.size);
  exec.parallel(pairs.size, [&](std::size_t p) {
    sample[p] =
        sampled_order(executor_data(pairs[p].source),
                      sample_stride(pairs[p].source.size, refinement_sample(options.evidence)));
  });
  refine_each(exec, pairs, modes, max_iterations, options, kernel_width, settled,
              [&](std::size_t p) -> const ScoringOrder& { return sample[p]; });
}

}  // namespace

std::vector<std::vector<Mode>> select_modes(Exec& exec, const std::vector<Candidates>& candidates,
                                            const ModeSelection& selection) {
  std::vector<std::vector<Mode>> out(candidates.size());
  exec.parallel(candidates.size(), [&](std::size_t p) {
    const Candidates& c = candidates[p];
    std::vector<std::uint32_t> order(c.pose.size());
    for (std::uint32_t k = 0; k < order.size(); ++k) order[k] = k;
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return c.coarse_score[a] > c.coarse_score[b];
    });
    std::vector<Rigid> taken;
    float least = 0.0f;
    for (const std::uint32_t k : order) {
      if (taken.size() == selection.most) break;
      if (taken.size() >= selection.certain && c.coarse_score[k] < least) break;
      const Rigid rigid = to_rigid(c.pose[k]);
      if (std::any_of(taken.begin(), taken.end(), [&](const Rigid& other) {
            return same_mode(rigid, other, selection.within);
          }))
        continue;
      if (taken.empty()) least = least_score(selection, c.coarse_score[k]);
      taken.push_back(rigid);
      out[p].push_back({widen(c.pose[k]), c.seed[k], 0});
    }
  });
  return out;
}

std::vector<Candidates> candidates_from_modes(Exec& exec, const std::vector<MatchSet>& matches,
                                              const std::vector<std::vector<Mode>>& modes,
                                              const RegistrationSettings& options) {
  const float squared_distance =
      options.compatibility.consensus_distance * options.compatibility.consensus_distance;
  std::vector<Candidates> out(modes.size());
  exec.parallel(modes.size(), [&](std::size_t p) {
    for (const Mode& mode : modes[p]) {
      const Pose<float> pose = narrow(mode.pose);
      out[p].pose.push_back(pose);
      out[p].seed.push_back(mode.seed);
      out[p].matches.push_back(count_matches(matches[p], to_rigid(pose), squared_distance));
    }
  });
  return out;
}

void refine_roughly(Exec& exec, Span<const PairView> pairs, std::vector<std::vector<Mode>>& modes,
                    const RegistrationSettings& options) {
  refine_sample(exec, pairs, modes, std::min(kRoughIterations, options.refine.max_iterations),
                options, options.refine.kernel_width, kRoughSettled);
}

void polish_modes(Exec& exec, Span<const PairView> pairs, std::vector<std::vector<Mode>>& modes,
                  const RegistrationSettings& options) {
  const float kernel_width = kPolishKernel * options.refine.kernel_width;
  refine_sample(exec, pairs, modes, options.refine.max_iterations, options, kernel_width,
                kPolishSettled);
  refine_each(exec, pairs, modes, std::min(kFinalIterations, options.refine.max_iterations),
              options, kernel_width, kPolishSettled, [&](std::size_t p) -> const ScoringOrder& {
                return executor_data(pairs[p].source).order;
              });
}

void merge_modes(Exec& exec, std::vector<std::vector<Mode>>& modes,
                 const RegistrationSettings& options, float share) {
  const ModeLimits within =
      mode_limits(options.evidence.mode_angle, options.evidence.mode_distance, share);
  exec.parallel(modes.size(), [&](std::size_t p) {
    std::vector<Mode> distinct;
    for (const Mode& mode : modes[p]) {
      const Rigid rigid = to_rigid(mode.pose);
      if (std::none_of(distinct.begin(), distinct.end(), [&](const Mode& other) {
            return same_mode(rigid, to_rigid(other.pose), within);
          }))
        distinct.push_back(mode);
    }
    modes[p] = std::move(distinct);
  });
}

void drop_returned(Exec& exec, std::vector<std::vector<Mode>>& perturbed,
                   const std::vector<PosesOfPair>& perturbations) {
  exec.parallel(perturbed.size(), [&](std::size_t p) {
    const ReturnTest& test = perturbations[p].returned;
    std::vector<Mode> kept;
    for (const Mode& mode : perturbed[p]) {
      const auto near = [&](const Pose<double>& other) {
        return squared_displacement(mode.pose, other, test) <= test.squared_distance;
      };
      if (!near(test.origin) &&
          std::none_of(kept.begin(), kept.end(), [&](const Mode& m) { return near(m.pose); }))
        kept.push_back(mode);
    }
    perturbed[p] = std::move(kept);
  });
}

std::vector<std::vector<Mode>> modes_from_poses(Exec&, const std::vector<PosesOfPair>& poses) {
  std::vector<std::vector<Mode>> out(poses.size());
  for (std::size_t p = 0; p < poses.size(); ++p)
    for (const Pose<double>& pose : poses[p].poses) out[p].push_back({pose, 0, 0});
  return out;
}

std::vector<Candidates> no_candidates(Exec&, Span<const PairView> pairs) {
  return std::vector<Candidates>(pairs.size);
}

}  // namespace gpureg::cpu
