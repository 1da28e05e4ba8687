// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "loop_closure/drive.hpp"

namespace gpureg::test {
namespace {

/// Independent errors: RMS metres and degrees.
class Errors {
 public:
  explicit Errors(unsigned seed) : random_(seed) {}
  Pose draw(double metres, double degrees) {
    const Eigen::Vector3d turn = degrees * M_PI / 180 * vector();
    Pose error = Pose::Identity();
    error.linear() = Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix();
    error.translation() = metres * vector();
    return error;
  }

 private:
  Eigen::Vector3d vector() {
    const double x = normal_(random_), y = normal_(random_), z = normal_(random_);
    return Eigen::Vector3d(x, y, z) / std::sqrt(3.0);
  }
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

double rmse(const std::vector<Pose>& truth, const std::vector<Pose>& poses) {
  Eigen::Matrix3Xd from(3, truth.size()), to(3, truth.size());
  for (std::size_t k = 0; k < truth.size(); ++k) {
    from.col(static_cast<Eigen::Index>(k)) = poses[k].translation();
    to.col(static_cast<Eigen::Index>(k)) = truth[k].translation();
  }
  const Eigen::Matrix4d align = Eigen::umeyama(from, to, false);
  const Eigen::Matrix3Xd moved = (align.topLeftCorner<3, 3>() * from).colwise() +
                                 Eigen::Vector3d(align.topRightCorner<3, 1>());
  return std::sqrt((moved - to).colwise().squaredNorm().mean());
}

struct Errand {
  double odometry = 0, closer = 0;
};

/// Two laps of 20 m, 50 fragments. The loops between neighbours, and between the laps, are as wrong
/// as registered ones, which have heavy tails: 10 cm and 1.5 degrees, every tenth twice as much.
Errand walk(double share, double degrees, unsigned seed) {
  Sequence s = sequence(square(50));
  Errors errors(seed);
  for (std::size_t k = 1; k < s.truth.size(); ++k) {
    const Pose step = s.truth[k - 1].inverse() * s.truth[k];
    s.odometry[k] =
        s.odometry[k - 1] * step * errors.draw(share * step.translation().norm(), degrees);
  }
  LoopCloser closer = closer_of();
  s.add_to(closer);
  int count = 0;
  for (int late = 0; late < 50; ++late)
    for (int early : {late - 2, late - 20, late - 21}) {
      if (early < 0) continue;
      const double size = ++count % 10 == 0 ? 2 : 1;
      const Pose truth = s.truth[static_cast<std::size_t>(early)].inverse() *
                         s.truth[static_cast<std::size_t>(late)];
      closer.add_result(late, early, result_of(truth * errors.draw(0.1 * size, 1.5 * size), 0.95));
    }
  closer.process();
  std::vector<Pose> poses;
  for (const loop_closure::FragmentPose& pose : closer.poses())
    poses.push_back(pose.world_from_fragment);
  return {rmse(s.truth, s.odometry), rmse(s.truth, poses)};
}

TEST(OdometryNoise, GoodOdometryWithoutCovarianceIsNotMadeWorse) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Errand errand = walk(0.01, 0.3, seed);
    EXPECT_LE(errand.closer, 1.05 * errand.odometry) << seed;
  }
}

TEST(OdometryNoise, TheErrorOfBadOdometryIsHalved) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Errand errand = walk(0.03, 1, seed);
    EXPECT_LE(errand.closer, 0.5 * errand.odometry) << seed;
  }
}

}  // namespace
}  // namespace gpureg::test
