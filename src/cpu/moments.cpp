// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/stages.hpp"

namespace gpureg::cpu {

std::vector<PairMoments> measure_moments(Exec& exec, Span<const PairView> pairs, const std::vector<BestPose>& poses,
                                         const ScoreOptions& options) {
  const float max_squared = options.max_correspondence_distance * options.max_correspondence_distance;
  std::vector<PairMoments> out(pairs.size, PairMoments{{0, {0}, {0}}, {0, {0}, {0}}});
  exec.parallel(pairs.size, [&](std::size_t p) {
    if (!poses[p].found) return;
    const CloudView &source = pairs[p].source, &target = pairs[p].target;
    const Rigid rigid = to_rigid(poses[p].pose);
    for (std::uint32_t i = 0; i < source.size; ++i) {
      const Closest c = find_closest(target.closest, target.points, apply(rigid, source.points[i]), max_squared);
      if (c.index == kNoValue) continue;
      add_moment(source.points[i] * (1.0f / source.radius), out[p].source);
      add_moment(target.points[c.index] * (1.0f / target.radius), out[p].target);
    }
  });
  return out;
}

}  // namespace gpureg::cpu
