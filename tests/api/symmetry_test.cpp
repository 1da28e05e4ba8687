// SPDX-License-Identifier: BSD-3-Clause
// Where more than one pose is as good as the truth, the result says so: low confidence, the other
// poses among the modes, and the weakest direction of a pose.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "gpureg/registration.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using Points = std::vector<Eigen::Vector3f>;

/// count points of a surface, with the noise of a scan.
Points sample(std::mt19937& random, int count,
              const std::function<Eigen::Vector3f(float, float, float)>& surface) {
  std::uniform_real_distribution<float> unit;
  std::normal_distribution<float> noise(0, 0.002f);
  Points out;
  for (int k = 0; k < count; ++k) {
    const float a = unit(random), b = unit(random), c = unit(random);
    out.push_back(surface(a, b, c) + Eigen::Vector3f(noise(random), noise(random), noise(random)));
  }
  return out;
}

/// A bare room, all of whose edges are 3 m long, about its centre.
Points cube(std::mt19937& random) {
  return sample(random, 40000, [](float a, float b, float c) {
    const int face = std::min(5, static_cast<int>(6 * c));
    Eigen::Vector3f p(a, b, face % 2 == 0 ? 0.0f : 1.0f);
    std::rotate(p.data(), p.data() + face / 2, p.data() + 3);
    return Eigen::Vector3f(3 * (p.array() - 0.5f));
  });
}

/// A pipe without ends, along z, about its centre.
Points pipe(std::mt19937& random) {
  return sample(random, 30000, [](float a, float b, float) {
    return Eigen::Vector3f(std::cos(6.2831853f * a), std::sin(6.2831853f * a), 4 * b - 2);
  });
}

/// Floor, ceiling and walls of a corridor along y, from one place to another.
Points corridor(std::mt19937& random, float from, float to) {
  return sample(random, 40000, [=](float a, float b, float c) {
    const float y = from + (to - from) * b;
    if (c < 0.45f) return Eigen::Vector3f(1.8f * a, y, c < 0.225f ? 0.0f : 2.4f);
    return Eigen::Vector3f(c < 0.725f ? 0.0f : 1.8f, y, 2.4f * a);
  });
}

/// target_from_source is the truth; the source's points are moved away by it. The sensor stands at
/// eye in the target.
RegistrationResult register_moved(const Points& scanned, const Points& target,
                                  const Eigen::Isometry3d& truth, const Eigen::Vector3f& eye) {
  const Points source = test::moved(truth.inverse(), scanned);
  const Eigen::Vector3f eye_in_source = (truth.inverse() * eye.cast<double>()).cast<float>();
  PointCloudView a(source), b(target);
  a.viewpoints = eye_in_source.data();
  a.viewpoint_count = 1;
  b.viewpoints = eye.data();
  b.viewpoint_count = 1;
  return align(Context::cpu(), a, b, RegistrationOptions{0.1f});
}

/// Error of the pose in the frame of the target: the identity for the true pose.
Eigen::Isometry3d beside(const Eigen::Isometry3d& truth, const RegistrationMode& mode) {
  return mode.target_from_source * truth.inverse();
}

TEST(Symmetry, BareCubeRoom) {
  std::mt19937 random(11);
  const Eigen::Isometry3d truth = test::random_pose(random);
  const RegistrationResult r =
      register_moved(cube(random), cube(random), truth, Eigen::Vector3f::Zero());
  EXPECT_FALSE(r.aligned());
  EXPECT_EQ(r.reason, RegistrationReason::symmetric);
  EXPECT_LT(r.confidence, 0.3);
  // A cube has 24 rotations. Those among the modes are distinct by construction.
  int symmetric = 0;
  for (const RegistrationMode& mode : r.modes) {
    const Eigen::Isometry3d e = beside(truth, mode);
    const Eigen::Matrix3d nearest = e.linear().array().round();
    const bool is_rotation =
        nearest.cwiseAbs().sum() == 3 && std::abs(nearest.determinant() - 1) < 1e-9;
    symmetric +=
        is_rotation && (e.linear() - nearest).norm() < 0.03 && e.translation().norm() < 0.05;
  }
  EXPECT_GE(symmetric, 12) << "of " << r.modes.size() << " modes";
  double sum = 0;
  for (const RegistrationMode& mode : r.modes) sum += mode.confidence;
  EXPECT_LE(sum, 1 + 1e-9) << "at most one of the modes is right";
}

TEST(Symmetry, Pipe) {
  std::mt19937 random(12);
  const Eigen::Isometry3d truth = test::random_pose(random);
  const RegistrationResult r =
      register_moved(pipe(random), pipe(random), truth, Eigen::Vector3f::Zero());
  EXPECT_FALSE(r.aligned()) << r.confidence;
  ASSERT_GT(r.modes.size(), 4u);
  // Turned about z, or z upside down, and shifted by nothing: all the same to a pipe.
  int symmetric = 0;
  for (const RegistrationMode& mode : r.modes) {
    const Eigen::Isometry3d e = beside(truth, mode);
    symmetric += std::abs(e.linear()(2, 2)) > 0.999 && e.translation().head<2>().norm() < 0.05;
  }
  EXPECT_GE(symmetric, 4) << "of " << r.modes.size() << " modes";
  const PoseEvidence& e = r.modes.front().evidence;
  EXPECT_LT(e.information_eigenvalues[0], 1e-2 * e.information_eigenvalues[3]);
}

TEST(Symmetry, CorridorHasAWeakDirection) {
  std::mt19937 random(13);
  for (const bool swap : {false, true}) {
    const Eigen::Isometry3d truth = test::random_pose(random);
    // The smaller cloud is moved inside: both ways round.
    Points a = corridor(random, -7, 3), b = corridor(random, -3, swap ? 5.0f : 9.0f);
    const RegistrationResult r =
        register_moved(swap ? a : b, swap ? b : a, truth, Eigen::Vector3f(0.9f, 0, 1.2f));
    EXPECT_FALSE(r.aligned()) << r.confidence;
    ASSERT_FALSE(r.modes.empty());
    const PoseEvidence& e = r.modes.front().evidence;
    EXPECT_LT(e.information_eigenvalues[0], 1e-2 * e.information_eigenvalues[2]);
    // Along y of the target, and nothing else.
    EXPECT_GT(std::abs(e.weakest_direction[4]), 0.98)
        << e.weakest_direction[3] << " " << e.weakest_direction[4] << " " << e.weakest_direction[5];
  }
}

// The same face where nothing is symmetric: confident, and stiff in every direction.
TEST(Symmetry, FurnishedRoomIsStiff) {
  std::mt19937 random(14);
  const Eigen::Isometry3d truth = test::random_pose(random);
  const Points target = test::scan_room(random);
  const RegistrationResult r =
      register_moved(test::scan_room(random), target, truth, Eigen::Vector3f(1.5f, 2.5f, 1.7f));
  EXPECT_TRUE(r.aligned());
  EXPECT_GT(r.confidence, 0.9);
  const PoseEvidence& e = r.modes.front().evidence;
  EXPECT_GT(e.information_eigenvalues[0], 1e-2 * e.information_eigenvalues[3]);
}

}  // namespace
}  // namespace gpureg
