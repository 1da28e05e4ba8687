// SPDX-License-Identifier: BSD-3-Clause
// Sizes of batches up to the limit of CUB. No device needed.
#include "cuda/device/segments.hpp"

#include <gtest/gtest.h>

#include "cuda/device/device_algorithms.hpp"

namespace gpureg::cuda {
namespace {

TEST(Segments, OneElementMoreStillFitsAnInt) {
  const std::uint64_t sizes[2] = {std::uint64_t(1) << 30, (std::uint64_t(1) << 30) - 2};
  const auto offset = batch_offsets(2, [&](std::size_t e) { return sizes[e]; });
  ASSERT_EQ(offset.size(), 3u);
  EXPECT_EQ(offset[2], 0x7ffffffeu);
  EXPECT_EQ(cub_size(offset[2] + 1), 0x7fffffff);
}

TEST(Segments, LargerBatchesAreErrors) {
  for (const std::uint64_t total : {std::uint64_t(0x7fffffff), std::uint64_t(1) << 40})
    EXPECT_THROW(batch_offsets(1, [&](std::size_t) { return total; }), InvalidArgument);
  EXPECT_THROW(cub_size(std::size_t(1) << 31), InvalidArgument);
}

}  // namespace
}  // namespace gpureg::cuda
