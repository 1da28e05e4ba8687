// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "portability/report.hpp"

namespace gpureg::test {

/// The set of pairs that golden.cpp aligned.
struct AlignedSet {
  const std::vector<PointCloud>& scans;
  const std::vector<PreparedCloud>& clouds;
  const std::vector<Pair>& pairs;
  const std::vector<RegistrationResult>& results;
  const RegistrationOptions& options;
};

/// Audited maps, places and changes in a map, and thresholds that keep a risk.
void add_audits(const Context& context, const AlignedSet& set, Report& report);
void add_places(const Context& context, const AlignedSet& set, Report& report);
void add_risk(const AlignedSet& set, Report& report);

}  // namespace gpureg::test
