// SPDX-License-Identifier: BSD-3-Clause
// All pairs of a real scene: status, counts and the bits of every pose are the CPU's.
#include <filesystem>
#include <fstream>
#include <sstream>

#include "api/with_settings.hpp"
#include "cuda/gpu.hpp"
#include "gpureg/registration.hpp"
#include "gpureg/verification.hpp"
#include "support/data_folder.hpp"
#include "support/plain_ply.hpp"
#include "support/result_bytes.hpp"
#include "support/same_evidence.hpp"

namespace gpureg {
namespace {

/// With the positions of the cameras that saw the fragments.
std::vector<PointCloud> scene(const std::string& folder) {
  std::vector<PointCloud> out;
  for (int k = 0; std::filesystem::exists(folder + "/cloud_bin_" + std::to_string(k) + ".ply"); ++k)
    out.push_back(test::read_plain_ply(folder + "/cloud_bin_" + std::to_string(k) + ".ply"));
  std::ifstream cameras(folder + "/cameras.txt");
  for (std::string line; std::getline(cameras, line);) {
    std::istringstream values(line);
    std::size_t fragment, frame;
    Eigen::Vector3f at;
    if (values >> fragment >> frame >> at.x() >> at.y() >> at.z() && fragment < out.size())
      out[fragment].viewpoints.push_back(at);
  }
  return out;
}

std::vector<Pair> all_pairs(std::size_t clouds) {
  std::vector<Pair> out;
  for (std::uint32_t i = 0; i < clouds; ++i)
    for (std::uint32_t j = i + 1; j < clouds; ++j) out.push_back({j, i});
  return out;
}

int different(const std::vector<RegistrationResult>& a, const std::vector<RegistrationResult>& b) {
  int count = 0;
  for (std::size_t k = 0; k < a.size(); ++k) count += test::bytes(a[k]) != test::bytes(b[k]);
  return count;
}

TEST(RedKitchenOnCuda, AllPairsAreTheCpus) {
  GPUREG_GPU_OR_SKIP();
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redkitchen/fragments");
  const std::vector<PointCloud> raw = scene(folder);
  std::vector<PointCloudView> views;
  for (const PointCloud& cloud : raw) views.push_back(cloud.view());
  const std::vector<Pair> pairs = all_pairs(raw.size());
  ASSERT_EQ(pairs.size(), 190u);
  RegistrationSettings options = resolve(RegistrationOptions::loopsmart());
  const Context cpu = Context::cpu(), cuda = Context::cuda();
  const auto on_cpu = prepare_batch(cpu, views, options.prepare),
             on_cuda = prepare_batch(cuda, views, options.prepare);
  const auto expect_same = [&](const std::vector<RegistrationResult>& a,
                               const std::vector<RegistrationResult>& b) {
    EXPECT_EQ(different(a, b), 0) << "of 190, seed " << options.seed;
  };
  for (const std::uint64_t seed : {1, 2, 3}) {
    options.seed = seed;
    expect_same(align_batch(cpu, on_cpu, pairs, options),
                align_batch(cuda, on_cuda, pairs, options));
  }
  // On every device of the machine together; with one device two engines share it.
  CudaOptions all;
  int devices = 0;
  ASSERT_EQ(cudaGetDeviceCount(&devices), cudaSuccess);
  all.devices = devices == 1 ? std::vector<int>{0, 0} : std::vector<int>{};
  const Context together = Context::cuda(all);
  const auto spread = prepare_batch(together, views, options.prepare);
  expect_same(align_batch(cuda, on_cuda, pairs, options),
              align_batch(together, spread, pairs, options));
  expect_same(align_batch(cuda, on_cuda, pairs, options),
              align_batch(together, on_cuda, pairs, options));
  // Another split of the batch, and refinement.
  std::vector<RegistrationResult> one_by_one;
  for (const Pair& pair : pairs)
    one_by_one.push_back(align(cuda, on_cuda[pair.source], on_cuda[pair.target], options));
  expect_same(align_batch(cuda, on_cuda, pairs, options), one_by_one);
  options.refine.max_iterations = 20;
  expect_same(align_batch(cpu, on_cpu, pairs, options), align_batch(cuda, on_cuda, pairs, options));
}

TEST(RedKitchenOnCuda, AllPairsByEvidenceAreTheCpus) {
  GPUREG_GPU_OR_SKIP();
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redkitchen/fragments");
  const std::vector<PointCloud> raw = scene(folder);
  std::vector<PointCloudView> views;
  for (const PointCloud& cloud : raw) views.push_back(cloud.view());
  const std::vector<Pair> pairs = all_pairs(raw.size());
  ASSERT_EQ(pairs.size(), 190u);
  RegistrationSettings options = resolve(RegistrationOptions{0.05f});
  const Context cpu = Context::cpu(), cuda = Context::cuda();
  const auto on_cpu = prepare_batch(cpu, views, options.prepare),
             on_cuda = prepare_batch(cuda, views, options.prepare);
  for (const std::uint64_t seed : {1, 2}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    options.seed = seed;
    const auto batch = align_batch(cuda, on_cuda, pairs, options);
    EXPECT_EQ(different(align_batch(cpu, on_cpu, pairs, options), batch), 0);
    std::vector<RegistrationResult> one_by_one;
    for (const Pair& pair : pairs)
      one_by_one.push_back(align(cuda, on_cuda[pair.source], on_cuda[pair.target], options));
    EXPECT_EQ(different(batch, one_by_one), 0);
  }
}

TEST(RedKitchenOnCuda, VerifiedPosesAreTheCpus) {
  GPUREG_GPU_OR_SKIP();
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redkitchen/fragments");
  const std::vector<PointCloud> raw = scene(folder);
  std::vector<PointCloudView> views;
  for (const PointCloud& cloud : raw) views.push_back(cloud.view());
  const std::vector<Pair> pairs = all_pairs(raw.size());
  const Context cpu = Context::cpu(), cuda = Context::cuda();
  const auto on_cpu = prepare_batch(cpu, views), on_cuda = prepare_batch(cuda, views);
  const auto found = align_batch(cuda, on_cuda, pairs);
  std::vector<std::vector<UnalignedIsometry3d>> poses(pairs.size());
  for (std::size_t p = 0; p < pairs.size(); ++p)
    for (const RegistrationMode& mode : found[p].modes) poses[p].push_back(mode.target_from_source);
  for (const bool refine : {false, true}) {
    VerificationOptions options;
    options.refine = refine;
    options.search_alternatives = refine;
    const auto a = verify_poses_batch(cpu, on_cpu, pairs, poses, RegistrationOptions{}, options);
    const auto b = verify_poses_batch(cuda, on_cuda, pairs, poses, RegistrationOptions{}, options);
    std::size_t verified = 0, different_evidence = 0, different_from_align = 0;
    for (std::size_t p = 0; p < pairs.size(); ++p)
      for (std::size_t k = 0; k < poses[p].size(); ++k, ++verified) {
        different_evidence +=
            !test::same_evidence(a[p][k].evidence, b[p][k].evidence) ||
            a[p][k].confidence != b[p][k].confidence ||
            a[p][k].target_from_source.matrix() != b[p][k].target_from_source.matrix();
        different_from_align += !test::same_evidence(b[p][k].evidence, found[p].modes[k].evidence);
      }
    EXPECT_GT(verified, 1000u);
    EXPECT_EQ(different_evidence, 0u) << "of " << verified << ", refine " << refine;
    if (!refine) EXPECT_EQ(different_from_align, 0u) << "of " << verified;
  }
}

}  // namespace
}  // namespace gpureg
