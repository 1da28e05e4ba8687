// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string>
#include <vector>

#include "gpureg/calibration.hpp"

/// What the promises of a risk have in common: the thresholds that are tested, and in which order.
namespace gpureg::calibration {

/// Thresholds that are tested, chosen before any data.
inline constexpr double kLadder[] = {0.05, 0.1,  0.2,  0.3,  0.4,  0.5,   0.6,   0.7,   0.8,
                                     0.9,  0.95, 0.97, 0.98, 0.99, 0.995, 0.998, 0.999, 0.9999};
/// Where sequences of tests start: the strictest threshold alone would seldom have enough reports.
/// Each has its part of max_failure.
inline constexpr std::size_t kStarts[] = {5, 9, 13, 16};  // 0.5, 0.9, 0.99, 0.999
/// Beyond so many reports, or scans, no advice is given.
inline constexpr double kMostReports = 1e6;

struct Counts {
  std::size_t reported = 0, wrong = 0, correct = 0;
};

Counts count_from(const std::vector<CalibrationSample>& samples, double threshold);

/// @throws InvalidArgument naming a confidence out of range.
void check_confidences(const std::vector<CalibrationSample>& samples, const std::string& name);

/// Logarithm of the level of a test.
double log_level(const RiskControl& control);

/// The lowest threshold that a sequence of tests reaches. test: whether a threshold is proved.
/// @return its number in the ladder; std::size(kLadder): none.
template <typename Test>
std::size_t lowest_proved(const Test& test) {
  std::size_t lowest = std::size(kLadder);
  for (const std::size_t start : kStarts)
    for (std::size_t k = start + 1; k-- > 0 && test(kLadder[k]);) lowest = std::min(lowest, k);
  return lowest;
}

/// The promise of threshold k of the ladder.
void promise(std::size_t k, const std::vector<CalibrationSample>& samples,
             const ConfidenceCalibration& calibration, RiskThreshold& out);

/// The smallest factor >= 1 that passes, to within `step`, by doubling and halving; `most`: none
/// below it does.
template <typename Passes>
double smallest_factor(const Passes& passes, double step, double most) {
  double few = 1, enough = 1;
  while (enough < most && !passes(enough)) {
    few = enough;
    enough *= 2;
  }
  if (enough >= most) return most;
  while (enough - few > step) {
    const double middle = 0.5 * (few + enough);
    (passes(middle) ? enough : few) = middle;
  }
  return enough;
}

}  // namespace gpureg::calibration
