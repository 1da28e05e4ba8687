// SPDX-License-Identifier: BSD-3-Clause
// A searched scale on both backends: the same bits.
#include "gpureg/registration/scale.hpp"

#include <gtest/gtest.h>

#include <random>

#include "cuda/gpu.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

TEST(ScaleOnCuda, HasTheSameBits) {
  GPUREG_GPU_OR_SKIP();
  std::mt19937 random(7);
  const auto target = test::scan_room(random);
  auto source = test::moved(test::random_pose(random), test::scan_room(random));
  for (Eigen::Vector3f& p : source) p *= 0.4f;
  const RegistrationOptions options{0.08f};
  const PointCloudView a(source), b(target);
  const ScaledResult cpu = align_scaled(Context::cpu(2), a, b, {}, options),
                     cuda = align_scaled(Context::cuda(), a, b, {}, options);
  EXPECT_TRUE(cuda.aligned()) << explain(cuda);
  EXPECT_EQ(cpu.scale, cuda.scale);
  EXPECT_EQ(cpu.information, cuda.information);
  ASSERT_EQ(cpu.candidates.size(), cuda.candidates.size());
  for (std::size_t k = 0; k < cpu.candidates.size(); ++k) {
    EXPECT_EQ(cpu.candidates[k].scale, cuda.candidates[k].scale);
    EXPECT_EQ(cpu.candidates[k].confidence, cuda.candidates[k].confidence);
  }
  EXPECT_EQ(test::bytes(cpu.result), test::bytes(cuda.result));
  CudaOptions twice;
  twice.devices = {0, 0};
  EXPECT_EQ(cpu.scale, align_scaled(Context::cuda(twice), a, b, {}, options).scale);
}

}  // namespace
}  // namespace gpureg
