// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/conclude.hpp"

#include "cuda/common/stages.hpp"

namespace gpureg::cuda {

void conclude(Exec& exec, Span<const PairView> pairs, const Matches& matches,
              const Quadruples& quadruples, const Hypotheses& hypotheses,
              const DeviceBuffer<BestPose>& poses, const DeviceBuffer<Verification>& verifications,
              const RegistrationSettings& options, Span<PairOutcome> outcomes) {
  const std::uint32_t* match_count =
      exec.download(matches.count.data() + quadruples.first_pair, pairs.size);
  const std::uint32_t* hypothesis_count = exec.download(hypotheses.count.data(), pairs.size);
  const BestPose* best = exec.download(poses.data(), pairs.size);
  const Verification* verified = exec.download(verifications.data(), pairs.size);
  exec.synchronize();
  for (std::size_t p = 0; p < pairs.size; ++p) {
    const std::uint32_t found = match_count[p];
    pipeline::conclude_pair({pairs[p].source.size, pairs[p].target.size, found,
                             pipeline::quadruples_drawn(found, options),
                             quadruples.segments.size(p), hypothesis_count[p]},
                            {best[p].found != 0, best[p].pose, best[p].support, best[p].iterations},
                            {verified[p].support, verified[p].source, verified[p].target}, options,
                            outcomes[p]);
  }
}

}  // namespace gpureg::cuda
