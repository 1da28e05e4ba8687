// SPDX-License-Identifier: BSD-3-Clause
#include "flat/scan_plane.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "math/jacobi.hpp"

namespace gpureg {
namespace {

/// Points of the smallest scan. Scanners give 180 and more; a hundred random points of a wall can
/// look like curves.
constexpr std::size_t kFewestReturns = 120;
/// Distance of a point from the plane, as a share of the largest extent: files round coordinates to
/// millimetres, which a tilted plane turns into as much; the noise of a 3-D sensor is larger.
constexpr double kRoundingOfFiles = 2e-4;
/// The same, as a share of the largest coordinate: the rounding of a few operations in float.
constexpr double kRoundingOfFloats = 4 * 1.2e-7;
/// Points that a plane is fitted to and that the test for curves looks at; those around which that
/// counts.
constexpr std::size_t kPlaneSample = 50'000, kCurvePlaces = 128;
/// This many points show of almost every 3-D cloud that it is not flat.
constexpr std::size_t kFirstLook = 256;
/// Radius of the larger of two discs, in distances of neighbours and as a share of the extent; the
/// other one is a fourth of it. A curve has four times as many points in the larger one, a filled
/// plane sixteen times. It is wider than the noise of ranges, and narrower than a room.
constexpr double kDiscInSpacings = 8, kDiscOfExtent = 1.0 / 32, kLargestDisc = 1.0 / 4;
constexpr double kRatioOfDiscs = 4, kMostPointsOfCurve = 8;

struct Point3 {
  double at[3];
};

double squared_distance(const Point3& a, const Point3& b) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) sum += (a.at[k] - b.at[k]) * (a.at[k] - b.at[k]);
  return sum;
}

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool read_point(const float* row, Point3& out) {
  if (!std::isfinite(row[0]) || !std::isfinite(row[1]) || !std::isfinite(row[2])) return false;
  out = {{row[0], row[1], row[2]}};
  return true;
}

/// Finite points, evenly chosen if there are more.
std::vector<Point3> sample_of(const float* points, std::size_t size, std::size_t stride,
                              std::size_t most) {
  std::vector<Point3> out;
  const std::size_t step = size / most + 1;
  Point3 p;
  for (std::size_t i = 0; i < size; i += step)
    if (read_point(points + i * stride, p)) out.push_back(p);
  return out;
}

/// Extent of the points along an axis.
struct Extent {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  double size() const { return high - low; }
};

struct PlaneBox {
  Extent sides[3];
  double extent = 0, largest = 0;  ///< longest side; largest coordinate
  explicit PlaneBox(const std::vector<Point3>& points) {
    for (const Point3& p : points)
      for (int k = 0; k < 3; ++k) {
        sides[k].low = std::min(sides[k].low, p.at[k]);
        sides[k].high = std::max(sides[k].high, p.at[k]);
      }
    for (const Extent& side : sides) {
      extent = std::max(extent, side.size());
      largest = std::max({largest, std::abs(side.low), std::abs(side.high)});
    }
  }
  double slack() const { return kRoundingOfFiles * extent + kRoundingOfFloats * largest; }
};

/// A scan that is parallel to two axes, the usual one, has exactly the third one as its normal.
std::optional<ScanPlane> plane_of_axis(const Extent (&box)[3], double slack) {
  int axis = 2;
  for (const int other : {1, 0})
    if (box[other].size() < box[axis].size()) axis = other;
  if (box[axis].size() > 2 * slack) return std::nullopt;
  ScanPlane plane;
  plane.normal[axis] = 1;
  plane.offset = 0.5 * (box[axis].low + box[axis].high);
  return plane;
}

/// The plane of least squares; nothing for a line, which lies in many planes.
std::optional<ScanPlane> fitted_plane(const std::vector<Point3>& points, double slack) {
  const double inverse = 1.0 / static_cast<double>(points.size());
  double mean[3] = {0, 0, 0}, covariance[3][3] = {}, axes[3][3];
  for (const Point3& p : points)
    for (int k = 0; k < 3; ++k) mean[k] += p.at[k] * inverse;
  for (const Point3& p : points)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        covariance[i][j] += (p.at[i] - mean[i]) * (p.at[j] - mean[j]) * inverse;
  jacobi_eigen<3, 12>(covariance, axes);
  int order[3] = {0, 1, 2};
  std::sort(order, order + 3, [&](int i, int j) { return covariance[i][i] < covariance[j][j]; });
  if (covariance[order[1]][order[1]] <= slack * slack) return std::nullopt;
  ScanPlane plane;
  double norm = 0;
  for (int k = 0; k < 3; ++k) norm += axes[k][order[0]] * axes[k][order[0]];
  for (int k = 0; k < 3; ++k) plane.normal[k] = axes[k][order[0]] / std::sqrt(norm);
  // Upwards; of a vertical plane the first axis that it is not parallel to.
  constexpr double kParallel = 1e-4;
  const int up = std::abs(plane.normal[2]) > kParallel   ? 2
                 : std::abs(plane.normal[1]) > kParallel ? 1
                                                         : 0;
  if (plane.normal[up] < 0)
    for (double& component : plane.normal) component = -component;
  for (int k = 0; k < 3; ++k) plane.offset += plane.normal[k] * mean[k];
  return plane;
}

double height_over(const ScanPlane& plane, const Point3& p) {
  double height = -plane.offset;
  for (int k = 0; k < 3; ++k) height += plane.normal[k] * p.at[k];
  return std::abs(height);
}

bool may_be_flat(const std::vector<Point3>& few) {
  if (few.size() < 4) return true;
  // Least squares: no residual is above the root of their sum of squares, which is least.
  const double slack = std::sqrt(static_cast<double>(few.size())) * PlaneBox(few).slack();
  const std::optional<ScanPlane> plane = fitted_plane(few, 0);
  return !plane || std::all_of(few.begin(), few.end(),
                               [&](const Point3& p) { return height_over(*plane, p) <= slack; });
}

/// Whether points in a plane form curves, by the number of them in discs of two sizes.
bool are_curves(const std::vector<Point3>& points, double extent) {
  const std::size_t places = std::min(kCurvePlaces, points.size());
  const auto place = [&](std::size_t s) { return points[s * points.size() / places]; };
  std::vector<double> spacings;
  for (std::size_t s = 0; s < places; ++s) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Point3& p : points)
      if (const double d = squared_distance(p, place(s)); d > 0) nearest = std::min(nearest, d);
    if (std::isfinite(nearest)) spacings.push_back(std::sqrt(nearest));
  }
  if (spacings.empty()) return false;
  const double wide =
                   std::min(std::max(kDiscInSpacings * median_of(spacings), kDiscOfExtent * extent),
                            kLargestDisc * extent),
               narrow = wide / kRatioOfDiscs;
  std::vector<double> ratios;
  for (std::size_t s = 0; s < places; ++s) {
    double in_wide = 0, in_narrow = 0;
    for (const Point3& p : points) {
      const double d = squared_distance(p, place(s));
      in_wide += d <= wide * wide;
      in_narrow += d <= narrow * narrow;
    }
    ratios.push_back(in_wide / in_narrow);  // the place itself is in both
  }
  return median_of(ratios) <= kMostPointsOfCurve;
}

}  // namespace

std::optional<ScanPlane> find_scan_plane(const float* points, std::size_t size,
                                         std::size_t stride) {
  if (!may_be_flat(sample_of(points, size, stride, kFirstLook))) return std::nullopt;
  const std::vector<Point3> sample = sample_of(points, size, stride, kPlaneSample);
  if (sample.size() < kFewestReturns) return std::nullopt;
  const PlaneBox box(sample);
  if (box.extent <= 0) return std::nullopt;
  const double slack = box.slack();
  const std::optional<ScanPlane> fitted = fitted_plane(sample, slack);
  if (!fitted) return std::nullopt;
  std::optional<ScanPlane> plane = plane_of_axis(box.sides, slack);
  if (!plane) plane = fitted;
  const auto in_plane = [&](const Point3& p) { return height_over(*plane, p) <= slack; };
  if (!std::all_of(sample.begin(), sample.end(), in_plane)) return std::nullopt;
  Point3 p;
  for (std::size_t i = 0; i < size; ++i)
    if (read_point(points + i * stride, p) && !in_plane(p)) return std::nullopt;
  if (!are_curves(sample, box.extent)) return std::nullopt;
  return plane;
}

}  // namespace gpureg
