// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "records/audit_document.hpp"

namespace gpureg::cli {

/// One self-contained page: the map from above with what agrees in green and what contradicts in
/// red, then the worst contradictions with both scans, and in red the points of one where the other
/// saw nothing.
std::string audit_page(const AuditRun& run);

}  // namespace gpureg::cli
