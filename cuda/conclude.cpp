// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/conclude.hpp"

#include "stages.hpp"

namespace gpureg::cuda {

void conclude(Exec& exec, Span<const PairView> pairs, const Matches& matches,
              const Quadruples& quadruples, const Hypotheses& hypotheses,
              const DeviceBuffer<BestPose>& poses, const DeviceBuffer<Judgement>& judgements,
              const RegistrationOptions& options, Span<PairOutcome> outcomes) {
  const std::uint32_t* match_count = exec.download(matches.count.data(), pairs.size);
  const std::uint32_t* hypothesis_count = exec.download(hypotheses.count.data(), pairs.size);
  const BestPose* best = exec.download(poses.data(), pairs.size);
  const Judgement* judged = exec.download(judgements.data(), pairs.size);
  exec.synchronize();
  for (std::size_t p = 0; p < pairs.size; ++p)
    pipeline::conclude_pair({pairs[p].source.size, pairs[p].target.size, match_count[p],
                             quadruples.segments.size(p), hypothesis_count[p]},
                            {best[p].found != 0, best[p].pose, best[p].support, best[p].iterations},
                            {judged[p].support, judged[p].source, judged[p].target}, options,
                            outcomes[p]);
}

}  // namespace gpureg::cuda
