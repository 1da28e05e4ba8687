// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/voxel_size.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "flat/extruded.hpp"
#include "flat/scan_plane.hpp"
#include "math/jacobi.hpp"
#include "spacing/sorted_rows.hpp"
#include "spacing/voxel_keys.hpp"

namespace gpureg {
namespace {

constexpr std::size_t kClouds = 16;
constexpr std::size_t kWantedPoints = 5000, kMinPoints = 3000;
/// Points that all samples together hold: voxels of 5000 points are full enough for an estimate.
constexpr std::size_t kVoxelSample = 400'000, kMinVoxelSample = 50'000;
constexpr std::size_t kSpacingSample = 1000,
                      kNoiseSample =
                          200;  // medians of samples this large are within a few per cent
/// Places that are looked at around one for the nearest, each way: all of them may be at the same
/// coordinate of the longest side.
constexpr std::size_t kMostVisits = 1'000'000;
/// Points of a neighbourhood along the longest side; of more, every second, third, ... one.
constexpr std::size_t kMostNeighbors = 100'000;
constexpr double kSizeTolerance = 1.02;     // of the bisection, below the rounding of the result
constexpr double kNoiseRadius = 1.5;        // radius of the fitted plane, in voxels
constexpr std::size_t kMinPlanePoints = 8;  // a plane fits fewer points however rough they are
constexpr double kMaxNoise = 1.0 / 3.0;     // of a voxel: its centroid averages out less
// Neighbourhoods of the normals, in voxels. They have an area if the second axis is not far shorter
// than the first, in squared lengths: those of a LiDAR with few rings lie on one ring.
constexpr double kNormalRadius = 2, kLeastWidth = 0.2, kShareWithArea = 0.6;
constexpr std::size_t kMinAreaPoints = 4, kAreaSample = 400;
// Voxels along the curves of a 2-D scan. Its points are denser near the scanner, and half of them
// are farther apart than in the median.
constexpr std::size_t kWantedOfCurve = 300, kMinOfCurve = 150;
constexpr double kSpacingsOfCurve = 2;
constexpr double kGrowth = 1.1;
constexpr std::size_t kFewestPoints = 1000;
/// With what the voxels of prepare() lie differently, and rounding.
constexpr std::size_t kFewestOfEach = 1100;
/// Of the smaller one of two clouds, where the other one keeps so many times more: in voxels of
/// metres, a sweep fits a model or map of a street in many places.
constexpr std::size_t kFewestOfSmaller = 3300;
constexpr double kLarger = 3;
/// Points of the median cloud up to which a smaller one may drive the size, for its own sake.
constexpr std::size_t kMostOfPair = 100'000, kMostOfSet = 20'000;
// Neighbourhoods of the features, in voxels, and their points (harmonic mean, so that each has the
// weight of its area): rooms, halls and objects have 40 or more, scans of spinning LiDAR 20 to 30,
// thinned ones 10 to 15. Where they have less than kFullNeighborhood, fewer points in larger voxels
// register better.
constexpr double kFeatureRadius = 5, kFullNeighborhood = 30;

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Ascending eigenvalues of a symmetric matrix.
Eigen::Vector3d eigenvalues(const Eigen::Matrix3d& matrix) {
  double values[3][3], vectors[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) values[i][j] = matrix(i, j);
  jacobi_eigen<3, 8>(values, vectors);
  Eigen::Vector3d out(values[0][0], values[1][1], values[2][2]);
  std::sort(out.data(), out.data() + 3);
  return out;
}

/// The finite points of a cloud, sorted along its longest side: neighbours within d are within d
/// along the order.
class SortedCloud {
 public:
  explicit SortedCloud(const PointCloudView& view) {
    points_.reserve(view.size);
    for (std::size_t k = 0; k < view.size; ++k) {
      const Eigen::Vector3f p =
          Eigen::Map<const Eigen::Vector3f>(view.points + k * view.point_stride);
      if (p.allFinite()) points_.push_back(p);
    }
    sort();
  }
  explicit SortedCloud(std::vector<Eigen::Vector3f> points) : points_(std::move(points)) { sort(); }

  std::size_t size() const { return points_.size(); }
  double extent() const { return points_.empty() ? 0 : box_.sizes().maxCoeff(); }

  double spacing() const {
    const std::vector<std::size_t> places = distinct_rows(points_);
    std::vector<double> distances;
    for_sample(kSpacingSample, [&](std::size_t row) {
      const auto place = std::upper_bound(places.begin(), places.end(), row) - 1;
      double nearest = std::numeric_limits<double>::infinity();  // squared
      const auto visit = [&](std::size_t k) {
        const Eigen::Vector3d d = (points_[k] - points_[row]).cast<double>();
        if (d[axis_] * d[axis_] >= nearest) return false;
        nearest = std::min(nearest, d.squaredNorm());
        return true;
      };
      const auto after = places.end() - place, before = place - places.begin();
      constexpr auto most = static_cast<std::ptrdiff_t>(kMostVisits);
      for (auto k = place + 1; k < place + std::min(after, most) && visit(*k); ++k) {
      }
      for (auto k = place; k > place - std::min(before, most) && visit(*(k - 1)); --k) {
      }
      if (std::isfinite(nearest)) distances.push_back(std::sqrt(nearest));
    });
    return median(std::move(distances));
  }

  /// Median over a sample of points of the RMS distance between their neighbourhood and its plane,
  /// of a flat cloud its line.
  double noise(double radius, bool flat) const {
    std::vector<double> distances;
    for_sample(kNoiseSample, [&](std::size_t at) {
      Eigen::Matrix3d covariance;
      if (neighborhood(at, radius, covariance) < kMinPlanePoints) return;
      distances.push_back(std::sqrt(std::max(0.0, eigenvalues(covariance)[flat ? 1 : 0])));
    });
    return median(std::move(distances));
  }

  /// Share of a sample of points whose neighbourhood has an area.
  double share_with_area(double radius) const {
    std::size_t with = 0;
    for_sample(kAreaSample, [&](std::size_t at) {
      Eigen::Matrix3d covariance;
      if (neighborhood(at, radius, covariance) < kMinAreaPoints) return;
      const Eigen::Vector3d values = eigenvalues(covariance);
      with += values[1] > kLeastWidth * values[2];
    });
    return static_cast<double>(with) /
           static_cast<double>(std::max<std::size_t>(1, std::min(kAreaSample, points_.size())));
  }

  /// Harmonic mean over a sample of points of the number of points in their neighbourhood.
  double points_around(double radius) const {
    double sum = 0;
    std::size_t count = 0;
    for_sample(kAreaSample, [&](std::size_t at) {
      Eigen::Matrix3d covariance;
      sum += 1.0 / static_cast<double>(neighborhood(at, radius, covariance));
      ++count;
    });
    return sum > 0 ? static_cast<double>(count) / sum : 0;
  }

  /// The centroids of the voxels.
  SortedCloud downsampled(double size) const {
    struct Voxel {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      std::size_t count = 0;
    };
    const VoxelKeys key_of(box_.min(), size);
    std::unordered_map<std::uint64_t, std::size_t> number_of;
    std::vector<Voxel> voxels;
    std::uint64_t last = 0;
    std::size_t at = 0;  // of the voxel with this key
    for (const Eigen::Vector3f& p : points_) {
      const std::uint64_t key = key_of(p);
      if (voxels.empty() || key != last) {
        at = number_of.emplace(key, voxels.size()).first->second;
        if (at == voxels.size()) voxels.emplace_back();
        last = key;
      }
      voxels[at].sum += p.cast<double>();
      ++voxels[at].count;
    }
    std::vector<Eigen::Vector3f> out;
    for (const Voxel& voxel : voxels)
      out.push_back((voxel.sum / static_cast<double>(voxel.count)).cast<float>());
    return SortedCloud(std::move(out));
  }

  /// Number of voxels of prepare() with a point of the sample. most: of points in the sample.
  std::size_t occupied(double size, std::size_t most, std::vector<std::uint64_t>& keys) const {
    keys.clear();
    const std::size_t step = points_.size() / most + 1;
    const VoxelKeys key_of(box_.min(), size);
    for (std::size_t k = 0; k < points_.size(); k += step) keys.push_back(key_of(points_[k]));
    std::sort(keys.begin(), keys.end());
    return static_cast<std::size_t>(std::unique(keys.begin(), keys.end()) - keys.begin());
  }

 private:
  void sort() {
    for (const Eigen::Vector3f& p : points_) box_.extend(p.cast<double>());
    if (points_.empty()) return;
    box_.sizes().maxCoeff(&axis_);
    sort_rows(points_, axis_);
  }
  /// Covariance of the points within the radius of a point, and their number.
  std::size_t neighborhood(std::size_t at, double radius, Eigen::Matrix3d& covariance) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d outer = Eigen::Matrix3d::Zero();
    std::size_t count = 0;
    const auto visit = [&](std::size_t k) {
      const Eigen::Vector3d d = (points_[k] - points_[at]).cast<double>();
      if (d.squaredNorm() > radius * radius) return;
      sum += d;
      outer += d * d.transpose();
      ++count;
    };
    const auto row = points_.begin() + static_cast<std::ptrdiff_t>(at);
    const auto is_far = [&](const Eigen::Vector3f& p) {
      return std::abs(static_cast<double>(p[axis_] - (*row)[axis_])) > radius;
    };
    const auto is_near = [&](const Eigen::Vector3f& p) { return !is_far(p); };
    const auto first = std::partition_point(points_.begin(), row, is_far),
               last = std::partition_point(row, points_.end(), is_near);
    const std::size_t step = static_cast<std::size_t>(last - first) / kMostNeighbors + 1,
                      before = static_cast<std::size_t>(row - first),
                      after = static_cast<std::size_t>(last - row);
    for (std::size_t k = step; k < after; k += step) visit(at + k);
    for (std::size_t k = step; k <= before; k += step) visit(at - k);
    visit(at);
    const Eigen::Vector3d mean = sum / static_cast<double>(count);
    covariance = outer / static_cast<double>(count) - mean * mean.transpose();
    return count * step;
  }
  template <typename Visit>
  void for_sample(std::size_t most, Visit&& visit) const {
    const std::size_t count = std::min(most, points_.size());
    for (std::size_t s = 0; s < count; ++s) visit(s * points_.size() / count);
  }

  std::vector<Eigen::Vector3f> points_;
  Eigen::AlignedBox3d box_;
  Eigen::Index axis_ = 0;
};

/// Largest power of ten up to a positive finite value. Powers up to 10^22 are exact, so negative
/// ones round once.
double power_of_ten_below(double value) {
  double power = 1;
  if (value >= 1) {
    while (power * 10 <= value) power *= 10;
    return power;
  }
  while (1 / power > value) power *= 10;
  return 1 / power;
}

/// Rounds to a readable number: 0.0473 becomes 0.05, 0.0134 becomes 0.013.
template <typename Round>
double readable(double value, Round&& round) {
  const double unit = power_of_ten_below(value);
  const double digits = value / unit;
  return unit * (digits < 2 ? round(digits * 10) / 10 : round(digits * 2) / 2);
}
double rounded(double value) {
  return readable(value, [](double digits) { return std::round(digits); });
}
double rounded_down(double value) {
  return readable(value, [](double digits) { return std::floor(digits); });
}

template <typename Measure>
double median_of(const std::vector<SortedCloud>& clouds, Measure&& measure) {
  std::vector<double> values;
  for (const SortedCloud& cloud : clouds) values.push_back(measure(cloud));
  return median(std::move(values));
}

}  // namespace

VoxelSizeSuggestion suggest_voxel_size(const std::vector<PointCloudView>& views) {
  for (const PointCloudView& view : views) view.validate();
  VoxelSizeSuggestion out;
  if (views.empty()) return out;
  out.reason = VoxelSizeReason::too_few_points;
  std::vector<SortedCloud> clouds;
  std::size_t flat = 0;
  const std::size_t chosen = std::min(views.size(), kClouds);
  for (std::size_t k = 0; k < chosen; ++k) {
    SortedCloud cloud(views[k * views.size() / chosen]);
    if (cloud.size() < 4) continue;
    out.reason = VoxelSizeReason::one_place;
    if (cloud.extent() <= 0) continue;
    clouds.push_back(std::move(cloud));
    const PointCloudView& view = views[k * views.size() / chosen];
    flat += find_scan_plane(view.points, view.size, view.point_stride).has_value();
  }
  if (clouds.empty()) return out;
  out.flat = 2 * flat > clouds.size();
  const std::size_t wanted_points = out.flat ? kWantedOfCurve : kWantedPoints,
                    min_points = out.flat ? kMinOfCurve : kMinPoints;

  const std::size_t sample = std::max(kVoxelSample / clouds.size(), kMinVoxelSample);
  std::vector<std::uint64_t> keys;
  const auto points = [&](double size) {
    return median_of(clouds, [&](const SortedCloud& cloud) {
      return static_cast<double>(cloud.occupied(size, sample, keys));
    });
  };
  double extent = 0;
  for (const SortedCloud& cloud : clouds) extent = std::max(extent, cloud.extent());
  out.spacing = median_of(clouds, [](const SortedCloud& cloud) { return cloud.spacing(); });
  const auto size_for = [&](std::size_t wanted) {
    double low = std::max(extent * 1e-5, out.spacing * 0.5), high = extent;
    while (high > kSizeTolerance * low) {
      const double middle = std::sqrt(low * high);
      (points(middle) > static_cast<double>(wanted) ? low : high) = middle;
    }
    return high;
  };
  double size = std::max(size_for(wanted_points), (out.flat ? kSpacingsOfCurve : 1) * out.spacing);
  const auto noise_at = [&](double s) {
    return median_of(
        clouds, [&](const SortedCloud& cloud) { return cloud.noise(kNoiseRadius * s, out.flat); });
  };
  out.noise = noise_at(size);
  if (out.noise > kMaxNoise * size && points(size) > static_cast<double>(min_points))
    size = std::min(out.noise / kMaxNoise, size_for(min_points));
  const auto finish = [&] {
    size = rounded(size);
    out.voxel_size = static_cast<float>(size);
    out.points = static_cast<std::size_t>(points(size)) * (out.flat ? Extruded::kLayers : 1);
    out.reason = VoxelSizeReason::none;
    return out;
  };
  if (out.flat) return finish();
  const auto points_around = [&](double s) {
    return median_of(clouds, [&](const SortedCloud& cloud) {
      return cloud.downsampled(s).points_around(kFeatureRadius * s);
    });
  };
  if (const double full = points_around(size) / kFullNeighborhood; full < 1)
    size = std::max(
        size, size_for(std::max(kFewestPoints, static_cast<std::size_t>(full * kWantedPoints))));
  const auto share_with_area = [&](double s) {
    return median_of(clouds, [&](const SortedCloud& cloud) {
      return cloud.downsampled(s).share_with_area(kNormalRadius * s);
    });
  };
  while (points(size * kGrowth) >= kFewestPoints && share_with_area(size) < kShareWithArea)
    size *= kGrowth;
  size = rounded(size);
  const std::size_t most = views.size() > 2 ? kMostOfSet : kMostOfPair;
  const auto smaller = [&] {
    std::size_t least = std::numeric_limits<std::size_t>::max();
    for (const SortedCloud& cloud : clouds)
      least = std::min(least, cloud.occupied(size, sample, keys));
    return static_cast<double>(least);
  };
  const std::size_t fewest =
      views.size() == 2 && points(size) > kLarger * smaller() ? kFewestOfSmaller : kFewestOfEach;
  const auto keeps_enough = [&](const SortedCloud& cloud, double s) {
    return cloud.occupied(s, sample, keys) >=
           std::min(fewest, std::max(kFewestOfEach, cloud.size() / 2));
  };
  double least = 0;  // found where a cloud needs it
  for (const SortedCloud& cloud : clouds) {
    if (cloud.size() < kFewestOfEach || keeps_enough(cloud, size)) continue;
    if (least == 0) least = std::max(size_for(most), out.spacing);
    if (least >= size) break;
    double low = least, high = size;
    while (keeps_enough(cloud, low) && high > kSizeTolerance * low) {
      const double middle = std::sqrt(low * high);
      (keeps_enough(cloud, middle) ? low : high) = middle;
    }
    size = std::min(size, std::max(rounded_down(low), rounded(out.spacing)));
  }
  return finish();
}

const char* to_string(VoxelSizeReason reason) {
  switch (reason) {
    case VoxelSizeReason::none:
      return "none";
    case VoxelSizeReason::no_clouds:
      return "no_clouds";
    case VoxelSizeReason::too_few_points:
      return "too_few_points";
    case VoxelSizeReason::one_place:
      return "one_place";
  }
  return "unknown";
}

const char* explain(VoxelSizeReason reason) {
  switch (reason) {
    case VoxelSizeReason::none:
      return "a voxel size was found";
    case VoxelSizeReason::no_clouds:
      return "there is no cloud to choose a voxel size by";
    case VoxelSizeReason::too_few_points:
      return "a voxel size needs a cloud of 4 or more points with finite coordinates";
    case VoxelSizeReason::one_place:
      return "all points are at one place";
  }
  return "unknown";
}

}  // namespace gpureg
