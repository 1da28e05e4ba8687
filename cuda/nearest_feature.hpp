// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "exec.hpp"

namespace gpureg::cuda {

/// One cloud's features asked for in another's; all pointers on the device.
struct FeatureQuery {
  const float* queries;
  const std::uint8_t* query_valid;
  std::uint32_t query_count;
  const float* rows;
  const std::uint8_t* row_valid;
  std::uint32_t row_count;
  std::uint32_t dimension;
  std::uint32_t out;  ///< where its answers begin
};

/// Nearest rows of every query: k indices per query in order of distance (squared norm of the difference as a chain of fmaf over the
/// dimensions, then the lower index), kNoValue where fewer exist. Exactly what cpu::nearest_features finds.
DeviceBuffer<std::uint32_t> nearest_features(Exec& exec, const std::vector<FeatureQuery>& queries, std::uint32_t k, std::size_t answers);

}  // namespace gpureg::cuda
