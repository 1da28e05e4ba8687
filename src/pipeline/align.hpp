// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/types.hpp"

namespace gpureg::pipeline {

/// Pairs of prepared clouds to outcomes (LoopSmart, Algorithm 1), one statement per stage. Exec brings the stages, found by its
/// namespace; every stage takes all pairs at once.
template <typename Exec>
void align(Exec& exec, Span<const PairView> pairs, const RegistrationOptions& options, Span<PairOutcome> outcomes) {
  StageTimings ms;
  exec.start_clock();
  auto matches = match_features(exec, pairs, options.hypothesis);
  ms.match = exec.lap();
  auto quadruples = sample_quadruples(exec, matches, options.hypothesis);
  ms.sample = exec.lap();
  auto hypotheses = fit_hypotheses(exec, matches, quadruples, options.hypothesis);
  ms.fit = exec.lap();
  auto best = score_hypotheses(exec, pairs, hypotheses, options.score);
  ms.score = exec.lap();
  auto poses = refine_poses(exec, pairs, best, options.score, options.refine);
  ms.refine = exec.lap();
  auto judgements = judge_poses(exec, pairs, poses, options.score);
  ms.judge = exec.lap();

  conclude(exec, pairs, matches, quadruples, hypotheses, poses, judgements, options, outcomes);
  const double share = 1.0 / static_cast<double>(pairs.size);
  for (PairOutcome& outcome : outcomes) {
    outcome.timings.match = ms.match * share;
    outcome.timings.sample = ms.sample * share;
    outcome.timings.fit = ms.fit * share;
    outcome.timings.score = ms.score * share;
    outcome.timings.refine = ms.refine * share;
    outcome.timings.judge = ms.judge * share;
  }
}

}  // namespace gpureg::pipeline
