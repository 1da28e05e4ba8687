// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "gpureg/voxel_size.hpp"

namespace gpureg {
namespace {

struct Factor {
  double ratio;
  const char* units;
};
constexpr std::array<Factor, 7> kFactors{{{3.28084, "feet and metres"},
                                          {10, "millimetres and centimetres"},
                                          {25.4, "millimetres and inches"},
                                          {39.3701, "inches and metres"},
                                          {100, "centimetres and metres"},
                                          {304.8, "millimetres and feet"},
                                          {1000, "millimetres and metres"}}};
/// Scans of one place differ in extent by about as much.
constexpr double kUnitTolerance = 1.2;
constexpr std::size_t kUnitSample = 100'000;

/// Longest side of the box around the points, without the outermost hundredth each way: one stray
/// point shall not decide.
double extent_of(const PointCloudView& view) {
  std::array<std::vector<float>, 3> coordinates;
  const std::size_t step = view.size / kUnitSample + 1;
  for (std::size_t k = 0; k < view.size; k += step) {
    const float* p = view.points + k * view.point_stride;
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) coordinates[axis].push_back(p[axis]);
  }
  double extent = 0;
  for (std::vector<float>& values : coordinates) {
    if (values.size() < 2) return 0;
    const std::size_t out = values.size() / 100;
    const auto low = values.begin() + static_cast<std::ptrdiff_t>(out),
               high = values.end() - static_cast<std::ptrdiff_t>(out + 1);
    std::nth_element(values.begin(), low, values.end());
    const double least = static_cast<double>(*low);
    std::nth_element(values.begin(), high, values.end());
    extent = std::max(extent, static_cast<double>(*high) - least);
  }
  return extent;
}

}  // namespace

std::string question_units(const PointCloudView& source, const PointCloudView& target,
                           double least_ratio) {
  source.validate();
  target.validate();
  const double of_source = extent_of(source), of_target = extent_of(target);
  if (!(of_source > 0 && of_target > 0)) return "";
  const double ratio = std::max(of_source / of_target, of_target / of_source);
  if (ratio < least_ratio) return "";
  const auto* const factor = std::find_if(kFactors.begin(), kFactors.end(), [&](const Factor& f) {
    return ratio < kUnitTolerance * f.ratio && f.ratio < kUnitTolerance * ratio;
  });
  const bool usual = factor != kFactors.end();
  if (!usual && ratio < kSuspectRatio) return "";
  char text[200];
  std::snprintf(text, sizeof text, "are the units different? %s is %.*f times larger than %s%s%s",
                of_target > of_source ? "target" : "source", ratio < 10 ? 1 : 0, ratio,
                of_target > of_source ? "source" : "target", usual ? ", as with " : "",
                usual ? factor->units : "");
  return text;
}

}  // namespace gpureg
