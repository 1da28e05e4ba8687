// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/stage_data.hpp"
#include "cuda/device/exec.hpp"
#include "math/rigid.hpp"

namespace gpureg::cuda {

/// A pose for each seed of a batch: that of the triangle of the seed and two compatible matches
/// with the largest consensus, refitted to its consensus set.
struct SeedPoses {
  DeviceBuffer<Pose<float>> pose;    ///< pairs x seeds
  DeviceBuffer<std::uint8_t> valid;  ///< pairs x seeds; 0: no pose
};

/// Kernels with a thread block per seed choose triangles and sum up consensus sets; kernels with a
/// thread per seed solve for the poses.
SeedPoses fit_seeds(Exec& exec, const MatchSets& matches, const Seeds& seeds,
                    const RegistrationSettings& options);

}  // namespace gpureg::cuda
