// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/statistics.hpp"

#include <algorithm>
#include <cmath>

namespace gpureg::evaluation {

ErrorStatistics statistics_of(std::vector<double> errors) {
  ErrorStatistics out;
  out.count = errors.size();
  if (errors.empty()) return out;
  std::sort(errors.begin(), errors.end());
  const auto count = static_cast<double>(errors.size());
  double sum = 0, squares = 0;
  for (const double error : errors) {
    sum += error;
    squares += error * error;
  }
  out.rmse = std::sqrt(squares / count);
  out.mean = sum / count;
  double deviations = 0;
  for (const double error : errors) deviations += (error - out.mean) * (error - out.mean);
  out.deviation = std::sqrt(deviations / count);
  const std::size_t half = errors.size() / 2;
  out.median = errors.size() % 2 ? errors[half] : 0.5 * (errors[half - 1] + errors[half]);
  out.min = errors.front();
  out.max = errors.back();
  return out;
}

}  // namespace gpureg::evaluation
