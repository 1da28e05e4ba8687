// SPDX-License-Identifier: BSD-3-Clause
// The public API on the GPU: same results as on the CPU, whatever the split; errors that leave the
// context usable; threads.
#include <cuda_runtime_api.h>

#include <chrono>
#include <future>
#include <thread>

#include "api/with_settings.hpp"
#include "cuda/common/engine.hpp"
#include "cuda/room_scans.hpp"
#include "gpureg/error.hpp"

namespace gpureg {
namespace {

using test::all_bytes;
using test::bytes;
using test::Results;

TEST(NoCudaDevice, TheReasonIsSaid) {
  if (test::has_gpu()) GTEST_SKIP() << "this machine has a CUDA device";
  try {
    Context::cuda();
    FAIL() << "no device, but a context";
  } catch (const BackendUnavailable& error) {
    EXPECT_EQ(std::string(error.what()).rfind("cuda: ", 0), 0u) << error.what();
  }
  EXPECT_EQ(Context::best().backend(), Backend::cpu);
}

class CudaContext : public test::RoomScans {};

TEST_F(CudaContext, ResultsAreTheCpusInAnySplit) {
  const Results expected = run(Context::cpu(), pairs);
  const Context context = Context::cuda();
  EXPECT_EQ(context.backend(), Backend::cuda);
  EXPECT_EQ(Context::best().backend(), Backend::cuda);
  EXPECT_EQ(run(context, pairs), expected);
  for (std::size_t k = 0; k < pairs.size(); k += 5) {
    EXPECT_EQ(run(context, {pairs[k]})[0], expected[k]);
    EXPECT_EQ(bytes(align(context, views[pairs[k].source], views[pairs[k].target], options)),
              expected[k]);
  }
  std::vector<Pair> repeated;
  for (int k = 0; k < 30; ++k) repeated.insert(repeated.end(), pairs.begin(), pairs.end());
  const Results many = run(context, repeated);
  for (std::size_t k = 0; k < many.size(); ++k) ASSERT_EQ(many[k], expected[k % pairs.size()]) << k;
}

TEST_F(CudaContext, HostCopiesAreTheCpus) {
  const PreparedCloud cpu = prepare(Context::cpu(), views[0], options.prepare),
                      cuda = prepare(Context::cuda(), views[0], options.prepare);
  EXPECT_EQ(cpu.points(), cuda.points());
  EXPECT_EQ(cpu.normals(), cuda.normals());
  EXPECT_EQ(cpu.features(), cuda.features());
  EXPECT_EQ(cpu.statistics().points_without_feature, cuda.statistics().points_without_feature);
  EXPECT_GT(cuda.statistics().total(), 0);
}

TEST_F(CudaContext, CloudsOutliveTheirContextAndGoWithAnother) {
  std::vector<PreparedCloud> clouds;
  {
    const Context context = Context::cuda();
    clouds = prepare_batch(context, views, options.prepare);
  }
  EXPECT_EQ(all_bytes(align_batch(Context::cuda(), clouds, pairs, options)),
            run(Context::cuda(), pairs));
  EXPECT_THROW(align(Context::cpu(), clouds[0], clouds[1], options), InvalidArgument);
}

TEST_F(CudaContext, ADeviceThatDoesNotExist) {
  try {
    Context::cuda(1000);
    FAIL();
  } catch (const BackendUnavailable& error) {
    EXPECT_NE(std::string(error.what()).find("device 1000 does not exist"), std::string::npos)
        << error.what();
  }
}

TEST_F(CudaContext, OutOfMemoryIsAnErrorThatLeavesTheContextUsable) {
  const Context context = Context::cuda();
  const Results expected = run(context, pairs);
  // Another allocation takes nearly all memory.
  std::vector<void*> taken;
  for (std::size_t piece = std::size_t(1) << 36; piece >= (std::size_t(1) << 20); piece /= 2)
    for (void* p = nullptr; cudaMalloc(&p, piece) == cudaSuccess;) taken.push_back(p);
  cudaGetLastError();
  const std::vector<Eigen::Vector3f> large(20'000'000, Eigen::Vector3f(1, 2, 3));
  try {
    prepare(context, PointCloudView(large), options.prepare);
    ADD_FAILURE() << "20 million points fitted into a full device";
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("out of memory"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("stays usable"), std::string::npos) << error.what();
  }
  for (void* p : taken) cudaFree(p);
  EXPECT_EQ(run(context, pairs), expected);
}

TEST_F(CudaContext, WarmRunsTakeNoMoreMemory) {
  const Context context = Context::cuda();
  const auto clouds = prepare_batch(context, views, options.prepare);
  // The pool splits its memory anew where two kinds of calls alternate: it is warm after both kinds
  // in turn.
  for (int k = 0; k < 2; ++k) {
    align_batch(context, clouds, pairs, options);
    prepare_batch(context, views, options.prepare);
  }
  std::size_t before = 0, after = 0, total = 0;
  ASSERT_EQ(cudaMemGetInfo(&before, &total), cudaSuccess);
  const std::size_t reserved = context.device_memory()[0].bytes_reserved;
  for (int k = 0; k < 5; ++k) {
    align_batch(context, clouds, pairs, options);
    prepare_batch(context, views, options.prepare);
  }
  ASSERT_EQ(cudaMemGetInfo(&after, &total), cudaSuccess);
  EXPECT_EQ(before, after);
  EXPECT_EQ(context.device_memory()[0].bytes_reserved, reserved)
      << "the pool asked the driver for more";
  EXPECT_LE(context.device_memory()[0].bytes_in_use, reserved);
}

TEST_F(CudaContext, ThreadsWithTheirOwnContextsAndThreadsThatShareOne) {
  const Results expected = run(Context::cuda(), pairs);
  const Context shared = Context::cuda();
  std::vector<Results> got(4);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      got[static_cast<std::size_t>(t)] = run(t < 2 ? Context::cuda() : shared, pairs);
    });
  for (std::thread& t : threads) t.join();
  for (const Results& g : got) EXPECT_EQ(g, expected);
}

// One context needs more shared memory per block than the other: the permission is the device's.
TEST_F(CudaContext, ContextsOfOneDeviceNeedDifferentSharedMemory) {
  options = resolve(RegistrationOptions::loopsmart(0.05f));
  options.quadruples.count = 200000;
  const std::vector<Eigen::Vector3f> few(scans[1].begin(), scans[1].begin() + 300);
  const auto align_many = [&](std::size_t first, int rounds) {
    const Context context = Context::cuda();
    std::vector<PointCloudView> two(views.begin() + static_cast<std::ptrdiff_t>(first),
                                    views.begin() + static_cast<std::ptrdiff_t>(first) + 2);
    if (first == 0) two[1] = PointCloudView(few);
    const auto clouds = prepare_batch(context, two, options.prepare);
    Results out;
    for (int k = 0; k < rounds; ++k)
      out.push_back(bytes(align(context, clouds[0], clouds[1], options)));
    return out;
  };
  const Results small = align_many(0, 1), large = align_many(2, 1);
  auto others = std::async(std::launch::async, [&] { return align_many(0, 300); });
  for (const auto& result : align_many(2, 300)) EXPECT_EQ(result, large[0]);
  for (const auto& result : others.get()) EXPECT_EQ(result, small[0]);
}

TEST_F(CudaContext, TrimReturnsWhatNothingUses) {
  const Context context = Context::cuda();
  Context::cpu(1).trim();
  context.trim();
  const Results expected = run(context, pairs);
  auto clouds = prepare_batch(context, views, options.prepare);
  const DeviceMemoryUse warm = context.device_memory()[0];
  EXPECT_GT(warm.bytes_reserved, warm.bytes_in_use);
  context.trim();
  const DeviceMemoryUse trimmed = context.device_memory()[0];
  EXPECT_EQ(trimmed.bytes_in_use, warm.bytes_in_use) << "the prepared clouds stay";
  EXPECT_LE(trimmed.bytes_reserved, warm.bytes_reserved) << "in blocks: clouds may hold them all";
  EXPECT_GE(trimmed.bytes_reserved, trimmed.bytes_in_use);
  EXPECT_EQ(all_bytes(align_batch(context, clouds, pairs, options)), expected);
  clouds.clear();
  context.trim();
  EXPECT_EQ(context.device_memory()[0].bytes_in_use, 0u);
  EXPECT_EQ(context.device_memory()[0].bytes_reserved, 0u);
  EXPECT_EQ(run(context, pairs), expected);
}

// Errors of the runtime on machines without a usable device.
TEST(NoCudaDevice, EveryReasonHasItsWords) {
  EXPECT_EQ(cuda::why_no_device(cudaErrorInsufficientDriver, 0, 13000),
            "no NVIDIA driver on this machine");
  EXPECT_EQ(cuda::why_no_device(cudaErrorInsufficientDriver, 12020, 13000),
            "the NVIDIA driver supports CUDA 12.2, this build needs 13.0");
  EXPECT_EQ(cuda::why_no_device(cudaErrorNoDevice, 13000, 13000), "no CUDA device on this machine");
  EXPECT_NE(
      cuda::why_no_device(cudaErrorSystemNotReady, 13000, 13000).find("cudaErrorSystemNotReady"),
      std::string::npos);
}

// The default stream is held up: whatever ran on it, or waited for it, would not finish.
TEST_F(CudaContext, NothingRunsOnTheDefaultStream) {
  const Context context = Context::cuda();
  const Results expected = run(context, pairs);
  std::promise<void> release;
  auto released = release.get_future();
  ASSERT_EQ(
      cudaLaunchHostFunc(
          nullptr, [](void* gate) { static_cast<std::future<void>*>(gate)->wait(); }, &released),
      cudaSuccess);
  auto got = std::async(std::launch::async, [&] { return run(context, pairs); });
  const bool finished = got.wait_for(std::chrono::seconds(60)) == std::future_status::ready;
  EXPECT_EQ(cudaStreamQuery(nullptr), cudaErrorNotReady)
      << "the default stream was not held up: the test shows nothing";
  release.set_value();
  EXPECT_TRUE(finished) << "some work waits for the default stream";
  EXPECT_EQ(got.get(), expected);
  EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess);
}

}  // namespace
}  // namespace gpureg
