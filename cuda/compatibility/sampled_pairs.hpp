// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/closest_cells.cuh"

namespace gpureg::cuda {

/// A pair with the points of its clouds that are moved: a sample, or all of them.
struct SampledPair {
  SearchPair pair;
  /// The clouds with points, normals and normal weights of the sample.
  CloudView source, target;
};

struct SampledPairs {
  DeviceBuffer<Vec3> rows;  ///< points and normals
  DeviceBuffer<std::uint32_t> weight;
  DeviceBuffer<SampledPair> pairs;
};

/// All points of the source clouds.
SampledPairs whole_pairs(Exec& exec, Span<const PairView> pairs);

/// About `most` points of the source clouds, and of the target clouds if `both`, copied one after
/// the other: a warp reads them at once, while every tenth point of a cloud is a sector of memory.
SampledPairs sample_pairs(Exec& exec, Span<const PairView> pairs, std::uint32_t most, bool both);

}  // namespace gpureg::cuda
