// SPDX-License-Identifier: BSD-3-Clause
// All pairs of a real scene: status, counts and the bits of every pose are the CPU's.
#include <filesystem>

#include "cuda/gpu.hpp"
#include "gpureg/registration.hpp"
#include "support/data_folder.hpp"
#include "support/plain_ply.hpp"
#include "support/result_bytes.hpp"

namespace gpureg {
namespace {

TEST(RedKitchenOnCuda, AllPairsAreTheCpus) {
  GPUREG_GPU_OR_SKIP();
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redkitchen/fragments");
  std::vector<PointCloud> raw;
  std::vector<PointCloudView> views;
  for (int k = 0; std::filesystem::exists(folder + "/cloud_bin_" + std::to_string(k) + ".ply"); ++k)
    raw.push_back(test::read_plain_ply(folder + "/cloud_bin_" + std::to_string(k) + ".ply"));
  for (const PointCloud& cloud : raw) views.push_back(cloud.view());
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < raw.size(); ++i)
    for (std::uint32_t j = i + 1; j < raw.size(); ++j) pairs.push_back({j, i});
  ASSERT_EQ(pairs.size(), 190u);
  RegistrationOptions options = RegistrationOptions::loopsmart();
  const Context cpu = Context::cpu(), cuda = Context::cuda();
  const auto on_cpu = prepare_batch(cpu, views, options.prepare), on_cuda = prepare_batch(cuda, views, options.prepare);
  const auto expect_same = [&](const std::vector<RegistrationResult>& a, const std::vector<RegistrationResult>& b) {
    int different = 0;
    for (std::size_t k = 0; k < pairs.size(); ++k) different += test::bytes(a[k]) != test::bytes(b[k]);
    EXPECT_EQ(different, 0) << "of 190, seed " << options.hypothesis.seed;
  };
  for (const std::uint64_t seed : {1, 2, 3}) {
    options.hypothesis.seed = seed;
    expect_same(align_batch(cpu, on_cpu, pairs, options), align_batch(cuda, on_cuda, pairs, options));
  }
  // On every device of the machine together; with one device two engines share it.
  CudaOptions all;
  int devices = 0;
  ASSERT_EQ(cudaGetDeviceCount(&devices), cudaSuccess);
  all.devices = devices == 1 ? std::vector<int>{0, 0} : std::vector<int>{};
  const Context together = Context::cuda(all);
  const auto spread = prepare_batch(together, views, options.prepare);
  expect_same(align_batch(cuda, on_cuda, pairs, options), align_batch(together, spread, pairs, options));
  expect_same(align_batch(cuda, on_cuda, pairs, options), align_batch(together, on_cuda, pairs, options));
  // Another split of the batch, and the default preset with its refinement.
  std::vector<RegistrationResult> one_by_one;
  for (const Pair& pair : pairs) one_by_one.push_back(align(cuda, on_cuda[pair.source], on_cuda[pair.target], options));
  expect_same(align_batch(cuda, on_cuda, pairs, options), one_by_one);
  const std::uint64_t seed = options.hypothesis.seed;
  options = RegistrationOptions::from_voxel_size(0.05f);
  options.hypothesis.seed = seed;
  expect_same(align_batch(cpu, on_cpu, pairs, options), align_batch(cuda, on_cuda, pairs, options));
}

}  // namespace
}  // namespace gpureg
