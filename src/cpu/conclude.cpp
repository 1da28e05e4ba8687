// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/conclude.hpp"

#include "cpu/stages.hpp"

namespace gpureg::cpu {

void conclude(Exec&, Span<const PairView> pairs, const std::vector<Matches>& matches,
              const std::vector<std::vector<std::uint32_t>>& quadruples,
              const std::vector<Hypotheses>& hypotheses, const std::vector<BestPose>& poses,
              const std::vector<Judgement>& judgements, const RegistrationOptions& options,
              Span<PairOutcome> outcomes) {
  for (std::size_t p = 0; p < pairs.size; ++p)
    pipeline::conclude_pair({pairs[p].source.size, pairs[p].target.size,
                             static_cast<std::uint32_t>(matches[p].pairs.size()),
                             quadruples[p].size(), hypotheses[p].id.size()},
                            {poses[p].found, poses[p].pose, poses[p].support, poses[p].iterations},
                            {judgements[p].support, judgements[p].source, judgements[p].target},
                            options, outcomes[p]);
}

}  // namespace gpureg::cpu
