// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/types.hpp"

namespace gpureg::pipeline {

/// Pairs of prepared clouds to outcomes (LoopSmart, Algorithm 1), one statement per stage. Exec
/// brings the stages, found by its namespace; every stage takes all pairs at once. Only conclude()
/// waits for the results.
template <typename Exec>
void align(Exec& exec, Span<const PairView> pairs, const RegistrationOptions& options,
           Span<PairOutcome> outcomes) {
  const auto begin = exec.mark();
  auto matches = match_features(exec, pairs, options.hypothesis);
  const auto matched = exec.mark();
  auto quadruples = sample_quadruples(exec, matches, options.hypothesis);
  const auto sampled = exec.mark();
  auto hypotheses = fit_hypotheses(exec, matches, quadruples, options.hypothesis);
  const auto fitted = exec.mark();
  auto best = score_hypotheses(exec, pairs, hypotheses, options.score);
  const auto scored = exec.mark();
  auto poses = refine_poses(exec, pairs, best, options.score, options.refine);
  const auto refined = exec.mark();
  auto judgements = judge_poses(exec, pairs, poses, options.score);
  const auto judged = exec.mark();
  conclude(exec, pairs, matches, quadruples, hypotheses, poses, judgements, options, outcomes);

  const double share = 1.0 / static_cast<double>(pairs.size);
  StageTimings ms;
  ms.match = exec.milliseconds(begin, matched) * share;
  ms.sample = exec.milliseconds(matched, sampled) * share;
  ms.fit = exec.milliseconds(sampled, fitted) * share;
  ms.score = exec.milliseconds(fitted, scored) * share;
  ms.refine = exec.milliseconds(scored, refined) * share;
  ms.judge = exec.milliseconds(refined, judged) * share;
  for (PairOutcome& outcome : outcomes) outcome.timings = ms;
}

}  // namespace gpureg::pipeline
