// SPDX-License-Identifier: BSD-3-Clause
#include "symmetry/symmetry.hpp"

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
constexpr int kPolishSteps = 10;
/// Neighbours are searched within so many distances while the motion is refined.
constexpr float kSearch = 2;
/// Cosine of the largest angle between the normals of a moved point and of the cloud there, 30
/// degrees; and during the refinement, 60 degrees.
constexpr float kSameCosine = 0.866f, kRefineCosine = 0.5f;

Eigen::Vector3d to_eigen(Vec3 v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

/// Lower bounds of the distance from a coordinate to the neighbouring cells along an axis.
class AxisGaps {
 public:
  AxisGaps(float coordinate, float inverse, std::int32_t cell, float edge) {
    const double at = static_cast<double>(coordinate) * static_cast<double>(inverse);
    // Cells are computed in float. The errors of coordinate, inverse, edge and their products are
    // below 1e-7 of the coordinate each; more is subtracted, so that a bound is never too large.
    const double slack = 1e-6 * (std::abs(at) + 2);
    const auto bound = [&](double cells) {
      const double gap = std::max(0.0, cells - slack) * static_cast<double>(edge);
      return gap * gap;
    };
    squared_[0] = bound(at - cell);
    squared_[2] = bound(cell + 1.0 - at);
  }
  /// step: -1, 0 or 1.
  double squared(int step) const { return squared_[step + 1]; }

 private:
  double squared_[3] = {0, 0, 0};
};

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
  std::vector<std::uint32_t> order(points_.size());
  std::iota(order.begin(), order.end(), std::uint32_t(0));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  indexed_.reserve(order.size());
  for (std::uint32_t k = 0; k < order.size(); ++k) {
    const std::uint64_t key = keys[order[k]];
    if (cells_.empty() || cells_.back().key != key) cells_.push_back({key, k, k});
    cells_.back().end = k + 1;
    indexed_.push_back({to_eigen(points_[order[k]]), to_eigen(normals_[order[k]])});
  }
}

std::size_t CloudSymmetry::nearest(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                   float min_cosine) const {
  const Vec3 p{static_cast<float>(point.x()), static_cast<float>(point.y()),
               static_cast<float>(point.z())};
  const float radius = kSearch * distance_, inverse = 1.0f / radius;
  const Cell middle = cell_of(p, inverse);
  std::size_t best = indexed_.size();
  double closest = static_cast<double>(radius) * static_cast<double>(radius);
  const AxisGaps x(p.x, inverse, middle.x, radius), y(p.y, inverse, middle.y, radius),
      z(p.z, inverse, middle.z, radius);
  // The own row first, then those that share an edge with it: they make `closest` small, and the
  // other rows and cells are too far away then. The order does not matter for the result: places
  // ascend with z, y and x, and the lowest place of equals is taken.
  static constexpr int kRows[9][2] = {{0, 0},   {0, -1}, {0, 1},  {-1, 0}, {1, 0},
                                      {-1, -1}, {-1, 1}, {1, -1}, {1, 1}};
  const std::int32_t first_x = std::max(middle.x - 1, -kCellBias),
                     last_x = std::min(middle.x + 1, kCellBias - 1);
  for (const auto& [dz, dy] : kRows) {
    const double row_gap = y.squared(dy) + z.squared(dz);
    if (row_gap >= closest) continue;
    const Cell first{first_x, middle.y + dy, middle.z + dz};
    const Cell last{last_x, first.y, first.z};
    if (!in_key_range(first) || !in_key_range(last)) continue;
    const std::uint64_t last_key = cell_key(last);
    auto cell =
        std::lower_bound(cells_.begin(), cells_.end(), cell_key(first),
                         [](const Bucket& c, std::uint64_t wanted) { return c.key < wanted; });
    for (; cell != cells_.end() && cell->key <= last_key; ++cell) {
      if (row_gap + x.squared(cell_from_key(cell->key).x - middle.x) >= closest) continue;
      for (std::uint32_t k = cell->begin; k < cell->end; ++k) {
        const double squared = (indexed_[k].point - point).squaredNorm();
        // The search radius itself is too far away.
        if (squared > closest || (squared == closest && (k > best || best == indexed_.size())))
          continue;
        if (normal.dot(indexed_[k].normal) < static_cast<double>(min_cosine)) continue;
        closest = squared;
        best = k;
      }
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
    on += n < indexed_.size() && (indexed_[n].point - p).norm() <= most;
  }
  return sample_.empty() ? 0 : static_cast<double>(on) / static_cast<double>(sample_.size());
}

bool CloudSymmetry::refine(Eigen::Isometry3d& motion) const {
  for (int k = 0; k < kPolishSteps; ++k) {
    Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
    const Eigen::Vector3d centre = motion * middle_;
    for (const std::uint32_t index : sample_) {
      const Eigen::Vector3d p = motion * to_eigen(points_[index]);
      const std::size_t n = nearest(p, motion.linear() * to_eigen(normals_[index]), kRefineCosine);
      if (n == indexed_.size()) continue;
      const Eigen::Vector3d& normal = indexed_[n].normal;
      Eigen::Matrix<double, 6, 1> row;
      row << (p - centre).cross(normal), normal;
      information += row * row.transpose();
      gradient += row * normal.dot(indexed_[n].point - p);
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
  if (indexed_.empty()) build_index();
  if (share(motion) < kWorthRefining) return false;
  Eigen::Isometry3d symmetry = motion;
  return refine(symmetry) && displacement(symmetry, motion) <= slack &&
         displacement(symmetry, Eigen::Isometry3d::Identity()) > slack &&
         share(symmetry) >= kSymmetricShare;
}

}  // namespace gpureg
