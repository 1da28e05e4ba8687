// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/common/stages.hpp"
#include "cpu/quadruples/inlier.hpp"

namespace gpureg::cpu {

std::vector<Verification> verify_poses(Exec& exec, Span<const PairView> pairs,
                                       const std::vector<BestPose>& poses,
                                       const RegistrationSettings& options) {
  const InlierTest test = inlier_test(options.prepare.max_correspondence_distance,
                                      options.quadruples.max_verification_normal_angle);
  std::vector<Verification> out(pairs.size);
  exec.parallel(pairs.size, [&](std::size_t p) {
    if (!poses[p].found) return;
    const CloudView &source = pairs[p].source, &target = pairs[p].target;
    const Rigid rigid = to_rigid(poses[p].pose);
    for (std::uint32_t i = 0; i < source.size; ++i) {
      const Closest c = find_closest(target.closest, target.points, apply(rigid, source.points[i]),
                                     test.max_squared);
      if (c.index == kNoValue) continue;
      add_moment(source.points[i] * (1.0f / source.radius), out[p].source);
      add_moment(target.points[c.index] * (1.0f / target.radius), out[p].target);
      count_inlier(source, target, rigid, test, i, c, out[p].support);
    }
    out[p].support.hypothesis = poses[p].support.hypothesis;
  });
  return out;
}

}  // namespace gpureg::cpu
