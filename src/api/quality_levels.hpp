// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "gpureg/time_budget.hpp"

namespace gpureg {

/// What runs one level, and what time it is in milliseconds: tests bring their own.
struct LevelRunner {
  std::function<RegistrationResult(std::uint32_t quality)> align;
  std::function<double()> now;
};

/// The loop of align_within(). options: what tells poses apart, and the efforts of the levels.
TimedResult run_levels(const LevelRunner& runner, double milliseconds,
                       const RegistrationOptions& options);

/// Milliseconds that a level would take by those of another one's stages: matching stays the same,
/// proposals grow with seeds and triangles, refinement and verification with the modes. overhead:
/// milliseconds of the call outside its stages.
double predicted_milliseconds(const StageTimings& measured, double overhead,
                              const RegistrationOptions& measured_options,
                              const RegistrationOptions& options);

}  // namespace gpureg
