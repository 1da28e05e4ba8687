// SPDX-License-Identifier: BSD-3-Clause
// Calls that return at once, on the CPU; tests/cuda has the rest.
#include <gtest/gtest.h>

#include "gpureg/cuda_interop.hpp"
#include "support/expect_error.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

TEST(Async, FuturesHoldTheResults) {
  std::mt19937 random(4);
  const auto a = test::scan_room(random),
             b = test::moved(test::random_pose(random), test::scan_room(random));
  RegistrationOptions options{0.1f};
  options.quadruples = 5000;
  const Context context = Context::cpu(2);
  const auto clouds = prepare_batch(context, {PointCloudView(a), PointCloudView(b)}, options);
  const auto expected = test::bytes(align(context, clouds[0], clouds[1], options));
  auto one = align_async(context, clouds[0], clouds[1], options);
  auto many = align_batch_async(context, clouds, {{0, 1}, {0, 1}}, options);
  EXPECT_EQ(test::bytes(one.get()), expected);
  for (const RegistrationResult& result : many.get()) EXPECT_EQ(test::bytes(result), expected);
  options.quadruples = 0;
  auto bad = align_async(context, clouds[0], clouds[1], options);
  EXPECT_THROW(bad.get(), InvalidArgument);
}

TEST(Async, DeviceMemoryNeedsACudaContext) {
  const float point[3] = {1, 2, 3};
  DevicePointCloudView view;
  view.points = point;
  view.size = 1;
  try {
    prepare_async(Context::cpu(1), view, {}, nullptr);
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("need a CUDA context, this one is cpu"),
              std::string::npos)
        << error.what();
  }
  EXPECT_TRUE(Context::cpu(1).device_memory().empty());
}

TEST(Async, ABatchInDeviceMemoryNeedsACudaContext) {
  const float row[3] = {0, 0, 0};
  DevicePointCloudView view;
  view.points = row;
  view.size = 1;
  const Context cpu = Context::cpu(1);
  test::expect_error<InvalidArgument>(
      [&] { prepare_batch_async(cpu, {view, view}, {}, {nullptr}).get(); }, {"CUDA", "cpu"});
  view.point_stride = 2;
  test::expect_error<InvalidArgument>(
      [&] { prepare_batch_async(cpu, {view}, {}, {nullptr}).get(); }, {"point_stride"});
}

}  // namespace
}  // namespace gpureg
