// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/stages.hpp"

namespace gpureg::cuda {

/// Second half of build_closest_grids: the candidates of every cell of the blocks that `out`
/// already lists. geometry is on the device.
void fill_closest_lists(Exec& exec, const DownsampledClouds& clouds, const Grids& grids,
                        const ClosestGeometry* geometry, const PrepareSettings& options,
                        ClosestGrids& out);

}  // namespace gpureg::cuda
