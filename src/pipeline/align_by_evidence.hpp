// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/types.hpp"

namespace gpureg::pipeline {

/// Pairs of prepared clouds to distinct poses with their evidence, one statement per stage. Exec brings the stages, found by its
/// namespace; every stage takes all pairs at once. Only weigh_modes() waits for the results.
template <typename Exec>
void align_by_evidence(Exec& exec, Span<const PairView> pairs, const RegistrationOptions& options, Span<PairOutcome> outcomes) {
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
  const auto refined = exec.mark();
  weigh_modes(exec, pairs, matches, candidates, modes, options, outcomes);
  const auto judged = exec.mark();

  const double share = 1.0 / static_cast<double>(pairs.size);
  StageTimings ms;
  ms.match = exec.milliseconds(begin, matched) * share;
  ms.sample = exec.milliseconds(matched, seeded) * share;
  ms.fit = exec.milliseconds(seeded, proposed) * share;
  ms.score = exec.milliseconds(proposed, weighed) * share;
  ms.refine = exec.milliseconds(weighed, refined) * share;
  ms.judge = exec.milliseconds(refined, judged) * share;
  for (PairOutcome& outcome : outcomes) outcome.timings = ms;
}

}  // namespace gpureg::pipeline
