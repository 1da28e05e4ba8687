// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/prepared_state.hpp"

namespace gpureg::pipeline {

/// Given poses of pairs to their evidence, one statement per stage: the end of
/// align_by_compatibility().
template <typename Exec>
void verify(Exec& exec, Span<const PairView> pairs, const std::vector<PosesOfPair>& poses,
            const RegistrationSettings& options, bool refine, Span<PairOutcome> outcomes) {
  auto matches = merge_matches(exec, pairs, options);
  auto modes = modes_from_poses(exec, poses);
  if (refine) {
    refine_roughly(exec, pairs, modes, options);
    polish_modes(exec, pairs, modes, options);
  }
  auto candidates = no_candidates(exec, pairs);
  verify_modes(exec, pairs, matches, candidates, modes, options, outcomes);
}

}  // namespace gpureg::pipeline
