// SPDX-License-Identifier: BSD-3-Clause
#include "api/symmetry.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "algorithm/cell.hpp"

namespace gpureg {
namespace {

/// Points that are moved: a share of so many is good to 1 %.
constexpr std::size_t kSample = 1000;
/// Share of the sample that must lie on the cloud. Noise and edges of the sampling miss a few
/// points of a hundred; a feature of more than a twentieth of the surface breaks the symmetry.
constexpr double kSymmetricShare = 0.95;
/// Below this share before the refinement, the motion is not close to a symmetry.
constexpr double kWorthRefining = 0.15;
constexpr int kIterations = 10;
/// Neighbours are searched within so many distances while the motion is refined.
constexpr float kSearch = 2;
/// Cosine of the largest angle between the normals of a moved point and of the cloud there, 30
/// degrees; and during the refinement, 60 degrees.
constexpr float kSameCosine = 0.866f, kRefineCosine = 0.5f;

Eigen::Vector3d to_eigen(Vec3 v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

Eigen::Isometry3d small_motion(const Eigen::Matrix<double, 6, 1>& x,
                               const Eigen::Vector3d& centre) {
  // A unit quaternion of the half angles: no trigonometric functions, whose bits depend on libm.
  const Eigen::Quaterniond q =
      Eigen::Quaterniond(1, 0.5 * x[0], 0.5 * x[1], 0.5 * x[2]).normalized();
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = q.toRotationMatrix();
  motion.translation() = centre + x.tail<3>() - motion.linear() * centre;
  return motion;
}

}  // namespace

CloudSymmetry::CloudSymmetry(std::vector<Vec3> points, std::vector<Vec3> normals, float distance)
    : points_(std::move(points)), normals_(std::move(normals)), distance_(distance) {
  const std::size_t count = points_.size();
  for (const Vec3 p : points_) middle_ += to_eigen(p);
  middle_ /= static_cast<double>(std::max<std::size_t>(count, 1));
  for (const Vec3 p : points_) {
    const Eigen::Vector3d d = to_eigen(p) - middle_;
    spread_ += d * d.transpose();
  }
  spread_ /= static_cast<double>(std::max<std::size_t>(count, 1));
  const std::size_t taken = std::min(count, kSample);
  for (std::size_t k = 0; k < taken; ++k) {
    const auto at = static_cast<std::uint32_t>(k * count / taken);
    if (to_eigen(normals_[at]).squaredNorm() > 0) sample_.push_back(at);
  }
}

void CloudSymmetry::build_index() {
  const float inverse = 1.0f / (kSearch * distance_);
  std::vector<std::uint64_t> keys;
  for (const Vec3 p : points_) keys.push_back(cell_key(cell_of(p, inverse)));
  order_.resize(points_.size());
  std::iota(order_.begin(), order_.end(), std::uint32_t(0));
  std::stable_sort(order_.begin(), order_.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  for (std::uint32_t k = 0; k < order_.size(); ++k) {
    const std::uint64_t key = keys[order_[k]];
    if (cells_.empty() || cells_.back().key != key) cells_.push_back({key, k, k});
    cells_.back().end = k + 1;
  }
}

std::size_t CloudSymmetry::nearest(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                   float min_cosine) const {
  const Vec3 p{static_cast<float>(point.x()), static_cast<float>(point.y()),
               static_cast<float>(point.z())};
  const float radius = kSearch * distance_;
  const Cell middle = cell_of(p, 1.0f / radius);
  std::size_t best = points_.size();
  double closest = static_cast<double>(radius) * static_cast<double>(radius);
  for (std::int32_t z = -1; z <= 1; ++z)
    for (std::int32_t y = -1; y <= 1; ++y)
      for (std::int32_t x = -1; x <= 1; ++x) {
        const Cell cell{middle.x + x, middle.y + y, middle.z + z};
        if (!in_key_range(cell)) continue;
        const std::uint64_t key = cell_key(cell);
        const auto found =
            std::lower_bound(cells_.begin(), cells_.end(), key,
                             [](const Bucket& c, std::uint64_t wanted) { return c.key < wanted; });
        if (found == cells_.end() || found->key != key) continue;
        for (std::uint32_t k = found->begin; k < found->end; ++k) {
          const std::uint32_t index = order_[k];
          const double squared = (to_eigen(points_[index]) - point).squaredNorm();
          if (squared >= closest) continue;
          if (normal.dot(to_eigen(normals_[index])) < static_cast<double>(min_cosine)) continue;
          closest = squared;
          best = index;
        }
      }
  return best;
}

double CloudSymmetry::share(const Eigen::Isometry3d& motion) const {
  std::size_t on = 0;
  const double most = static_cast<double>(distance_);
  for (const std::uint32_t k : sample_) {
    const Eigen::Vector3d p = motion * to_eigen(points_[k]);
    const std::size_t n = nearest(p, motion.linear() * to_eigen(normals_[k]), kSameCosine);
    on += n < points_.size() && (to_eigen(points_[n]) - p).norm() <= most;
  }
  return sample_.empty() ? 0 : static_cast<double>(on) / static_cast<double>(sample_.size());
}

bool CloudSymmetry::refine(Eigen::Isometry3d& motion) const {
  for (int k = 0; k < kIterations; ++k) {
    Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
    const Eigen::Vector3d centre = motion * middle_;
    for (const std::uint32_t index : sample_) {
      const Eigen::Vector3d p = motion * to_eigen(points_[index]);
      const std::size_t n = nearest(p, motion.linear() * to_eigen(normals_[index]), kRefineCosine);
      if (n == points_.size()) continue;
      const Eigen::Vector3d normal = to_eigen(normals_[n]);
      Eigen::Matrix<double, 6, 1> row;
      row << (p - centre).cross(normal), normal;
      information += row * row.transpose();
      gradient += row * normal.dot(to_eigen(points_[n]) - p);
    }
    const double count = information.bottomRightCorner<3, 3>().trace();
    if (count < 0.1 * static_cast<double>(sample_.size())) return false;
    // A solid of revolution has directions without information: they are left alone.
    const double radius = std::sqrt(spread_.trace());
    information.topLeftCorner<3, 3>().diagonal().array() += 1e-3 * count * radius * radius;
    information.bottomRightCorner<3, 3>().diagonal().array() += 1e-3 * count;
    const Eigen::Matrix<double, 6, 1> x = information.ldlt().solve(gradient);
    if (!x.allFinite()) return false;
    motion = small_motion(x, centre) * motion;
  }
  return true;
}

double CloudSymmetry::displacement(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) const {
  const Eigen::Matrix3d m = a.linear() - b.linear();
  return std::sqrt(std::max(
      0.0, (m * spread_ * m.transpose()).trace() + (a * middle_ - b * middle_).squaredNorm()));
}

bool CloudSymmetry::has(const Eigen::Isometry3d& motion, double slack) {
  // A symmetry keeps the middle. Few other motions do, so the index is hardly ever built in vain.
  if (points_.empty() || (motion * middle_ - middle_).norm() > slack) return false;
  if (order_.empty()) build_index();
  if (share(motion) < kWorthRefining) return false;
  Eigen::Isometry3d symmetry = motion;
  return refine(symmetry) && displacement(symmetry, motion) <= slack &&
         displacement(symmetry, Eigen::Isometry3d::Identity()) > slack &&
         share(symmetry) >= kSymmetricShare;
}

}  // namespace gpureg
