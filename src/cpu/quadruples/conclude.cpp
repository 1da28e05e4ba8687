// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/conclude.hpp"

#include "cpu/common/stages.hpp"

namespace gpureg::cpu {

void conclude(Exec&, Span<const PairView> pairs, const std::vector<Matches>& matches,
              const std::vector<std::vector<std::uint32_t>>& quadruples,
              const std::vector<Hypotheses>& hypotheses, const std::vector<BestPose>& poses,
              const std::vector<Verification>& verifications, const RegistrationSettings& options,
              Span<PairOutcome> outcomes) {
  for (std::size_t p = 0; p < pairs.size; ++p) {
    const std::uint32_t found = static_cast<std::uint32_t>(matches[p].pairs.size());
    pipeline::conclude_pair(
        {pairs[p].source.size, pairs[p].target.size, found,
         pipeline::quadruples_drawn(found, options), quadruples[p].size(), hypotheses[p].id.size()},
        {poses[p].found, poses[p].pose, poses[p].support, poses[p].iterations},
        {verifications[p].support, verifications[p].source, verifications[p].target}, options,
        outcomes[p]);
  }
}

}  // namespace gpureg::cpu
