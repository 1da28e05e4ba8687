// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "algorithm/support.hpp"
#include "gpureg/options.hpp"
#include "pipeline/engine.hpp"

namespace gpureg::bench {

struct NaiveResult {
  Support best;
  std::uint32_t survivors;
};

/// Algorithm 1 as it reads, the baseline of the speed-up: one launch sequence per pair on the
/// default stream, a thread per source point that compares all features, a thread per hypothesis, a
/// thread block per hypothesis that looks every point up, no bounds and no early exit. Memory is
/// taken beforehand. Finds what the library finds.
class Naive {
 public:
  Naive(std::size_t most_points, const RegistrationOptions& options);
  ~Naive();
  NaiveResult align(const PreparedState& source, const PreparedState& target);

 private:
  struct Arrays;
  RegistrationOptions options_;
  std::unique_ptr<Arrays> arrays_;
  std::vector<Support> supports_;
};

}  // namespace gpureg::bench
