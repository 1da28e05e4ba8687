// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "cpu/stages.hpp"

namespace gpureg::cpu {
namespace {

float smaller_share(const MatchEvidence& m, const MatchSet& set) {
  const float s = static_cast<float>(m.source_weight) / static_cast<float>(set.source_total);
  const float t = static_cast<float>(m.target_weight) / static_cast<float>(set.target_total);
  return s < t ? s : t;
}

/// Weight of the points that a sample with this stride looks at.
std::uint64_t sampled_weight(const CloudView& cloud, std::uint32_t stride) {
  std::uint64_t total = 0;
  for (std::uint32_t i = 0; i < cloud.size; i += stride) total += cloud.balance[i];
  return total;
}

EvidenceTest test_of(const EvidenceOptions& options, const ScoreOptions& score) {
  return {inlier_test(score.max_correspondence_distance, options.max_normal_angle), options.free_space_margin, options.min_range};
}

}  // namespace

void weigh_candidates(Exec& exec, Span<const PairView> pairs, const std::vector<MatchSet>& matches, std::vector<Candidates>& candidates,
                      const EvidenceOptions& options, const ScoreOptions& score) {
  const EvidenceTest test = test_of(options, score);
  std::vector<std::uint64_t> source_weight(pairs.size), target_weight(pairs.size);
  exec.parallel(pairs.size, [&](std::size_t p) {
    source_weight[p] = sampled_weight(pairs[p].source, sample_stride(pairs[p].source.size, options.sample));
    target_weight[p] = sampled_weight(pairs[p].target, sample_stride(pairs[p].target.size, options.sample));
    candidates[p].promise.resize(candidates[p].pose.size());
  });
  exec.parallel_items(pairs.size, [&](std::size_t p) { return candidates[p].pose.size(); }, 8,
                      [&](std::size_t p, std::size_t begin, std::size_t end) {
                        const CloudView &s = pairs[p].source, &t = pairs[p].target;
                        const std::uint32_t step_s = sample_stride(s.size, options.sample), step_t = sample_stride(t.size, options.sample);
                        for (std::size_t k = begin; k < end; ++k) {
                          const Rigid there = to_rigid(candidates[p].pose[k]), back = inverse(there);
                          SideEvidence a{}, b{};
                          for (std::uint32_t i = 0; i < s.size; i += step_s) weigh_point(s, t, there, test, quick_maps(t.visibility), i, a);
                          for (std::uint32_t i = 0; i < t.size; i += step_t) weigh_point(t, s, back, test, quick_maps(s.visibility), i, b);
                          candidates[p].promise[k] = promise(smaller_share(candidates[p].matches[k], matches[p]), a,
                                                             static_cast<float>(source_weight[p]), b, static_cast<float>(target_weight[p]));
                        }
                      });
}

void weigh_modes(Exec& exec, Span<const PairView> pairs, const std::vector<MatchSet>& matches, const std::vector<Candidates>& candidates,
                 const std::vector<std::vector<Mode>>& modes, const RegistrationOptions& options, Span<PairOutcome> outcomes) {
  const EvidenceTest test = test_of(options.evidence, options.score);
  const float squared_distance = options.compatibility.consensus_distance * options.compatibility.consensus_distance;
  for (std::size_t p = 0; p < pairs.size; ++p) outcomes[p].modes.assign(modes[p].size(), {});
  exec.parallel_items(pairs.size, [&](std::size_t p) { return modes[p].size(); }, 1, [&](std::size_t p, std::size_t k, std::size_t) {
    const CloudView &s = pairs[p].source, &t = pairs[p].target;
    const Mode& mode = modes[p][k];
    ModeOutcome& out = outcomes[p].modes[k];
    const Rigid there = to_rigid(mode.pose), back = inverse(there);
    out.pose = mode.pose, out.hypothesis = mode.seed, out.iterations = mode.iterations;
    out.matches = count_matches(matches[p], there, squared_distance);
    for (std::uint32_t i = 0; i < s.size; ++i) {
      const Weighed w = weigh_point(s, t, there, test, t.visibility.count, i, out.source);
      if (w.inlier) add_information(s, there, i, out.information);
      if (w.closest == kNoValue) continue;
      add_moment(s.points[i] * (1.0f / s.radius), out.source_moments);
      add_moment(t.points[w.closest] * (1.0f / t.radius), out.target_moments);
    }
    for (std::uint32_t i = 0; i < t.size; ++i) weigh_point(t, s, back, test, s.visibility.count, i, out.target);
  });
  for (std::size_t p = 0; p < pairs.size; ++p) {
    PairOutcome& out = outcomes[p];
    out.match_weight_source = matches[p].source_total, out.match_weight_target = matches[p].target_total;
    out.statistics.source_points = pairs[p].source.size, out.statistics.target_points = pairs[p].target.size;
    out.statistics.correspondences = matches[p].size();
    out.statistics.hypotheses = std::min(options.compatibility.seeds, matches[p].size());
    out.statistics.survivors = candidates[p].pose.size();
    out.statistics.scored = candidates[p].pose.size();
  }
}

}  // namespace gpureg::cpu
