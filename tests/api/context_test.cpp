// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/context.hpp"
#include "api/with_settings.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "gpureg/registration.hpp"
#include "support/expect_error.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

TEST(Context, SaysWhatItIs) {
  const Context context = Context::cpu(3);
  EXPECT_EQ(context.backend(), Backend::cpu);
  EXPECT_EQ(context.threads(), 3u);
  EXPECT_EQ(context.description(), "cpu, 3 threads");
  EXPECT_GE(Context::cpu().threads(), 1u);
  EXPECT_NO_THROW(Context::best());
  EXPECT_GE(describe_backends().size(), 2u);
}

TEST(Context, RefusesAbsurdArguments) {
  test::expect_error<InvalidArgument>([] { Context::cpu(100000); }, {"threads", "100000"});
  test::expect_error<InvalidArgument>([] { Context::cuda(-1); }, {"device", "-1"});
  EXPECT_THROW(Context::cuda(1000), BackendUnavailable);
}

TEST(Context, CloudsOfOneCpuContextGoWithAnother) {
  std::mt19937 random(1);
  const std::vector<Eigen::Vector3f> points = test::scan_room(random);
  const PreparedCloud a = prepare(Context::cpu(1), PointCloudView(points)),
                      b = prepare(Context::cpu(2), PointCloudView(points));
  RegistrationSettings options;
  options.quadruples.count = 1000;
  EXPECT_NO_THROW(align(Context::cpu(1), a, b, options));
}

TEST(Context, SharedByTwoThreads) {
  std::mt19937 random(2);
  const std::vector<Eigen::Vector3f> points = test::scan_room(random);
  const Context context = Context::cpu(2);
  RegistrationSettings options = resolve(RegistrationOptions{0.12f});
  const PreparedCloud cloud = prepare(context, PointCloudView(points), options.prepare);
  options.quadruples.count = 500;
  const Eigen::Matrix4d expected =
      align(context, cloud, cloud, options).target_from_source.matrix();
  std::vector<Eigen::Matrix4d> found(4);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (int k = 0; k < 3; ++k)
        found[t] = align(context, cloud, cloud, options).target_from_source.matrix();
    });
  for (std::thread& t : threads) t.join();
  for (const Eigen::Matrix4d& m : found) EXPECT_EQ(m, expected);
}

}  // namespace
}  // namespace gpureg
