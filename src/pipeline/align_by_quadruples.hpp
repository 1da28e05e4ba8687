// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/runs.hpp"
#include "pipeline/types.hpp"

namespace gpureg::pipeline {

/// LoopSmart, Algorithm 1: pairs of prepared clouds to outcomes, one statement per stage.
/// Argument-dependent look-up by Exec finds the stages of a backend; every stage takes all pairs at
/// once. The number of quadruples that survive the sampling, and with it the memory of the later
/// stages, is known only after it: those stages take runs of as many pairs as the memory allows.
/// Only conclude() waits for the results.
template <typename Exec>
void align_by_quadruples(Exec& exec, Span<const PairView> all_pairs,
                         const RegistrationSettings& options, Span<PairOutcome> outcomes) {
  const auto begin = exec.mark();
  auto matches = match_features(exec, all_pairs, options);
  const auto matched = exec.mark();
  auto samples = sample_quadruples(exec, matches, options);
  auto last = exec.mark();
  StageTimings ms;
  ms.match = exec.milliseconds(begin, matched);
  ms.propose = exec.milliseconds(matched, last);
  for (const Run run : runs_of(exec, samples)) {
    const Span<const PairView> pairs{all_pairs.data + run.begin, run.size()};
    const auto& quadruples = survivors_of(exec, samples, run);
    auto hypotheses = fit_hypotheses(exec, matches, quadruples, options);
    const auto proposed = exec.mark();
    auto best = score_hypotheses(exec, pairs, hypotheses, options);
    const auto ranked = exec.mark();
    auto poses = refine_poses(exec, pairs, best, options);
    const auto refined = exec.mark();
    auto verifications = verify_poses(exec, pairs, poses, options);
    const auto verified = exec.mark();
    conclude(exec, pairs, matches, quadruples, hypotheses, poses, verifications, options,
             {outcomes.data + run.begin, run.size()});
    ms.propose += exec.milliseconds(last, proposed);
    ms.rank += exec.milliseconds(proposed, ranked);
    ms.refine += exec.milliseconds(ranked, refined);
    ms.verify += exec.milliseconds(refined, verified);
    last = exec.mark();
  }

  const double share = 1.0 / static_cast<double>(all_pairs.size);
  for (double* stage : {&ms.match, &ms.propose, &ms.rank, &ms.refine, &ms.verify}) *stage *= share;
  for (PairOutcome& outcome : outcomes) outcome.timings = ms;
}

}  // namespace gpureg::pipeline
