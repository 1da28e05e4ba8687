// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "gpureg/time_budget.hpp"
#include "settings/settings.hpp"

namespace gpureg {

/// Runs one level and tells the time in milliseconds; tests replace both.
struct LevelRunner {
  std::function<RegistrationResult(std::uint32_t quality)> align;
  std::function<double()> now;
};

/// Loop of align_within(). options: thresholds of equal poses, and the numbers of candidates per
/// level.
TimedResult run_levels(const LevelRunner& runner, double milliseconds,
                       const RegistrationSettings& options);

/// Predicted milliseconds of a level from the stages of another one: matching grows with the
/// matches, proposals grow with seeds and triangles, refinement and verification with the modes.
/// overhead: milliseconds of the call outside its stages.
double predicted_milliseconds(const StageTimings& measured, double overhead,
                              const RegistrationSettings& measured_options,
                              const RegistrationSettings& options);

}  // namespace gpureg
