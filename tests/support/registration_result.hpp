// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/registration.hpp"

namespace gpureg::test {

/// As align() would return it, with one mode.
inline RegistrationResult result_of(const UnalignedIsometry3d& target_from_source,
                                    double confidence) {
  RegistrationResult result;
  const bool reported = confidence >= 0.5;
  result.status = reported ? RegistrationStatus::aligned : RegistrationStatus::not_aligned;
  result.reason = reported ? RegistrationReason::none : RegistrationReason::confidence_too_low;
  result.target_from_source = target_from_source;
  result.confidence = confidence;
  RegistrationMode mode;
  mode.target_from_source = target_from_source;
  mode.confidence = confidence;
  result.modes = {mode};
  return result;
}

}  // namespace gpureg::test
