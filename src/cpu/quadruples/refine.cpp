// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include "algorithm/icp.hpp"
#include "algorithm/inlier.hpp"

#include "cpu/common/stages.hpp"

namespace gpureg::cpu {
namespace {

/// Normal equations over all source points with a closest target point within distance and normal
/// angle.
IcpSums icp_sums(Exec& exec, const PairView& pair, const Pose<double>& pose,
                 const RegistrationSettings& options, float min_cosine) {
  constexpr std::size_t kGrain = 1024;
  const Rigid rigid = to_rigid(pose);
  const float max_squared =
      options.prepare.max_correspondence_distance * options.prepare.max_correspondence_distance;
  const float inverse_max = 1.0f / options.prepare.max_correspondence_distance;
  const float inverse_radius = 1.0f / pair.source.radius;
  const std::size_t blocks = (pair.source.size + kGrain - 1) / kGrain;
  std::vector<IcpSums> parts(blocks, IcpSums{{0}});
  exec.parallel(blocks, [&](std::size_t b) {
    const std::size_t end = std::min<std::size_t>((b + 1) * kGrain, pair.source.size);
    for (std::size_t i = b * kGrain; i < end; ++i) {
      const Vec3 q = apply(rigid, pair.source.points[i]);
      const Closest c = find_closest(pair.target.closest, pair.target.points, q, max_squared);
      if (c.index == kNoValue) continue;
      const Vec3 normal = pair.target.normals[c.index];
      if (is_zero(normal)) continue;
      if (!normals_agree(rotate(rigid, pair.source.normals[i]), normal, min_cosine)) continue;
      const float distance = dot(q - pair.target.points[c.index], normal);
      add_icp_term(rotate(rigid, pair.source.points[i]) * inverse_radius, normal,
                   distance * inverse_max, robust_weight(distance, options.refine.kernel_width),
                   parts[b]);
    }
  });
  IcpSums total{{0}};
  for (const IcpSums& part : parts)
    for (int k = 0; k < 27; ++k) total.v[k] += part.v[k];
  return total;
}

}  // namespace

std::vector<BestPose> refine_poses(Exec& exec, Span<const PairView> pairs,
                                   const std::vector<BestPose>& best,
                                   const RegistrationSettings& options) {
  std::vector<BestPose> out = best;
  if (options.refine.max_iterations == 0) return out;
  const float min_cosine =
      inlier_test(options.prepare.max_correspondence_distance, options.quadruples.max_normal_angle)
          .min_cosine;
  // Parallel over points: parallel pairs would leave threads idle at the end of a small batch.
  for (std::size_t p = 0; p < pairs.size; ++p) {
    if (!best[p].found) continue;
    Pose<double> pose = best[p].pose;
    std::uint32_t iteration = 0;
    while (iteration < options.refine.max_iterations) {
      const IcpStep step =
          solve_icp(icp_sums(exec, pairs[p], pose, options, min_cosine), pairs[p].source.radius,
                    options.prepare.max_correspondence_distance);
      ++iteration;
      if (!step.valid) break;
      pose = compose_small(step.omega, step.shift, pose);
      if (icp_settled(step, pairs[p].source.radius, options.prepare.max_correspondence_distance,
                      kSettled))
        break;
    }
    Support support = measure_support(pairs[p].source, pairs[p].target, to_rigid(pose), options);
    support.hypothesis = best[p].support.hypothesis;
    out[p].iterations = iteration;
    // A refinement that fits worse than its start is dropped.
    if (truncated_cost(support, pairs[p].source.size) <=
        truncated_cost(best[p].support, pairs[p].source.size)) {
      out[p].pose = pose;
      out[p].support = support;
    }
  }
  return out;
}

}  // namespace gpureg::cpu
