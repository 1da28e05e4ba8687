// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/coarse.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include "common/fnv1a.hpp"
#include "math/exponential.hpp"
#include "settings/settings.hpp"

namespace gpureg::loop_closure {
namespace {

/// Voxels of a fragment; pairs are compared voxel by voxel.
constexpr std::size_t kMaxVoxels = 384;
/// Numbers of voxels fit into 64 bits.
constexpr double kMostVoxels = 9e18;

std::vector<Eigen::Vector3f> centroids(const std::vector<Eigen::Vector3f>& points,
                                       const Eigen::Vector3d& origin, double voxel) {
  struct Sum {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0;
  };
  std::map<std::array<std::int64_t, 3>, Sum> cells;
  for (const Eigen::Vector3f& point : points) {
    const Eigen::Vector3d p = point.cast<double>() + origin;
    std::array<std::int64_t, 3> key;
    for (int k = 0; k < 3; ++k)
      key[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(
          std::clamp(std::floor(p[k] / voxel), -kMostVoxels, kMostVoxels));
    Sum& cell = cells[key];
    cell.sum += p;
    ++cell.count;
  }
  std::vector<Eigen::Vector3f> out;
  out.reserve(cells.size());
  for (const auto& [key, cell] : cells) out.push_back((cell.sum / cell.count).cast<float>());
  return out;
}

/// Sum over the voxels of a of how likely b observed them.
double covered(const Coarse& a, const Coarse& b, const pose_graph::Pose& b_from_a, double sigma,
               double reach) {
  const double near = std::max(a.voxel, b.voxel), far = near + reach;
  const Eigen::Matrix3f rotation = b_from_a.rotation.cast<float>();
  const Eigen::Vector3f translation = b_from_a.translation.cast<float>();
  const Eigen::Vector3f centre = b.centre.cast<float>();
  const auto limit = static_cast<float>(b.radius + far);
  const auto near2 = static_cast<float>(near * near);
  double sum = 0;
  for (const Eigen::Vector3f& point : a.points) {
    const Eigen::Vector3f p = rotation * point + translation;
    if ((p - centre).squaredNorm() > limit * limit) continue;
    float least = static_cast<float>(far * far);
    for (const Eigen::Vector3f& q : b.points) {
      least = std::min(least, (p - q).squaredNorm());
      if (least <= near2) break;
    }
    if (least <= near2) {
      sum += 1;
    } else if (sigma > 0 && least < static_cast<float>(far * far)) {
      const double beyond = (std::sqrt(static_cast<double>(least)) - near) / sigma;
      sum += portable::exp(-0.5 * beyond * beyond);
    }
  }
  return sum;
}

/// Of 64-bit words.
struct Hash : Fnv1a {
  using Fnv1a::add;
  void add(double v) {
    std::uint64_t word;
    std::memcpy(&word, &v, sizeof word);
    add(word);
  }
  void add(float v) {
    std::uint32_t word;
    std::memcpy(&word, &v, sizeof word);
    add(static_cast<std::uint64_t>(word));
  }
  void add(const std::vector<Eigen::Vector3f>& rows) {
    add(static_cast<std::uint64_t>(rows.size()));
    for (const Eigen::Vector3f& row : rows)
      for (int k = 0; k < 3; ++k) add(row[k]);
  }
};

}  // namespace

Coarse coarse_of(const PreparedCloud& cloud, double voxel) {
  Coarse out;
  const std::vector<Eigen::Vector3f> points = cloud.points();
  if (points.empty()) return out;
  for (out.voxel = voxel;; out.voxel *= 2) {
    out.points = centroids(points, cloud.origin(), out.voxel);
    if (out.points.size() <= kMaxVoxels) break;
  }
  for (const Eigen::Vector3f& point : out.points) out.centre += point.cast<double>();
  out.centre /= static_cast<double>(out.points.size());
  for (const Eigen::Vector3f& point : out.points)
    out.radius = std::max(out.radius, (point.cast<double>() - out.centre).norm());
  return out;
}

std::uint64_t fingerprint_of(const PreparedCloud& cloud) {
  Hash hash;
  hash.add(cloud.points());
  hash.add(cloud.normals());
  hash.add(cloud.viewpoints());
  for (int k = 0; k < 3; ++k) hash.add(cloud.origin()[k]);
  const PrepareSettings& options = cloud.settings();
  for (const float v : {options.voxel_size, options.normal_radius, options.feature_radius,
                        options.wide_feature_radius, options.max_correspondence_distance,
                        options.surface_side_distance})
    hash.add(v);
  hash.add(static_cast<std::uint64_t>(options.depth_maps));
  hash.add(static_cast<std::uint64_t>(cloud.feature_dimension()));
  return hash.value();
}

double expected_overlap(const Coarse& a, const Coarse& b, const pose_graph::Pose& b_from_a,
                        double sigma, double reach) {
  if (a.points.empty() || b.points.empty()) return 0;
  // Beyond three standard deviations a voxel counts for 1 %.
  const double range = std::min(reach, 3 * sigma);
  const double near = std::max(a.voxel, b.voxel);
  const Eigen::Vector3d centre = b_from_a.rotation * a.centre + b_from_a.translation;
  if ((centre - b.centre).norm() > a.radius + b.radius + near + range) return 0;
  const double forward = covered(a, b, b_from_a, sigma, range) / double(a.points.size());
  const double backward = covered(b, a, b_from_a.inverse(), sigma, range) / double(b.points.size());
  return std::max(forward, backward);
}

}  // namespace gpureg::loop_closure
