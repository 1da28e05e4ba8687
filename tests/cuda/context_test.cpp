// SPDX-License-Identifier: BSD-3-Clause
// The public door on the GPU: same results as on the CPU, whatever the split; errors that leave the context usable; threads.
#include <cuda_runtime_api.h>

#include <thread>

#include "cuda/gpu.hpp"
#include "gpureg/error.hpp"
#include "gpureg/registration.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using test::bytes;
using Results = std::vector<std::vector<char>>;

Results all_bytes(const std::vector<RegistrationResult>& results) {
  Results out;
  for (const RegistrationResult& r : results) out.push_back(bytes(r));
  return out;
}

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

class CudaContext : public ::testing::Test {
 protected:
  CudaContext() : options(RegistrationOptions::from_voxel_size(0.08f)) {
    options.hypothesis.count = 20000;
    std::mt19937 random(1);
    for (int k = 0; k < 6; ++k) scans.push_back(test::moved(test::random_pose(random), test::scan_room(random)));
    scans.push_back({});
    for (const auto& s : scans) views.emplace_back(s);
    for (std::uint32_t i = 0; i < scans.size(); ++i)
      for (std::uint32_t j = i + 1; j < scans.size(); ++j) pairs.push_back({j, i});
  }
  void SetUp() override { GPUREG_GPU_OR_SKIP(); }
  Results run(const Context& context, const std::vector<Pair>& list) const {
    return all_bytes(align_batch(context, prepare_batch(context, views, options.prepare), list, options));
  }
  RegistrationOptions options;
  std::vector<std::vector<Eigen::Vector3f>> scans;
  std::vector<PointCloudView> views;
  std::vector<Pair> pairs;
};

TEST_F(CudaContext, ResultsAreTheCpusInAnySplit) {
  const Results expected = run(Context::cpu(), pairs);
  const Context context = Context::cuda();
  EXPECT_EQ(context.backend(), Backend::cuda);
  EXPECT_EQ(Context::best().backend(), Backend::cuda);
  EXPECT_EQ(run(context, pairs), expected);
  for (std::size_t k = 0; k < pairs.size(); k += 5) {
    EXPECT_EQ(run(context, {pairs[k]})[0], expected[k]);
    EXPECT_EQ(bytes(align(context, views[pairs[k].source], views[pairs[k].target], options)), expected[k]);
  }
  std::vector<Pair> repeated;
  for (int k = 0; k < 30; ++k) repeated.insert(repeated.end(), pairs.begin(), pairs.end());
  const Results many = run(context, repeated);
  for (std::size_t k = 0; k < many.size(); ++k) ASSERT_EQ(many[k], expected[k % pairs.size()]) << k;
}

TEST_F(CudaContext, HostCopiesAreTheCpus) {
  const PreparedCloud cpu = prepare(Context::cpu(), views[0], options.prepare), cuda = prepare(Context::cuda(), views[0], options.prepare);
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
  EXPECT_EQ(all_bytes(align_batch(Context::cuda(), clouds, pairs, options)), run(Context::cuda(), pairs));
  EXPECT_THROW(align(Context::cpu(), clouds[0], clouds[1], options), InvalidArgument);
}

TEST_F(CudaContext, ADeviceThatDoesNotExist) {
  try {
    Context::cuda(1000);
    FAIL();
  } catch (const BackendUnavailable& error) {
    EXPECT_NE(std::string(error.what()).find("device 1000 does not exist"), std::string::npos) << error.what();
  }
}

TEST_F(CudaContext, OutOfMemoryIsAnErrorThatLeavesTheContextUsable) {
  const Context context = Context::cuda();
  const Results expected = run(context, pairs);
  // Somebody else takes nearly everything.
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
  for (int k = 0; k < 2; ++k) align_batch(context, clouds, pairs, options);
  std::size_t before = 0, after = 0, total = 0;
  ASSERT_EQ(cudaMemGetInfo(&before, &total), cudaSuccess);
  for (int k = 0; k < 5; ++k) align_batch(context, clouds, pairs, options);
  ASSERT_EQ(cudaMemGetInfo(&after, &total), cudaSuccess);
  EXPECT_EQ(before, after);
}

TEST_F(CudaContext, ThreadsWithTheirOwnContextsAndThreadsThatShareOne) {
  const Results expected = run(Context::cuda(), pairs);
  const Context shared = Context::cuda();
  std::vector<Results> got(4);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] { got[static_cast<std::size_t>(t)] = run(t < 2 ? Context::cuda() : shared, pairs); });
  for (std::thread& t : threads) t.join();
  for (const Results& g : got) EXPECT_EQ(g, expected);
}

TEST_F(CudaContext, EveryDeviceGivesTheSame) {
  int devices = 0;
  ASSERT_EQ(cudaGetDeviceCount(&devices), cudaSuccess);
  const Results expected = run(Context::cuda(0), pairs);
  for (int d = 1; d < devices; ++d) {
    const Context other = Context::cuda(d);
    EXPECT_EQ(run(other, pairs), expected) << "device " << d;
    EXPECT_THROW(align(other, prepare(Context::cuda(0), views[0], options.prepare), prepare(other, views[1], options.prepare), options),
                 InvalidArgument);
  }
  int current = -1;
  ASSERT_EQ(cudaGetDevice(&current), cudaSuccess);
  EXPECT_EQ(current, 0) << "the caller's device was not given back";
}

}  // namespace
}  // namespace gpureg
