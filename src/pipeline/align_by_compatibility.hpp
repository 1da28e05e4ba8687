// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/prepared_state.hpp"

namespace gpureg::pipeline {

/// The default method: pairs of prepared clouds to distinct poses with their evidence, one
/// statement per stage. Argument-dependent look-up by Exec finds the stages of a backend; every
/// stage takes all pairs at once.
///
/// Refinement may stop anywhere along a surface without detail, a bare wall for example. The most
/// likely mode is therefore perturbed both ways along its weakest direction, refined and verified
/// again (degeneracy search). The evidence ranks the resulting poses and determines their
/// confidence.
template <typename Exec>
void align_by_compatibility(Exec& exec, Span<const PairInput> inputs, Span<const PairView> pairs,
                            const RegistrationSettings& options, Span<PairOutcome> outcomes) {
  const auto begin = exec.mark();
  auto matches = merge_matches(exec, pairs, options);
  const auto matched = exec.mark();
  auto seeds = choose_seeds(exec, matches, options);
  auto candidates = propose_poses(exec, matches, seeds, options);
  const auto proposed = exec.mark();
  score_candidates(exec, pairs, matches, candidates, options);
  auto modes = select_modes(exec, candidates, first_selection(options.evidence));
  const auto ranked = exec.mark();
  refine_roughly(exec, pairs, modes, options);
  auto refined_once = candidates_from_modes(exec, matches, modes, options);
  score_candidates(exec, pairs, matches, refined_once, options);
  modes = select_modes(exec, refined_once, second_selection(options.evidence));
  polish_modes(exec, pairs, modes, options);
  merge_modes(exec, modes, options, 1.0f);
  const auto refined = exec.mark();
  verify_modes(exec, pairs, matches, candidates, modes, options, outcomes);
  for (PairOutcome& outcome : outcomes)
    for (std::size_t k = 0; k < outcome.modes.size(); ++k)
      outcome.modes[k].origin_mode = static_cast<std::uint32_t>(k);
  const auto perturbations =
      search_degeneracies(exec, inputs, {outcomes.data, outcomes.size}, options);
  const auto verified = exec.mark();
  auto perturbed = modes_from_poses(exec, perturbations);
  refine_roughly(exec, pairs, perturbed, options);
  drop_returned(exec, perturbed, perturbations);
  polish_modes(exec, pairs, perturbed, options);
  const auto perturbed_refined = exec.mark();
  std::vector<PairOutcome> more(pairs.size);
  verify_modes(exec, pairs, matches, candidates, perturbed, options, {more.data(), more.size()});
  const auto perturbed_verified = exec.mark();
  for (std::size_t p = 0; p < pairs.size; ++p)
    for (ModeOutcome& mode : more[p].modes) {
      mode.origin_mode = perturbations[p].origin_mode;
      outcomes[p].modes.push_back(mode);
    }

  const double share = 1.0 / static_cast<double>(pairs.size);
  StageTimings ms;
  ms.match = exec.milliseconds(begin, matched) * share;
  ms.propose = exec.milliseconds(matched, proposed) * share;
  ms.rank = exec.milliseconds(proposed, ranked) * share;
  ms.refine =
      (exec.milliseconds(ranked, refined) + exec.milliseconds(verified, perturbed_refined)) * share;
  ms.verify = (exec.milliseconds(refined, verified) +
               exec.milliseconds(perturbed_refined, perturbed_verified)) *
              share;
  for (PairOutcome& outcome : outcomes) outcome.timings = ms;
}

}  // namespace gpureg::pipeline
