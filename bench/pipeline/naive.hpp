// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "algorithm/support.hpp"
#include "hash_grid.hpp"
#include "pipeline/engine.hpp"
#include "settings/resolve.hpp"

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
  Naive(std::size_t most_points, const RegistrationSettings& options);
  ~Naive();
  NaiveResult align(const PreparedState& source, const PreparedState& target);
  /// Grid of a cloud, part of its preparation: the first call makes it, which takes long.
  const ClosestGridView& grid_of(const PreparedState& cloud);

 private:
  struct Arrays;
  RegistrationSettings options_;
  std::unique_ptr<Arrays> arrays_;
  std::vector<Support> supports_;
  std::unordered_map<const PreparedState*, std::unique_ptr<HashGrid>> grids_;
};

}  // namespace gpureg::bench
