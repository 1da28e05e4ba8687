// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "cuda/common/stage_data.hpp"

namespace gpureg::test {

struct Found {
  std::uint32_t index;
  float squared_distance;
  Vec3 point;
  bool normal_is_packed;  ///< the packed normal is that of the point
};

/// find_point() for each location.
std::vector<Found> find_points(cuda::Exec& exec, const cuda::CudaCloud& cloud,
                               const std::vector<Vec3>& locations, float max_squared);

/// Number of bricks by the size of the positions in their lists, see position_size(), and of cells
/// with kLongList candidates or more.
struct ListCounts {
  std::size_t bricks[3] = {0, 0, 0};
  std::size_t long_lists = 0;
};
ListCounts count_lists(cuda::Exec& exec, const cuda::CudaCloud& cloud);

}  // namespace gpureg::test
