// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/stage_data.hpp"
#include "cuda/device/exec.hpp"

namespace gpureg::cuda {

/// Compatible matches of the seeds of a batch, one bit each.
struct Neighborhoods {
  std::uint32_t words = 0;           ///< per seed
  DeviceBuffer<std::uint32_t> bits;  ///< pairs x seeds x words
};

Neighborhoods find_neighborhoods(Exec& exec, const MatchSets& matches, const Seeds& seeds,
                                 const CompatibilitySettings& options);

}  // namespace gpureg::cuda
