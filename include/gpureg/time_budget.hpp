// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "gpureg/registration.hpp"

/// Alignment within a time budget.
namespace gpureg {

/// Result of align_within().
struct TimedResult {
  RegistrationResult result;  ///< the result with the highest confidence of all levels run
  /// Quality level of the result: it equals align() with this options.quality.
  std::uint32_t quality = 0;
  std::uint32_t highest_quality = 0;  ///< the highest level run
  std::uint32_t levels = 0;           ///< number of levels run; some in between may be left out
  double milliseconds = 0;            ///< wall time of the whole call
};

/// align() at the highest quality that a budget of wall time allows. Runs levels of quality upwards
/// from 0. It predicts the time of the next levels from the stages of the levels run so far, starts
/// no level that would end after the budget, and leaves levels out if time allows a higher one.
/// It ends early if two levels in a row give the same pose with a confidence of 0.99 or more.
/// Level 0 always runs, even beyond the budget.
///
/// Not deterministic: the clock decides which levels run. The result of
/// each level is deterministic. Thread-safe; calls of other threads on the same context delay it.
/// @param milliseconds wall time from the call, without preparation, finite and > 0.
/// @param options as for align(); quality is set per level.
/// @throws InvalidArgument as align(), for milliseconds out of range, and for
///   RegistrationMethod::quadruples, which has no levels.
TimedResult align_within(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, double milliseconds,
                         const RegistrationOptions& options = {});

}  // namespace gpureg
