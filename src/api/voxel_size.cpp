// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/voxel_size.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "math/jacobi.hpp"

namespace gpureg {
namespace {

constexpr std::size_t kClouds = 16;
constexpr std::size_t kWantedPoints = 5000, kMinPoints = 3000;
/// Points that all samples together hold: voxels of 5000 points are full enough for an estimate.
constexpr std::size_t kVoxelSample = 400'000, kMinVoxelSample = 50'000;
constexpr std::size_t kSpacingSample = 1000,
                      kNoiseSample =
                          200;           // medians of samples this large are within a few per cent
constexpr double kSizeTolerance = 1.02;  // of the bisection, below the rounding of the result
constexpr double kNoiseRadius = 1.5;     // radius of the fitted plane, in voxels
constexpr std::size_t kMinPlanePoints = 8;  // a plane fits fewer points however rough they are
constexpr double kMaxNoise = 1.0 / 3.0;     // of a voxel: its centroid averages out less

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The finite points of a cloud, sorted along its longest side: neighbours within d are within d
/// along the order.
class SortedCloud {
 public:
  explicit SortedCloud(const PointCloudView& view) {
    for (std::size_t k = 0; k < view.size; ++k) {
      const Eigen::Vector3f p =
          Eigen::Map<const Eigen::Vector3f>(view.points + k * view.point_stride);
      if (!p.allFinite()) continue;
      points_.push_back(p);
      box_.extend(p.cast<double>());
    }
    if (points_.empty()) return;
    box_.sizes().maxCoeff(&axis_);
    // A total order: the order of equal coordinates must not depend on the sort of the library.
    std::sort(points_.begin(), points_.end(),
              [a = axis_](const Eigen::Vector3f& p, const Eigen::Vector3f& q) {
                if (p[a] != q[a]) return p[a] < q[a];
                return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
              });
  }

  std::size_t size() const { return points_.size(); }
  double extent() const { return points_.empty() ? 0 : box_.sizes().maxCoeff(); }

  double spacing() const {
    std::vector<double> distances;
    for_sample(kSpacingSample, [&](std::size_t at) {
      double nearest = std::numeric_limits<double>::infinity();  // squared
      const auto visit = [&](std::size_t k) {
        const Eigen::Vector3d d = (points_[k] - points_[at]).cast<double>();
        if (d[axis_] * d[axis_] >= nearest) return false;
        const double squared = d.squaredNorm();
        if (squared > 0) nearest = std::min(nearest, squared);
        return true;
      };
      around(at, visit);
      if (std::isfinite(nearest)) distances.push_back(std::sqrt(nearest));
    });
    return median(std::move(distances));
  }

  /// Median over a sample of points of the RMS distance between their neighbourhood and its plane.
  double noise(double radius) const {
    std::vector<double> distances;
    for_sample(kNoiseSample, [&](std::size_t at) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      Eigen::Matrix3d outer = Eigen::Matrix3d::Zero();
      std::size_t count = 0;
      const auto visit = [&](std::size_t k) {
        const Eigen::Vector3d d = (points_[k] - points_[at]).cast<double>();
        if (std::abs(d[axis_]) > radius) return false;
        if (d.squaredNorm() <= radius * radius) {
          sum += d;
          outer += d * d.transpose();
          ++count;
        }
        return true;
      };
      around(at, visit);
      visit(at);
      if (count < kMinPlanePoints) return;
      const Eigen::Vector3d mean = sum / static_cast<double>(count);
      const Eigen::Matrix3d covariance =
          outer / static_cast<double>(count) - mean * mean.transpose();
      double values[3][3], vectors[3][3];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) values[i][j] = covariance(i, j);
      jacobi_eigen<3, 8>(values, vectors);
      const double smallest = std::min({values[0][0], values[1][1], values[2][2]});
      distances.push_back(std::sqrt(std::max(0.0, smallest)));
    });
    return median(std::move(distances));
  }

  /// Number of voxels of prepare() with a point of the sample. most: of points in the sample.
  std::size_t occupied(double size, std::size_t most, std::vector<std::uint64_t>& keys) const {
    keys.clear();
    const Eigen::Array3d first = (box_.min().array() / size).floor();
    const std::size_t step = points_.size() / most + 1;
    for (std::size_t k = 0; k < points_.size(); k += step) {
      const Eigen::Array3d cell = (points_[k].cast<double>().array() / size).floor() - first;
      keys.push_back(static_cast<std::uint64_t>(cell.x()) << 42 |
                     static_cast<std::uint64_t>(cell.y()) << 21 |
                     static_cast<std::uint64_t>(cell.z()));
    }
    std::sort(keys.begin(), keys.end());
    return static_cast<std::size_t>(std::unique(keys.begin(), keys.end()) - keys.begin());
  }

 private:
  template <typename Visit>
  void for_sample(std::size_t most, Visit&& visit) const {
    const std::size_t count = std::min(most, points_.size());
    for (std::size_t s = 0; s < count; ++s) visit(s * points_.size() / count);
  }
  /// Visits points on both sides in the order, each way until visit returns false.
  template <typename Visit>
  void around(std::size_t at, Visit&& visit) const {
    for (std::size_t k = at + 1; k < points_.size() && visit(k); ++k) {
    }
    for (std::size_t k = at; k-- > 0 && visit(k);) {
    }
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
double rounded(double value) {
  const double unit = power_of_ten_below(value);
  const double digits = value / unit;
  return unit * (digits < 2 ? std::round(digits * 10) / 10 : std::round(digits * 2) / 2);
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
  const std::size_t chosen = std::min(views.size(), kClouds);
  for (std::size_t k = 0; k < chosen; ++k) {
    SortedCloud cloud(views[k * views.size() / chosen]);
    if (cloud.size() < 4) continue;
    out.reason = VoxelSizeReason::one_place;
    if (cloud.extent() > 0) clouds.push_back(std::move(cloud));
  }
  if (clouds.empty()) return out;

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
  double size = std::max(size_for(kWantedPoints), out.spacing);
  const auto noise_at = [&](double s) {
    return median_of(clouds,
                     [&](const SortedCloud& cloud) { return cloud.noise(kNoiseRadius * s); });
  };
  out.noise = noise_at(size);
  if (out.noise > kMaxNoise * size && points(size) > kMinPoints)
    size = std::min(out.noise / kMaxNoise, size_for(kMinPoints));
  size = rounded(size);
  out.voxel_size = static_cast<float>(size);
  out.points = static_cast<std::size_t>(points(size));
  out.reason = VoxelSizeReason::none;
  return out;
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
