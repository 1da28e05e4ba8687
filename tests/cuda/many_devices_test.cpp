// SPDX-License-Identifier: BSD-3-Clause
// Batches spread over several devices: the results of one device. With a single device in the
// machine two engines share it.
#include <cuda_runtime_api.h>

#include <thread>

#include "cuda/room_scans.hpp"
#include "gpureg/error.hpp"

namespace gpureg {
namespace {

using test::all_bytes;
using test::bytes;
using test::Results;

class ManyDevices : public test::RoomScans {
 protected:
  void SetUp() override {
    GPUREG_GPU_OR_SKIP();
    ASSERT_EQ(cudaGetDeviceCount(&devices), cudaSuccess);
  }
  /// Every device once, but two engines at least.
  CudaOptions all() const {
    CudaOptions out;
    out.devices.clear();
    for (int d = 0; d < devices; ++d) out.devices.push_back(d);
    if (devices == 1) out.devices.push_back(0);
    return out;
  }
  std::vector<Pair> repeated(int times) const {
    std::vector<Pair> out;
    for (int k = 0; k < times; ++k) out.insert(out.end(), pairs.begin(), pairs.end());
    return out;
  }
  int devices = 0;
};

TEST_F(ManyDevices, TogetherEqualOneDevice) {
  const auto many = repeated(30);
  const Results expected = run(Context::cuda(0), many);
  const Context together = Context::cuda(all());
  EXPECT_EQ(together.device_memory().size(), all().devices.size());
  EXPECT_EQ(run(together, many), expected);
  EXPECT_EQ(run(together, {pairs[0]})[0], expected[0]);
  CudaOptions every;
  every.devices.clear();
  EXPECT_EQ(run(Context::cuda(every), many), expected);
}

TEST_F(ManyDevices, EachAloneGivesTheSame) {
  const Results expected = run(Context::cpu(), pairs);
  for (int d = 0; d < devices; ++d)
    EXPECT_EQ(run(Context::cuda(d), pairs), expected) << "device " << d;
  int current = -1;
  ASSERT_EQ(cudaGetDevice(&current), cudaSuccess);
  EXPECT_EQ(current, 0) << "the caller's device was not given back";
}

TEST_F(ManyDevices, CloudsOfOneDeviceGoWithEveryOther) {
  const Results expected = run(Context::cuda(0), pairs);
  const auto clouds = prepare_batch(Context::cuda(0), views, options.prepare);
  for (int d = 0; d < devices; ++d)
    EXPECT_EQ(all_bytes(align_batch(Context::cuda(d), clouds, pairs, options)), expected)
        << "device " << d;
  // And with clouds of another device in one pair.
  const Context last = Context::cuda(devices - 1);
  EXPECT_EQ(bytes(align(last, clouds[pairs[0].source],
                        prepare(last, views[pairs[0].target], options.prepare), options)),
            expected[0]);
}

TEST_F(ManyDevices, ThreadsShareThem) {
  const auto many = repeated(5);
  const Results expected = run(Context::cuda(0), many);
  const Context together = Context::cuda(all());
  std::vector<Results> got(3);
  std::vector<std::thread> threads;
  for (Results& results : got) threads.emplace_back([&] { results = run(together, many); });
  for (std::thread& t : threads) t.join();
  for (const Results& results : got) EXPECT_EQ(results, expected);
}

TEST_F(ManyDevices, ABadCloudIsOneErrorAndTheyStayUsable) {
  const Context together = Context::cuda(all());
  const Results expected = run(together, pairs);
  // More than 2^20 voxels wide.
  const std::vector<Eigen::Vector3f> wide{{0, 0, 0}, {1e9f, 0, 0}};
  auto with_bad = views;
  for (int k = 0; k < 20; ++k) with_bad.insert(with_bad.begin() + 3, PointCloudView(wide));
  EXPECT_THROW(prepare_batch(together, with_bad, options.prepare), InvalidArgument);
  EXPECT_EQ(run(together, pairs), expected);
}

TEST_F(ManyDevices, ADeviceThatDoesNotExist) {
  CudaOptions bad;
  bad.devices = {0, devices};
  EXPECT_THROW(Context::cuda(bad), BackendUnavailable);
  bad.devices = {0, -1};
  EXPECT_THROW(Context::cuda(bad), InvalidArgument);
}

}  // namespace
}  // namespace gpureg
