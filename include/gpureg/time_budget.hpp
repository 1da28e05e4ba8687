// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "gpureg/registration.hpp"

/// Alignment that is given a time instead of a quality.
namespace gpureg {

/// What was found within a time budget.
struct TimedResult {
  RegistrationResult result;  ///< of all levels that were run, the one with the highest confidence
  std::uint32_t quality =
      0;  ///< the level that it is of: result equals align() with options.with_quality(quality)
  std::uint32_t highest_quality = 0;  ///< the highest level that was run
  std::uint32_t levels =
      0;  ///< how many were run, from quality 0 upwards; some may have been left out
  double milliseconds = 0;  ///< wall time of the whole call
};

/// align() with as much quality as `milliseconds` of wall time allow. Runs levels of quality
/// upwards, from 0; predicts the time of the next ones from the stages of those that were run,
/// starts none that would end after the budget, and leaves out those in between where time allows
/// more. Ends early where two levels in a row agree on a pose of confidence 0.99 or more. Quality 0
/// is always run: a budget below what it needs is overrun. The time counts from the call, and does
/// not include preparation.
///
/// The one thing in gpureg that is not deterministic: which levels are run depends on the clock.
/// What each level gives does not. options: as for align(); what with_quality() sets is set per
/// level. Throws InvalidArgument as align() does, for milliseconds that are not finite and > 0, and
/// for RegistrationMethod::quadruples, which has no levels. Thread-safe, but calls of other threads
/// on the same context take turns with it and their time counts.
TimedResult align_within(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, double milliseconds,
                         const RegistrationOptions& options = {});

}  // namespace gpureg
