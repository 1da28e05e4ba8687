// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "evaluation/verdict.hpp"
#include "gpureg/error.hpp"

namespace gpureg::evaluation {

RankedScores rank(std::vector<Verdict> verdicts, int ground_truth) {
  for (const Verdict& v : verdicts)
    if (std::isnan(v.score))
      throw InvalidArgument("report.confidence is nan, expected a number to rank by");
  RankedScores scores;
  if (ground_truth == 0) return scores;
  std::sort(verdicts.begin(), verdicts.end(),
            [](const Verdict& a, const Verdict& b) { return a.score > b.score; });

  long long reported = 0, good = 0, good_recall = 0;
  double last_recall = 0;
  for (std::size_t k = 0; k < verdicts.size();) {
    // A threshold cannot separate equal scores, so they enter together; the result does not depend
    // on the order of the reports.
    const double score = verdicts[k].score;
    for (; k < verdicts.size() && verdicts[k].score == score; ++k) {
      ++reported;
      good += verdicts[k].good;
      good_recall += verdicts[k].good_recall;
    }
    const double recall = static_cast<double>(good_recall) / ground_truth;
    const auto keep = [&](double& best, int percent) {  // in integers: 19 of 20 is exactly 95 %
      if (100 * good >= percent * reported) best = std::max(best, recall);
    };
    keep(scores.recall_at_50, 50);
    keep(scores.recall_at_80, 80);
    keep(scores.recall_at_95, 95);
    keep(scores.recall_at_99, 99);
    scores.average_precision +=
        (recall - last_recall) * (static_cast<double>(good) / static_cast<double>(reported));
    last_recall = recall;
  }
  scores.raw_recall = last_recall;
  return scores;
}

}  // namespace gpureg::evaluation
