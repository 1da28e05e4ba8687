// SPDX-License-Identifier: BSD-3-Clause
// What a call that fails on the device leaves behind: no work that still reads clouds, and a
// context and clouds that give the same results as before.
#include <algorithm>
#include <chrono>
#include <thread>

#include "common/in_halves.hpp"
#include "cuda/device/lanes.hpp"
#include "cuda/room_scans.hpp"
#include "gpureg/error.hpp"

namespace gpureg {
namespace {

using cuda::DeviceMemory;
using cuda::Lanes;
using test::all_bytes;
using test::Results;

class FailedCallOnCuda : public test::RoomScans {
 protected:
  void TearDown() override { DeviceMemory::fail_after(DeviceMemory::kNever); }
  /// A large call, which works on two lanes; the clouds lie in the memory of the first one.
  std::vector<Pair> many_pairs() const {
    std::vector<Pair> many;
    while (many.size() < 128) many.insert(many.end(), pairs.begin(), pairs.end());
    return many;
  }
  /// True where align_batch() failed for want of memory after so many allocations.
  bool fails_after(std::int64_t allocations, const Context& context,
                   const std::vector<PreparedCloud>& clouds, const std::vector<Pair>& list) const {
    DeviceMemory::fail_after(allocations);
    bool failed = false;
    try {
      align_batch(context, clouds, list, options);
    } catch (const DeviceError& error) {
      failed = true;
      EXPECT_NE(std::string(error.what()).find("stays usable"), std::string::npos) << error.what();
    }
    DeviceMemory::fail_after(DeviceMemory::kNever);
    return failed;
  }
};

void CUDART_CB sleep_on_stream(void*) {
  // Far longer than an exception takes to leave a scope.
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
}

TEST_F(FailedCallOnCuda, LanesAreFreeWhenTheirWorkIsDone) {
  Lanes lanes(0);
  try {
    const Lanes::Held held = lanes.together();
    for (std::size_t k = 0; k < Lanes::kTogether; ++k)
      ASSERT_EQ(cudaLaunchHostFunc(held.exec(k).stream(), sleep_on_stream, nullptr), cudaSuccess);
    throw OutOfDeviceMemory("injected");
  } catch (const OutOfDeviceMemory&) {
  }
  for (std::size_t k = 0; k < Lanes::kTogether; ++k)
    EXPECT_EQ(cudaStreamQuery(lanes.exec(k).stream()), cudaSuccess) << "lane " << k;
}

TEST_F(FailedCallOnCuda, CloudsOutliveTheWorkThatReadsThem) {
  Lanes lanes(0);
  struct Cloud {
    cudaStream_t reader;
    cudaError_t& state;
    ~Cloud() { state = cudaStreamQuery(reader); }
  };
  cudaError_t when_freed = cudaErrorNotReady;
  try {
    const Lanes::Held held = lanes.together();
    const Cloud cloud{held.exec(1).stream(), when_freed};
    const cuda::WaitOnFailure wait(held);
    ASSERT_EQ(cudaLaunchHostFunc(held.exec(1).stream(), sleep_on_stream, nullptr), cudaSuccess);
    throw OutOfDeviceMemory("injected");
  } catch (const OutOfDeviceMemory&) {
  }
  EXPECT_EQ(when_freed, cudaSuccess) << "freed while a kernel of another lane may read it";
}

// Under memcheck and racecheck this shows reads of memory that belongs to other clouds already.
TEST_F(FailedCallOnCuda, ContextAndCloudsAreUsedAgain) {
  const std::vector<Pair> many = many_pairs();
  const Context free = Context::cuda();
  const auto all = prepare_batch(free, views, options.prepare);
  const Results expected = all_bytes(align_batch(free, all, many, options));
  // Without a budget, and with one that drives clouds out.
  for (const std::size_t budget : {std::size_t(0), free.device_memory()[0].bytes_in_use * 3 / 5}) {
    SCOPED_TRACE(budget);
    CudaOptions cuda_options;
    cuda_options.memory_budget = budget;
    const Context context = Context::cuda(cuda_options);
    std::size_t failures = 0;
    for (const std::int64_t allocations : {5, 100}) {
      auto clouds = prepare_batch(context, views, options.prepare);
      failures += fails_after(allocations, context, clouds, many);
      EXPECT_EQ(all_bytes(align_batch(context, clouds, many, options)), expected) << allocations;
      fails_after(allocations, context, clouds, many);
      // Other clouds take the memory at once.
      clouds.clear();
      std::vector<PointCloudView> others(views.rbegin(), views.rend());
      clouds = prepare_batch(context, others, options.prepare);
      std::reverse(clouds.begin(), clouds.end());
      EXPECT_EQ(all_bytes(align_batch(context, clouds, many, options)), expected) << allocations;
    }
    EXPECT_GT(failures, 0u) << "nothing failed: the test tests nothing";
  }
}

TEST_F(FailedCallOnCuda, APreparationIsRepeated) {
  const Results expected = run(Context::cuda(), pairs);
  const Context context = Context::cuda();
  for (const std::int64_t allocations : {0, 5, 20}) {
    DeviceMemory::fail_after(allocations);
    EXPECT_THROW(prepare_batch(context, views, options.prepare), DeviceError) << allocations;
    DeviceMemory::fail_after(DeviceMemory::kNever);
    EXPECT_EQ(run(context, pairs), expected) << allocations;
  }
}

}  // namespace
}  // namespace gpureg
