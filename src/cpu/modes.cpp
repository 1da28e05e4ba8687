// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "algorithm/inlier.hpp"
#include "cpu/stages.hpp"

namespace gpureg::cpu {
namespace {

/// Normal equations from every stride-th source point, weighed by its normal's direction.
IcpSums mode_sums(const PairView& pair, const Pose<double>& pose, const RefineOptions& options, float kernel_width, float min_cosine,
                  std::uint32_t stride) {
  const Rigid rigid = to_rigid(pose);
  const CloudView &s = pair.source, &t = pair.target;
  const float max_squared = options.max_correspondence_distance * options.max_correspondence_distance;
  const float inverse_max = 1.0f / options.max_correspondence_distance, inverse_radius = 1.0f / s.radius;
  IcpSums sums{{0}};
  for (std::uint32_t i = 0; i < s.size; i += stride) {
    const Vec3 arm = rotate(rigid, s.points[i]);
    const Vec3 q = apply(rigid, s.points[i]);
    const Closest c = find_closest(t.closest, t.points, q, max_squared);
    if (c.index == kNoValue || is_zero(t.normals[c.index])) continue;
    if (!normals_agree(rotate(rigid, s.normals[i]), t.normals[c.index], min_cosine)) continue;
    const float distance = dot(q - t.points[c.index], t.normals[c.index]);
    add_icp_term(arm * inverse_radius, t.normals[c.index], distance * inverse_max,
                 robust_weight(distance, kernel_width) * balance_share(s.balance[i]), sums);
  }
  return sums;
}

/// Iterates until it settles, at most max_iterations times.
void refine_mode(const PairView& pair, const RefineOptions& options, float kernel_width, float min_cosine, std::uint32_t stride, Mode& mode) {
  for (std::uint32_t k = 0; k < options.max_iterations; ++k) {
    const IcpStep step = solve_icp(mode_sums(pair, mode.pose, options, kernel_width, min_cosine, stride), pair.source.radius,
                                   options.max_correspondence_distance);
    ++mode.iterations;
    if (!step.valid) break;
    mode.pose = compose_small(step.omega, step.shift, mode.pose);
    if (icp_settled(step, pair.source.radius, options.max_correspondence_distance)) break;
  }
}

}  // namespace

std::vector<std::vector<Mode>> select_modes(Exec& exec, const std::vector<Candidates>& candidates, const EvidenceOptions& options) {
  const float min_trace = mode_trace(options.mode_angle), squared_distance = options.mode_distance * options.mode_distance;
  std::vector<std::vector<Mode>> out(candidates.size());
  exec.parallel(candidates.size(), [&](std::size_t p) {
    const Candidates& c = candidates[p];
    std::vector<std::uint32_t> order(c.pose.size());
    for (std::uint32_t k = 0; k < order.size(); ++k) order[k] = k;
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return c.promise[a] > c.promise[b]; });
    std::vector<Rigid> taken;
    for (const std::uint32_t k : order) {
      if (taken.size() == options.modes) break;
      const Rigid rigid = to_rigid(c.pose[k]);
      if (std::any_of(taken.begin(), taken.end(), [&](const Rigid& other) { return same_mode(rigid, other, min_trace, squared_distance); })) continue;
      taken.push_back(rigid);
      out[p].push_back({widen(c.pose[k]), c.seed[k], 0});
    }
  });
  return out;
}

void refine_modes(Exec& exec, Span<const PairView> pairs, std::vector<std::vector<Mode>>& modes, const EvidenceOptions& evidence,
                  const RefineOptions& options) {
  const float min_cosine = inlier_test(options.max_correspondence_distance, kRefineNormalAngle).min_cosine;
  exec.parallel_items(pairs.size, [&](std::size_t p) { return modes[p].size(); }, 1, [&](std::size_t p, std::size_t k, std::size_t) {
    const std::uint32_t stride = sample_stride(pairs[p].source.size, 2 * evidence.sample);
    refine_mode(pairs[p], options, options.kernel_width, min_cosine, stride, modes[p][k]);
    refine_mode(pairs[p], options, kPolishKernel * options.kernel_width, min_cosine, 1, modes[p][k]);
  });
  // Candidates of one basin meet: the most promising of them stays.
  const float min_trace = mode_trace(evidence.mode_angle), squared_distance = evidence.mode_distance * evidence.mode_distance;
  exec.parallel(pairs.size, [&](std::size_t p) {
    std::vector<Mode> distinct;
    for (const Mode& mode : modes[p]) {
      const Rigid rigid = to_rigid(mode.pose);
      if (std::none_of(distinct.begin(), distinct.end(),
                       [&](const Mode& other) { return same_mode(rigid, to_rigid(other.pose), min_trace, squared_distance); }))
        distinct.push_back(mode);
    }
    modes[p] = std::move(distinct);
  });
}

}  // namespace gpureg::cpu
