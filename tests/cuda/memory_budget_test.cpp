// SPDX-License-Identifier: BSD-3-Clause
// Prepared clouds beyond a context's memory budget wait in host memory: the results stay, and the
// device holds no more than it may.
#include "cuda/room_scans.hpp"
#include "gpureg/error.hpp"

namespace gpureg {
namespace {

using test::all_bytes;
using test::Results;

class MemoryBudget : public test::RoomScans {
 protected:
  static Context with_budget(std::size_t bytes) {
    CudaOptions options;
    options.memory_budget = bytes;
    return Context::cuda(options);
  }
  /// Device memory of all clouds.
  std::size_t bytes_of_all() const {
    const Context context = Context::cuda();
    const auto clouds = prepare_batch(context, views, options.prepare);
    return context.device_memory()[0].bytes_in_use;
  }
};

TEST_F(MemoryBudget, ResultsAreTheSameHoweverSmallItIs) {
  const Results expected = run(Context::cuda(), pairs);
  const std::size_t all = bytes_of_all();
  for (const double part : {2.0, 0.9, 0.6, 0.4}) {
    SCOPED_TRACE(part);
    const auto budget = static_cast<std::size_t>(part * static_cast<double>(all));
    const Context context = with_budget(budget);
    const auto clouds = prepare_batch(context, views, options.prepare);
    EXPECT_LE(context.device_memory()[0].bytes_in_use, budget);
    // Two rounds: the second one reloads the clouds evicted first.
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(all_bytes(align_batch(context, clouds, pairs, options)), expected);
      EXPECT_LE(context.device_memory()[0].bytes_in_use, budget);
    }
    if (part < 1) EXPECT_GT(context.device_memory()[0].clouds_evicted, 0u);
    if (part > 1) EXPECT_EQ(context.device_memory()[0].clouds_evicted, 0u);
  }
}

TEST_F(MemoryBudget, HostCopiesOfEvictedClouds) {
  const Context free = Context::cuda(), tight = with_budget(1);
  const auto kept = prepare_batch(free, views, options.prepare),
             driven_out = prepare_batch(tight, views, options.prepare);
  EXPECT_EQ(tight.device_memory()[0].bytes_in_use, 0u);
  for (std::size_t k = 0; k < views.size(); ++k) {
    EXPECT_EQ(kept[k].points(), driven_out[k].points());
    EXPECT_EQ(kept[k].normals(), driven_out[k].normals());
    EXPECT_EQ(kept[k].features(), driven_out[k].features());
  }
  // Another context has room for them.
  EXPECT_EQ(all_bytes(align_batch(free, driven_out, pairs, options)), run(free, pairs));
}

TEST_F(MemoryBudget, TooSmallForOnePairIsAnErrorThatLeavesTheContextUsable) {
  const Results expected = run(Context::cuda(), pairs);
  const Context context = with_budget(1000);
  const auto clouds = prepare_batch(context, views, options.prepare);
  try {
    align_batch(context, clouds, pairs, options);
    FAIL() << "a pair within 1000 bytes";
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("memory_budget is 1000 bytes"), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("stays usable"), std::string::npos) << error.what();
  }
  EXPECT_EQ(clouds[0].points().size(), clouds[0].size());
  EXPECT_EQ(all_bytes(align_batch(Context::cuda(), clouds, pairs, options)), expected);
}

TEST_F(MemoryBudget, SharedWithAContextThatHasNone) {
  const Results expected = run(Context::cuda(), pairs);
  const Context free = Context::cuda(), tight = with_budget(bytes_of_all() / 2);
  auto clouds = prepare_batch(tight, views, options.prepare);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(all_bytes(align_batch(free, clouds, pairs, options)), expected);
    EXPECT_EQ(all_bytes(align_batch(tight, clouds, pairs, options)), expected);
  }
  clouds.clear();
  EXPECT_EQ(tight.device_memory()[0].bytes_in_use, 0u)
      << "clouds that nobody has any more take memory";
}

}  // namespace
}  // namespace gpureg
