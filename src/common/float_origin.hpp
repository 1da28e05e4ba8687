// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "gpureg/point_cloud.hpp"

namespace gpureg {

/// Every so manieth row is enough to choose an origin by.
inline std::size_t origin_sample_step(std::size_t rows) {
  constexpr std::size_t kSample = 4096;
  return rows / kSample + 1;
}

/// What to subtract from coordinates before they become float32: zero where float32 divides their
/// spread into 2^17 steps or holds them exactly; else the median, rounded. The spread is of the
/// middle 90 %, so that single far points (returns at 0 0 0 of a scan in map coordinates) change
/// nothing.
/// @param sample of the rows; those that are not finite do not count.
inline Eigen::Vector3d float_origin(std::vector<Eigen::Vector3d> sample) {
  constexpr double kSteps = 1 << 17;
  const auto lost = [](const Eigen::Vector3d& p) { return p != p.cast<float>().cast<double>(); };
  const auto finite = [](const Eigen::Vector3d& p) { return p.cast<float>().allFinite(); };
  sample.erase(std::remove_if(sample.begin(), sample.end(), std::not_fn(finite)), sample.end());
  Eigen::Vector3d median = Eigen::Vector3d::Zero();
  if (std::none_of(sample.begin(), sample.end(), lost)) return median;
  double spread = 0, largest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = [&](std::size_t percent) {
      const auto nth =
          sample.begin() + static_cast<std::ptrdiff_t>((sample.size() - 1) * percent / 100);
      std::nth_element(sample.begin(), nth, sample.end(),
                       [axis](const auto& a, const auto& b) { return a[axis] < b[axis]; });
      return (*nth)[axis];
    };
    const double low = at(5), high = at(95);
    spread = std::max(spread, high - low);
    largest = std::max({largest, std::abs(low), std::abs(high)});
    median[axis] = std::round(at(50));
  }
  const auto value = static_cast<float>(largest);
  const float step = std::nextafter(value, std::numeric_limits<float>::infinity()) - value;
  return static_cast<double>(step) * kSteps > spread ? median : Eigen::Vector3d::Zero().eval();
}

/// Sets points and origin of a cloud.
inline void set_points(PointCloud& cloud, const std::vector<Eigen::Vector3d>& rows) {
  std::vector<Eigen::Vector3d> sample;
  for (std::size_t k = 0; k < rows.size(); k += origin_sample_step(rows.size()))
    sample.push_back(rows[k]);
  cloud.origin = float_origin(std::move(sample));
  cloud.points.reserve(rows.size());
  for (const Eigen::Vector3d& p : rows) cloud.points.push_back((p - cloud.origin).cast<float>());
}

}  // namespace gpureg
