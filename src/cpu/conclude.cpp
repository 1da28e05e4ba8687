// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/stages.hpp"
#include "pipeline/conclude.hpp"

namespace gpureg::cpu {

void conclude(Exec&, Span<const PairView> pairs, const std::vector<Matches>& matches,
              const std::vector<std::vector<std::uint32_t>>& quadruples, const std::vector<Hypotheses>& hypotheses,
              const std::vector<BestPose>& poses, const std::vector<Judgement>& judgements, const RegistrationOptions& options,
              Span<PairOutcome> outcomes) {
  for (std::size_t p = 0; p < pairs.size; ++p) {
    PairOutcome& out = outcomes[p];
    RegistrationStatistics& s = out.statistics;
    s.source_points = pairs[p].source.size;
    s.target_points = pairs[p].target.size;
    s.correspondences = static_cast<std::uint32_t>(matches[p].pairs.size());
    s.hypotheses = s.correspondences >= 4 ? options.hypothesis.count : 0;
    s.survivors = quadruples[p].size();
    s.scored = hypotheses[p].id.size();
    s.points_scored = pairs[p].source.size;
    s.consensus = poses[p].support.inliers;
    s.inliers = judgements[p].support.inliers;
    s.refine_iterations = poses[p].iterations;
    out.has_pose = poses[p].found;
    out.pose = poses[p].pose;
    out.support = judgements[p].support;
    out.source_moments = judgements[p].source;
    out.target_moments = judgements[p].target;
    out.reason = pipeline::reason_of(s, out.has_pose, options.score);
  }
}

}  // namespace gpureg::cpu
