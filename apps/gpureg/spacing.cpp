// SPDX-License-Identifier: BSD-3-Clause
#include "spacing.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "gpureg/error.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

constexpr std::size_t kSample = 1000;  // the median of so many is good to a few percent
constexpr std::size_t kWantedPoints = 5000;
constexpr std::size_t kVoxelSample =
    400'000;  // voxels of 5000 points are full enough to be found with it

Eigen::AlignedBox3f box_of(const std::vector<Eigen::Vector3f>& points) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : points) box.extend(p);
  return box;
}

std::size_t occupied_voxels(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& low,
                            double size) {
  std::vector<std::uint64_t> keys;
  keys.reserve(points.size());
  for (const Eigen::Vector3f& p : points) {
    const Eigen::Vector3d cell = (p - low).cast<double>() / size;
    keys.push_back(static_cast<std::uint64_t>(cell.x()) << 42 |
                   static_cast<std::uint64_t>(cell.y()) << 21 |
                   static_cast<std::uint64_t>(cell.z()));
  }
  std::sort(keys.begin(), keys.end());
  return static_cast<std::size_t>(std::unique(keys.begin(), keys.end()) - keys.begin());
}

// 0.0473 becomes 0.05, 0.0134 becomes 0.013: what a person would type.
double rounded(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)));
  const double digits = value / unit;
  return unit * (digits < 2 ? std::round(digits * 10) / 10 : std::round(digits * 2) / 2);
}

}  // namespace

std::vector<Eigen::Vector3f> finite_points(const std::vector<Eigen::Vector3f>& points) {
  std::vector<Eigen::Vector3f> finite;
  for (const Eigen::Vector3f& p : points)
    if (p.allFinite()) finite.push_back(p);
  return finite;
}

double median_spacing(const std::vector<Eigen::Vector3f>& points, int rank) {
  if (points.size() < 2) return 0;
  // Sorted along the longest side, a neighbour nearer than d is less than d away in the order, too.
  Eigen::Index axis = 0;
  box_of(points).sizes().maxCoeff(&axis);
  std::vector<Eigen::Vector3f> sorted = points;
  std::sort(sorted.begin(), sorted.end(),
            [axis](const auto& a, const auto& b) { return a[axis] < b[axis]; });
  std::vector<double> distances;
  const std::size_t count = std::min(kSample, sorted.size());
  for (std::size_t s = 0; s < count; ++s) {
    const std::size_t at = s * sorted.size() / count;
    std::vector<double> nearest(static_cast<std::size_t>(rank),
                                std::numeric_limits<double>::infinity());  // squared, ascending
    double& farthest = nearest.back();
    // Returns whether a point beyond this one can still be nearer.
    const auto visit = [&](std::size_t k) {
      const Eigen::Vector3d d = (sorted[k] - sorted[at]).cast<double>();
      if (d[axis] * d[axis] >= farthest) return false;
      const double squared = d.squaredNorm();
      if (squared > 0 && squared < farthest) {
        farthest = squared;
        for (std::size_t n = nearest.size() - 1; n > 0 && nearest[n] < nearest[n - 1]; --n)
          std::swap(nearest[n], nearest[n - 1]);
      }
      return true;
    };
    for (std::size_t k = at + 1; k < sorted.size() && visit(k); ++k) {
    }
    for (std::size_t k = at; k-- > 0 && visit(k);) {
    }
    if (std::isfinite(farthest)) distances.push_back(std::sqrt(farthest));
  }
  if (distances.empty()) return 0;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

double suggested_voxel_size(const std::vector<Eigen::Vector3f>& points, double spacing) {
  const Eigen::AlignedBox3f box = box_of(points);
  const double extent = points.empty() ? 0 : box.sizes().cast<double>().maxCoeff();
  if (!(extent > 0) || !(spacing > 0)) return 0;
  std::vector<Eigen::Vector3f> sample;
  const std::size_t step = points.size() / kVoxelSample + 1;
  for (std::size_t k = 0; k < points.size(); k += step) sample.push_back(points[k]);

  double low = std::max(extent * 1e-5, spacing * 0.5), high = extent;
  for (int round = 0; round < 20 && high > 1.02 * low; ++round) {
    const double middle = std::sqrt(low * high);
    (occupied_voxels(sample, box.min(), middle) > kWantedPoints ? low : high) = middle;
  }
  return rounded(std::max(high, spacing));
}

double extent_of(const std::vector<Eigen::Vector3f>& points) {
  const Eigen::AlignedBox3f box = box_of(finite_points(points));
  return box.isEmpty() ? 0 : box.sizes().cast<double>().maxCoeff();
}

void check_voxel_size(float voxel_size, double extent, const std::string& what) {
  if (extent > 0 && static_cast<double>(voxel_size) > extent)
    throw InvalidArgument("voxel_size is " + significant(static_cast<double>(voxel_size), 6) +
                          ", but " + what + " extends over " + significant(extent, 3) +
                          " only; `gpureg info` suggests a size");
}

}  // namespace gpureg::cli
