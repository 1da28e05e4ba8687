// SPDX-License-Identifier: BSD-3-Clause
// Poses that a symmetry of a part makes equivalent form one group with its own confidence.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "gpureg/registration.hpp"
#include "support/scan.hpp"
#include "symmetry/symmetry.hpp"

namespace gpureg {
namespace {

using test::moved;
using test::random_pose;

struct Part {
  std::vector<Eigen::Vector3f> points, normals;

  PointCloudView view() const {
    PointCloudView view(points);
    view.normals = normals.front().data();
    view.normal_stride = 3;
    return view;
  }
};

/// A plate of 1 x 0.6 x 0.1 with bosses, all of them symmetric to the axis z by half a turn; one
/// more boss breaks the symmetry. Closed, with normals outwards, and noise.
Part plate(unsigned seed, bool symmetric) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit;
  std::normal_distribution<float> noise(0, 0.001f);
  Part part;
  const auto add = [&](const Eigen::Vector3f& p, const Eigen::Vector3f& n) {
    part.points.push_back(p + noise(random) * n);
    part.normals.push_back(n);
  };
  const auto box = [&](const Eigen::Vector3f& low, const Eigen::Vector3f& size) {
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (const float side : {0.f, 1.f})
        for (int k = static_cast<int>(20000 * size[u] * size[v]); k > 0; --k) {
          Eigen::Vector3f p = low, n = Eigen::Vector3f::Zero();
          p[axis] += side * size[axis];
          p[u] += unit(random) * size[u];
          p[v] += unit(random) * size[v];
          n[axis] = 2 * side - 1;
          add(p, n);
        }
    }
  };
  box({-0.5f, -0.3f, 0}, {1, 0.6f, 0.1f});
  for (const float sign : {-1.f, 1.f}) {
    const auto boss = [&](float x, float y, const Eigen::Vector3f& size) {
      box({sign * x - size.x() / 2, sign * y - size.y() / 2, 0.1f}, size);
    };
    boss(0.35f, 0.15f, {0.12f, 0.12f, 0.15f});
    boss(-0.3f, 0.18f, {0.2f, 0.07f, 0.08f});
    boss(0.1f, -0.2f, {0.08f, 0.1f, 0.22f});
  }
  if (!symmetric) box({0.12f, 0.02f, 0.1f}, {0.25f, 0.1f, 0.3f});
  return part;
}

Part moved_part(const Eigen::Isometry3d& pose, Part part) {
  part.points = moved(pose, std::move(part.points));
  for (Eigen::Vector3f& n : part.normals) n = pose.linear().cast<float>() * n;
  return part;
}

Part left_of(const Part& part, float x) {
  Part out;
  for (std::size_t k = 0; k < part.points.size(); ++k)
    if (part.points[k].x() < x) {
      out.points.push_back(part.points[k]);
      out.normals.push_back(part.normals[k]);
    }
  return out;
}

const Context& cpu() {
  static const Context context = Context::cpu(2);
  return context;
}

RegistrationResult registered(bool symmetric, const Eigen::Isometry3d& truth,
                              const RegistrationOptions& options) {
  const Part model = plate(1, symmetric);
  const Part scan = moved_part(truth.inverse(), left_of(plate(2, symmetric), 0.3f));
  return align(cpu(), scan.view(), model.view(), options);
}

TEST(EquivalentPoses, HalfATurnIsFoundAndCounted) {
  std::mt19937 random(3);
  const auto options = RegistrationOptions{0.02f};
  const Eigen::Isometry3d turn(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
  for (int k = 0; k < 3; ++k) {
    const Eigen::Isometry3d truth = random_pose(random);
    const RegistrationResult result = registered(true, truth, options);
    ASSERT_EQ(result.equivalent_poses(), 2u);
    EXPECT_FALSE(result.modes.front().equivalent);
    // Equivalent poses have odds within a factor of ten. Their sum is at most 1, so the first one
    // has at most 0.76: the root of ten to one.
    EXPECT_LE(result.confidence, 0.75);
    EXPECT_GT(result.symmetry_confidence(), result.confidence + 0.1);
    EXPECT_LE(result.symmetry_confidence(), 1);
    // One of the two is the truth, the other half a turn away.
    std::vector<double> errors;
    for (const RegistrationMode& mode : result.modes)
      if (&mode == &result.modes.front() || mode.equivalent)
        errors.push_back(
            std::min(test::rotation_error_degrees(truth, mode.target_from_source),
                     test::rotation_error_degrees(turn * truth, mode.target_from_source)));
    for (const double error : errors) EXPECT_LT(error, 2);
  }
}

TEST(EquivalentPoses, APartWithoutSymmetryHasNone) {
  std::mt19937 random(4);
  const RegistrationResult result =
      registered(false, random_pose(random), RegistrationOptions{0.02f});
  EXPECT_EQ(result.equivalent_poses(), 1u);
  EXPECT_EQ(result.symmetry_confidence(), result.confidence);
  EXPECT_NE(result.reason, RegistrationReason::symmetric);
}

TEST(EquivalentPoses, UsersSayWhetherTheyAcceptThem) {
  std::mt19937 random(5);
  const Eigen::Isometry3d truth = random_pose(random);
  auto options = RegistrationOptions{0.02f};
  const double together = registered(true, truth, options).symmetry_confidence();
  ASSERT_GT(together, 0);
  // Between the confidence of one pose and that of both.
  options.min_confidence = 0.9 * together;
  const RegistrationResult refused = registered(true, truth, options);
  EXPECT_EQ(refused.status, RegistrationStatus::not_aligned);
  EXPECT_EQ(refused.reason, RegistrationReason::symmetric);
  EXPECT_FALSE(refused.aligned());
  options.accept_symmetry = true;
  const RegistrationResult accepted = registered(true, truth, options);
  EXPECT_EQ(accepted.status, RegistrationStatus::aligned_up_to_symmetry);
  EXPECT_EQ(accepted.reason, RegistrationReason::none);
  EXPECT_TRUE(accepted.aligned());
  EXPECT_EQ(accepted.confidence, refused.confidence);
  options.min_confidence = 0.5 * (1 + together);
  EXPECT_EQ(registered(true, truth, options).reason, RegistrationReason::ambiguous);
}

std::vector<Vec3> to_vec3(const std::vector<Eigen::Vector3f>& rows) {
  std::vector<Vec3> out;
  for (const Eigen::Vector3f& row : rows) out.push_back({row.x(), row.y(), row.z()});
  return out;
}

TEST(CloudSymmetry, KnowsTheMotionsOfAPlate) {
  const auto cloud = [](bool symmetric) {
    const Part part = plate(1, symmetric);
    return CloudSymmetry(to_vec3(part.points), to_vec3(part.normals), 0.03f);
  };
  CloudSymmetry symmetric = cloud(true), other = cloud(false);
  const auto turned = [](double degrees, const Eigen::Vector3d& axis,
                         const Eigen::Vector3d& shift) {
    Eigen::Isometry3d motion(Eigen::AngleAxisd(degrees * M_PI / 180, axis.normalized()));
    motion.translation() = shift;
    return motion;
  };
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  const double slack = 0.1;
  EXPECT_TRUE(symmetric.has(turned(180, z, none), slack));
  EXPECT_TRUE(symmetric.has(turned(183, z, {0.01, -0.02, 0.01}), slack));
  EXPECT_FALSE(symmetric.has(turned(0, z, none), slack)) << "the identity";
  EXPECT_FALSE(symmetric.has(turned(3, z, {0.01, 0, 0}), slack)) << "close to the identity";
  EXPECT_FALSE(symmetric.has(turned(90, z, none), slack));
  EXPECT_FALSE(symmetric.has(turned(180, x, {0, 0, 0.1}), slack)) << "upside down";
  EXPECT_FALSE(symmetric.has(turned(0, z, {0.3, 0, 0}), slack)) << "along the plate";
  EXPECT_FALSE(other.has(turned(180, z, none), slack));
  EXPECT_FALSE(CloudSymmetry({}, {}, 0.03f).has(turned(180, z, none), slack));
}

}  // namespace
}  // namespace gpureg
