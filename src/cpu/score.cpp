// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>

#include "cpu/stages.hpp"

namespace gpureg::cpu {
namespace {

struct Threshold {
  float max_squared, inverse_max_squared, min_cosine;
  explicit Threshold(const ScoreOptions& options)
      : max_squared(options.max_correspondence_distance * options.max_correspondence_distance),
        inverse_max_squared(1.0f / max_squared),
        min_cosine(options.max_normal_angle >= 180.0f ? -1.0f
                                                       : static_cast<float>(std::cos(static_cast<double>(options.max_normal_angle) *
                                                                                      3.14159265358979323846 / 180.0))) {}
};

/// Support of one pose, given up (inliers 0) as soon as even all points that are left cannot reach `needed` inliers: such a hypothesis
/// is not the best one, so giving it up changes no result.
Support support_of(const CloudView& source, const CloudView& target, const Rigid& pose, const Threshold& t, std::uint32_t needed) {
  Support s{0, 0, 0};
  for (std::uint32_t i = 0; i < source.size; ++i) {
    if (s.inliers + (source.size - i) < needed) return {0, 0, 0};
    const Closest c = find_closest(target.closest, target.points, apply(pose, source.points[i]), t.max_squared);
    if (c.index == kNoValue) continue;
    if (!normals_agree(t.min_cosine <= -1.0f ? Vec3{0, 0, 0} : rotate(pose, source.normals[i]), target.normals[c.index], t.min_cosine))
      continue;
    ++s.inliers;
    s.residual += fixed_residual(c.squared_distance, t.inverse_max_squared);
  }
  return s;
}

}  // namespace

Support measure_support(const CloudView& source, const CloudView& target, const Rigid& pose, const ScoreOptions& options) {
  return support_of(source, target, pose, Threshold(options), 0);
}

std::vector<BestPose> score_hypotheses(Exec& exec, Span<const PairView> pairs, const std::vector<Hypotheses>& hypotheses,
                                       const ScoreOptions& options) {
  constexpr std::size_t kGrain = 32;
  const Threshold threshold(options);
  std::vector<std::vector<Support>> best_of_block(pairs.size);
  std::vector<std::vector<std::size_t>> index_of_block(pairs.size);
  std::vector<std::atomic<std::uint32_t>> most(pairs.size);
  for (std::size_t p = 0; p < pairs.size; ++p) {
    const std::size_t blocks = (hypotheses[p].id.size() + kGrain - 1) / kGrain;
    best_of_block[p].assign(blocks, Support{0, ~0u, 0});
    index_of_block[p].assign(blocks, 0);
    most[p] = 0;
  }
  exec.parallel_items(pairs.size, [&](std::size_t p) { return hypotheses[p].id.size(); }, kGrain,
                      [&](std::size_t p, std::size_t begin, std::size_t end) {
                        Support& best = best_of_block[p][begin / kGrain];
                        for (std::size_t k = begin; k < end; ++k) {
                          const std::uint32_t needed = most[p].load(std::memory_order_relaxed);
                          Support s = support_of(pairs[p].source, pairs[p].target, to_rigid(hypotheses[p].pose[k]), threshold, needed);
                          s.hypothesis = hypotheses[p].id[k];
                          if (!better(s, best)) continue;
                          best = s;
                          index_of_block[p][begin / kGrain] = k;
                          std::uint32_t seen = most[p].load(std::memory_order_relaxed);
                          while (s.inliers > seen && !most[p].compare_exchange_weak(seen, s.inliers, std::memory_order_relaxed)) {
                          }
                        }
                      });
  std::vector<BestPose> out(pairs.size);
  for (std::size_t p = 0; p < pairs.size; ++p)
    for (std::size_t b = 0; b < best_of_block[p].size(); ++b) {
      if (out[p].found && !better(best_of_block[p][b], out[p].support)) continue;
      out[p].found = true;
      out[p].support = best_of_block[p][b];
      out[p].pose = widen(hypotheses[p].pose[index_of_block[p][b]]);
    }
  return out;
}

}  // namespace gpureg::cpu
