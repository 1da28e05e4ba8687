// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/types.hpp"

namespace gpureg::pipeline {

/// LoopSmart, Algorithm 1: pairs of prepared clouds to outcomes, one statement per stage.
/// Argument-dependent look-up by Exec finds the stages of a backend; every stage takes all pairs at
/// once. Only conclude() waits for the results.
template <typename Exec>
void align(Exec& exec, Span<const PairView> pairs, const RegistrationOptions& options,
           Span<PairOutcome> outcomes) {
  const auto begin = exec.mark();
  auto matches = match_features(exec, pairs, options);
  const auto matched = exec.mark();
  auto quadruples = sample_quadruples(exec, matches, options);
  auto hypotheses = fit_hypotheses(exec, matches, quadruples, options);
  const auto proposed = exec.mark();
  auto best = score_hypotheses(exec, pairs, hypotheses, options);
  const auto ranked = exec.mark();
  auto poses = refine_poses(exec, pairs, best, options);
  const auto refined = exec.mark();
  auto verifications = verify_poses(exec, pairs, poses, options);
  const auto verified = exec.mark();
  conclude(exec, pairs, matches, quadruples, hypotheses, poses, verifications, options, outcomes);

  const double share = 1.0 / static_cast<double>(pairs.size);
  StageTimings ms;
  ms.match = exec.milliseconds(begin, matched) * share;
  ms.propose = exec.milliseconds(matched, proposed) * share;
  ms.rank = exec.milliseconds(proposed, ranked) * share;
  ms.refine = exec.milliseconds(ranked, refined) * share;
  ms.verify = exec.milliseconds(refined, verified) * share;
  for (PairOutcome& outcome : outcomes) outcome.timings = ms;
}

}  // namespace gpureg::pipeline
