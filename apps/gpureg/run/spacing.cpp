// SPDX-License-Identifier: BSD-3-Clause
#include "run/spacing.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <limits>

#include "gpureg/error.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

constexpr std::size_t kSample = 1000;  // the median of so many is good to a few percent

Eigen::AlignedBox3f box_of(const std::vector<Eigen::Vector3f>& points) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : points) box.extend(p);
  return box;
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
  std::sort(sorted.begin(), sorted.end(), [axis](const auto& a, const auto& b) {
    // A total order: the order of equal coordinates must not depend on the sort.
    if (a[axis] != b[axis]) return a[axis] < b[axis];
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  });
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

std::vector<PointCloudView> views_of(const std::vector<PointCloud>& clouds) {
  std::vector<PointCloudView> views;
  for (const PointCloud& cloud : clouds) views.push_back(cloud.view());
  return views;
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

void note_few_points(const std::vector<std::pair<std::string, std::size_t>>& prepared) {
  constexpr std::size_t kFewPoints = 1000;
  const auto less = [](const auto& a, const auto& b) { return a.second < b.second; };
  const auto fewest = std::min_element(prepared.begin(), prepared.end(), less);
  if (fewest == prepared.end() || fewest->second >= kFewPoints) return;
  const auto few = std::count_if(prepared.begin(), prepared.end(),
                                 [](const auto& cloud) { return cloud.second < kFewPoints; });
  std::cerr << "gpureg: note: --voxel-size auto leaves " << fewest->second << " points of "
            << fewest->first
            << (few > 1 ? ", and fewer than 1,000 of " + std::to_string(few - 1) + " more" : "")
            << ": too few for a reliable result, a larger part of the place has more" << std::endl;
}

}  // namespace gpureg::cli
