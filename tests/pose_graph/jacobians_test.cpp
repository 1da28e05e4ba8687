// SPDX-License-Identifier: BSD-3-Clause
#include "graphs.hpp"
#include "pose_graph/solver/normal_equations.hpp"

namespace gpureg::pose_graph {
namespace {

using test::normal3;

Vector6d random_vector(std::mt19937_64& random, double scale) {
  Vector6d out;
  out << normal3(random), normal3(random);
  return scale * out;
}

/// Central differences of f by a right perturbation.
template <typename Function>
Eigen::MatrixXd numerical(const Pose& pose, const Function& f) {
  constexpr double h = 1e-6;
  Eigen::MatrixXd out(f(pose).size(), 6);
  for (int k = 0; k < 6; ++k) {
    Vector6d step = Vector6d::Zero();
    step[k] = h;
    out.col(k) = (f(pose * exp(step)) - f(pose * exp(-step))) / (2 * h);
  }
  return out;
}

TEST(Se3, LogInvertsExpAtEveryAngle) {
  std::mt19937_64 random(1);
  for (const double scale : {0.0, 1e-9, 1e-4, 0.02, 0.1, 0.5, 1.0}) {
    for (int k = 0; k < 50; ++k) {
      Vector6d xi = random_vector(random, scale);
      if (xi.head<3>().norm() > 3.1) continue;  // beyond pi the logarithm is another vector
      // Rounding of a rotation matrix near pi costs a few digits.
      EXPECT_LE((log(exp(xi)) - xi).norm(), 1e-11 * (1 + xi.norm())) << xi.transpose();
    }
  }
}

TEST(Se3, AdjointMovesPerturbations) {
  std::mt19937_64 random(2);
  for (int k = 0; k < 20; ++k) {
    const Pose pose = exp(random_vector(random, 0.8));
    const Vector6d xi = random_vector(random, 0.3);
    const Pose left = exp(adjoint(pose) * xi) * pose, right = pose * exp(xi);
    EXPECT_LE(
        (left.rotation - right.rotation).norm() + (left.translation - right.translation).norm(),
        1e-12);
  }
}

TEST(Jacobians, OfAnEdgeEqualCentralDifferences) {
  std::mt19937_64 random(3);
  for (const double error : {0.0, 1e-3, 0.02, 0.04, 0.3, 1.0}) {
    for (int k = 0; k < 20; ++k) {
      const Pose source = exp(random_vector(random, 1)), target = exp(random_vector(random, 1));
      ModeTerm mode;
      mode.target_from_source = target.inverse() * source * exp(random_vector(random, error));
      mode.inverse = mode.target_from_source.inverse();
      if (residual(source, target, mode).head<3>().norm() > 2.8) continue;
      const EdgeLinearisation line = linearise_edge(source, target, mode);
      const Eigen::MatrixXd by_source =
          numerical(source, [&](const Pose& p) { return residual(p, target, mode); });
      const Eigen::MatrixXd by_target =
          numerical(target, [&](const Pose& p) { return residual(source, p, mode); });
      // Central differences with h = 1e-6 are good to about 1e-9 of values of order 1 to 10.
      EXPECT_LE((line.source - by_source).cwiseAbs().maxCoeff(), 1e-7);
      EXPECT_LE((line.target - by_target).cwiseAbs().maxCoeff(), 1e-7);
    }
  }
}

TEST(Jacobians, OfGravityEqualCentralDifferences) {
  std::mt19937_64 random(4);
  for (int k = 0; k < 20; ++k) {
    const GravityTerm term{0, normal3(random).normalized(), 1};
    const Pose pose = exp(random_vector(random, 1));
    const Eigen::MatrixXd differences = numerical(
        pose, [&](const Pose& p) { return Eigen::VectorXd(linearise_gravity(p, term).residual); });
    EXPECT_LE(
        (linearise_gravity(pose, term).rotation - differences.leftCols(3)).cwiseAbs().maxCoeff(),
        1e-8);
    EXPECT_LE(differences.rightCols(3).cwiseAbs().maxCoeff(), 1e-12);
  }
}

}  // namespace
}  // namespace gpureg::pose_graph
