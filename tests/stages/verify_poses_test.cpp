// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "api/outcome.hpp"
#include "api/with_settings.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg::cpu {
namespace {

// Both information matrices against their definitions, summed in double over the correspondences.
TEST(VerifyPoses, InformationMatricesFollowTheirDefinitions) {
  std::mt19937 random(1);
  Exec exec(2);
  std::vector<Vec3> shape = test::bumpy_sheet(random, 8000, 2.0f), moved = shape;
  // away from the origin, where the matrices have mixed blocks
  for (Vec3& p : shape) p = p + Vec3{3, -2, 1};
  const auto source = test::prepare_one(exec, test::raw_cloud(shape), PrepareSettings{});
  const auto target = test::prepare_one(exec, test::raw_cloud(moved), PrepareSettings{});
  const PairView pair = test::pair_view(*source, *target);
  std::vector<BestPose> pose(1);
  pose[0].found = true;
  // Local frames: the clouds overlap up to the rounding of their origins to voxels.
  pose[0].pose.tx = 0.011;
  pose[0].pose.ty = -0.007;
  pose[0].pose.z = 0.01;
  pose[0].pose.w = std::sqrt(1 - 1e-4);
  RegistrationSettings options;
  const Verification verified = verify_poses(exec, {&pair, 1}, pose, options)[0];

  Eigen::Matrix<double, 6, 6> redwood = Eigen::Matrix<double, 6, 6>::Zero(), open3d = redwood;
  const Rigid rigid = to_rigid(pose[0].pose);
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < source->points.size(); ++i) {
    const Closest c = find_closest(pair.target.closest, pair.target.points,
                                   apply(rigid, source->points[i]), 0.075f * 0.075f);
    if (c.index == kNoValue) continue;
    ++count;
    const auto global = [](const CpuCloud& cloud, std::size_t k) {
      return Eigen::Vector3d(
          static_cast<double>(cloud.points[k].x) + static_cast<double>(cloud.origin[0]),
          static_cast<double>(cloud.points[k].y) + static_cast<double>(cloud.origin[1]),
          static_cast<double>(cloud.points[k].z) + static_cast<double>(cloud.origin[2]));
    };
    const Eigen::Vector3d p = global(*source, i), q = global(*target, c.index);
    Eigen::Matrix<double, 3, 6> a = Eigen::Matrix<double, 3, 6>::Zero(), g = a;
    a.leftCols<3>().setIdentity();
    a.rightCols<3>() << 0, 2 * p.z(), -2 * p.y(), -2 * p.z(), 0, 2 * p.x(), 2 * p.y(), -2 * p.x(),
        0;
    g.leftCols<3>() << 0, q.z(), -q.y(), -q.z(), 0, q.x(), q.y(), -q.x(), 0;
    g.rightCols<3>().setIdentity();
    redwood += a.transpose() * a;
    open3d += g.transpose() * g;
  }
  options.method = RegistrationMethod::quadruples;
  PairOutcome outcome;
  outcome.has_pose = true;
  outcome.support = verified.support;
  outcome.source_moments = verified.source;
  outcome.target_moments = verified.target;
  const RegistrationResult result = to_result(outcome, {*source, *target, options});
  ASSERT_GT(count, 500u);
  EXPECT_EQ(result.source_moments.count, count);
  // Fixed point has 12 digits, the scaled float coordinates 7.
  EXPECT_LT((result.source_moments.information_redwood() - redwood).norm(), 1e-5 * redwood.norm());
  EXPECT_LT((result.target_moments.information_open3d() - open3d).norm(), 1e-5 * open3d.norm());
}

}  // namespace
}  // namespace gpureg::cpu
