// SPDX-License-Identifier: BSD-3-Clause
#include "pictures/view.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "run/spacing.hpp"

namespace gpureg::cli {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

// Rows: right, down and forward of a camera with the given viewing direction.
Eigen::Matrix3d look(const Eigen::Vector3d& forward, const Eigen::Vector3d& up) {
  const Eigen::Vector3d ahead = forward.normalized();
  const Eigen::Vector3d right = ahead.cross(up).normalized();
  Eigen::Matrix3d rows;
  rows << right.transpose(), ahead.cross(right).transpose(), ahead.transpose();
  return rows;
}

bool in_camera_frame(const std::vector<Eigen::Vector3f>& points) {
  std::size_t ahead = 0;
  for (const Eigen::Vector3f& p : points) ahead += p.z() > 0;
  return static_cast<double>(ahead) > 0.95 * static_cast<double>(points.size());
}

// Horizontal direction of the smallest variance. A view along it shows the longest side.
Eigen::Vector3d shortest_horizontal_axis(const std::vector<Eigen::Vector3f>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3f& p : points) mean += p.head<2>().cast<double>();
  mean /= static_cast<double>(points.size());
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector3f& p : points) {
    const Eigen::Vector2d d = p.head<2>().cast<double>() - mean;
    covariance += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(covariance);
  const Eigen::Vector2d direction = axes.eigenvectors().col(0);
  return {direction.x(), direction.y(), 0};
}

}  // namespace

Eigen::Matrix3d choose_view(const PointCloud& cloud) {
  const std::vector<Eigen::Vector3f> points = finite_points(cloud.points);
  if (!points.empty() && in_camera_frame(points)) {
    // From above and from the left, so that walls, floor and objects do not hide each other.
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(20 * kDegree, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(-28 * kDegree, Eigen::Vector3d::UnitX()))
                                     .toRotationMatrix();
    return look(turn * Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitY());
  }
  const Eigen::Vector3d side =
      points.empty() ? Eigen::Vector3d(1, 0, 0) : shortest_horizontal_axis(points);
  const Eigen::Vector3d forward =
      std::cos(45 * kDegree) * (Eigen::AngleAxisd(25 * kDegree, Eigen::Vector3d::UnitZ()) * side) -
      std::sin(45 * kDegree) * Eigen::Vector3d::UnitZ();
  return look(forward, Eigen::Vector3d::UnitZ());
}

}  // namespace gpureg::cli
