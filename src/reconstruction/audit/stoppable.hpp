// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/stop_scope.hpp"
#include "gpureg/reconstruction/audit.hpp"

namespace gpureg::reconstruction {

/// The value of work, which AuditOptions::should_stop may end. Throws Cancelled.
template <typename Work>
auto stoppable(const AuditOptions& options, const Work& work) {
  if (!options.should_stop) return work();
  const StopScope scope(options.should_stop);
  try {
    return work();
  } catch (const Stopped&) {
    throw Cancelled("should_stop ended the call");
  }
}

}  // namespace gpureg::reconstruction
