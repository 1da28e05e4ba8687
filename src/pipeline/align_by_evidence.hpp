// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/engine.hpp"

namespace gpureg::pipeline {

/// Pairs of prepared clouds to distinct poses with their evidence, one statement per stage. Exec
/// brings the stages, found by its namespace; every stage takes all pairs at once. Only
/// weigh_modes() waits for the results.
///
/// Refinement ends where a surface that has nothing on it lets it: anywhere along a wall. So the
/// likeliest mode is slid both ways along its softest direction, refined from there and weighed
/// again; the evidence says which of them it is, and how sure.
template <typename Exec>
void align_by_evidence(Exec& exec, Span<const PairInput> inputs, Span<const PairView> pairs,
                       const RegistrationOptions& options, const FurtherSearch& further,
                       Span<PairOutcome> outcomes) {
  const auto begin = exec.mark();
  auto matches = unite_matches(exec, pairs, options.hypothesis, options.compatibility);
  const auto matched = exec.mark();
  auto seeds = choose_seeds(exec, matches, options.compatibility);
  const auto seeded = exec.mark();
  auto candidates = propose_poses(exec, matches, seeds, options.hypothesis, options.compatibility);
  const auto proposed = exec.mark();
  weigh_candidates(exec, pairs, matches, candidates, options.evidence, options.score);
  auto modes = select_modes(exec, candidates, options.evidence);
  const auto weighed = exec.mark();
  refine_modes(exec, pairs, modes, options.evidence, options.refine);
  merge_modes(exec, modes, options.evidence);
  const auto refined = exec.mark();
  weigh_modes(exec, pairs, matches, candidates, modes, options, outcomes);
  const auto judged = exec.mark();
  for (PairOutcome& outcome : outcomes)
    for (std::size_t k = 0; k < outcome.modes.size(); ++k)
      outcome.modes[k].family = static_cast<std::uint32_t>(k);

  const std::vector<FurtherPoses> more = further(inputs, {outcomes.data, outcomes.size});
  const auto begun = exec.mark();
  auto slid = modes_of(exec, more);
  refine_modes(exec, pairs, slid, options.evidence, options.refine);
  const auto slid_refined = exec.mark();
  std::vector<PairOutcome> weighed_again(pairs.size);
  weigh_modes(exec, pairs, matches, candidates, slid, options,
              {weighed_again.data(), weighed_again.size()});
  const auto slid_judged = exec.mark();
  for (std::size_t p = 0; p < pairs.size; ++p)
    for (ModeOutcome& mode : weighed_again[p].modes) {
      mode.family = more[p].family;
      outcomes[p].modes.push_back(mode);
    }

  const double share = 1.0 / static_cast<double>(pairs.size);
  StageTimings ms;
  ms.match = exec.milliseconds(begin, matched) * share;
  ms.sample = exec.milliseconds(matched, seeded) * share;
  ms.fit = exec.milliseconds(seeded, proposed) * share;
  ms.score = exec.milliseconds(proposed, weighed) * share;
  ms.refine =
      (exec.milliseconds(weighed, refined) + exec.milliseconds(begun, slid_refined)) * share;
  ms.judge =
      (exec.milliseconds(refined, judged) + exec.milliseconds(slid_refined, slid_judged)) * share;
  for (PairOutcome& outcome : outcomes) outcome.timings = ms;
}

}  // namespace gpureg::pipeline
