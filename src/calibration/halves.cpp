// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/halves.hpp"

#include <algorithm>
#include <cmath>

#include "math/philox.hpp"
#include "math/trigonometry.hpp"

namespace gpureg::calibration {
namespace {

/// Tags of the draws.
enum Draw : std::uint32_t { kOfPair = 0x63616c00u, kOfPoint, kOfNoise };

/// Uniform numbers of one pair, in the order in which they are asked for.
class Numbers {
 public:
  Numbers(std::uint64_t seed, std::uint32_t number) : seed_(seed), number_(number) {}

  double uniform() {
    if (used_ == 4) {
      words_ = philox(count_++, number_, 0, kOfPair, static_cast<std::uint32_t>(seed_),
                      static_cast<std::uint32_t>(seed_ >> 32));
      used_ = 0;
    }
    return (words_.v[used_++] + 0.5) / 4294967296.0;
  }
  double between(double low, double high) { return low + (high - low) * uniform(); }

  /// A point on the unit sphere of n dimensions, by rejection: it needs no trigonometry.
  template <int n>
  Eigen::Matrix<double, n, 1> direction() {
    for (;;) {
      Eigen::Matrix<double, n, 1> out;
      for (int k = 0; k < n; ++k) out[k] = between(-1, 1);
      double squared = 0;
      for (int k = 0; k < n; ++k) squared += out[k] * out[k];
      if (squared > 1e-3 && squared <= 1) return out / std::sqrt(squared);
    }
  }

 private:
  std::uint64_t seed_;
  std::uint32_t number_, count_ = 0;
  int used_ = 4;
  PhiloxWords words_{};
};

Eigen::Isometry3d random_pose(Numbers& numbers, double reach) {
  const Eigen::Vector4d q = numbers.direction<4>();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  pose.translation() = reach * numbers.uniform() * numbers.direction<3>();
  return pose;
}

/// A half-space of points with direction . p >= least.
struct HalfSpace {
  Eigen::Vector3d direction;
  double least;
  bool holds(const Eigen::Vector3d& p) const {
    return direction.x() * p.x() + direction.y() * p.y() + direction.z() * p.z() >= least;
  }
};

/// The half-space along the direction with this share of the points.
HalfSpace holding(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3d& direction,
                  double share) {
  std::vector<double> along;
  for (const Eigen::Vector3f& p : points) {
    const Eigen::Vector3d d = p.cast<double>();
    along.push_back(direction.x() * d.x() + direction.y() * d.y() + direction.z() * d.z());
  }
  std::sort(along.begin(), along.end());
  const auto left_out = static_cast<std::size_t>((1.0 - share) * static_cast<double>(along.size()));
  return {direction, along[std::min(left_out, along.size() - 1)]};
}

/// Errors of a scan: white ones, and a smooth field of the same size that bends surfaces, as
/// calibration, motion and depth fusion do. White noise alone would be averaged out by the voxels.
class Noise {
 public:
  Noise(Numbers& numbers, double deviation, double wavelength)
      : deviation_(deviation),
        key_{static_cast<std::uint32_t>(4294967295.0 * numbers.uniform()),
             static_cast<std::uint32_t>(4294967295.0 * numbers.uniform())} {
    for (Wave& wave : waves_) {
      const double length = wavelength * numbers.between(1, 4);
      wave.number = numbers.direction<3>() * (2 * portable::kPi / length);
      wave.amplitude = numbers.direction<3>() * (deviation * std::sqrt(6.0 / kWaves));
      wave.phase = numbers.between(0, 2 * portable::kPi);
    }
  }

  Eigen::Vector3d at(const Eigen::Vector3d& p, std::uint32_t point) const {
    Eigen::Vector3d out;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      // Sum of twelve uniform numbers: normal enough, and exact everywhere.
      double sum = -6;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const PhiloxWords words = philox(point, 3 * axis + k, 0, kOfNoise, key_[0], key_[1]);
        for (const std::uint32_t word : words.v) sum += (word + 0.5) / 4294967296.0;
      }
      out[axis] = deviation_ * sum;
    }
    for (const Wave& wave : waves_) {
      const double angle =
          wave.number.x() * p.x() + wave.number.y() * p.y() + wave.number.z() * p.z() + wave.phase;
      out += wave.amplitude * portable::cos(angle);
    }
    return out;
  }

 private:
  static constexpr int kWaves = 3;
  struct Wave {
    Eigen::Vector3d number, amplitude;
    double phase;
  };
  Wave waves_[kWaves];
  double deviation_;
  std::uint32_t key_[2];
};

Eigen::Vector3d row(const float* rows, std::size_t stride, std::size_t k) {
  const float* p = rows + k * stride;
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

Eigen::Vector3d turned(const Eigen::Isometry3d& pose, const Eigen::Vector3d& v) {
  Eigen::Vector3d out;
  for (int i = 0; i < 3; ++i) out[i] = pose(i, 0) * v.x() + pose(i, 1) * v.y() + pose(i, 2) * v.z();
  return out;
}

Eigen::Vector3d moved(const Eigen::Isometry3d& pose, const Eigen::Vector3d& p) {
  return turned(pose, p) + pose.translation();
}

}  // namespace

PointCloudView Part::view() const {
  PointCloudView view(points);
  if (!normals.empty()) view.normals = normals.front().data();
  if (!features.empty()) {
    view.features = features.data();
    view.feature_dimension = feature_dimension;
  }
  if (!viewpoints.empty()) {
    view.viewpoints = viewpoints.front().data();
    view.viewpoint_count = viewpoints.size();
  }
  view.infer_viewpoint = infer_viewpoint;
  return view;
}

Halves halves_of(const PointCloudView& scan, const PreparedCloud& prepared, double noise,
                 double wavelength, std::uint64_t seed, std::uint32_t number) {
  Numbers numbers(seed, number);
  const std::vector<Eigen::Vector3f> surface = prepared.points();
  Halves out;
  if (surface.empty()) return out;
  Eigen::Vector3d low = surface.front().cast<double>(), high = low;
  for (const Eigen::Vector3f& p : surface) {
    low = low.cwiseMin(p.cast<double>());
    high = high.cwiseMax(p.cast<double>());
  }
  out.target_from_source = random_pose(numbers, (high - low).maxCoeff());

  // The target holds the upper part along a direction, the source the lower one; both are cut by a
  // plane of their own, too.
  const bool apart = number % kWithoutOverlap == kWithoutOverlap - 1;
  const double overlap = numbers.between(kMinOverlap, kMaxOverlap);
  const double share = apart ? numbers.between(0.35, 0.48) : 1.0 / (2.0 - overlap);
  const Eigen::Vector3d along = numbers.direction<3>();
  HalfSpace of_part[2][2] = {{holding(surface, -along, share), {}},
                             {holding(surface, along, share), {}}};
  for (HalfSpace(&planes)[2] : of_part) {
    const Eigen::Vector3d across = numbers.direction<3>();
    planes[1] = holding(surface, across, 1.0 - numbers.between(0, 0.15));
  }
  const Noise noise_of[2] = {Noise(numbers, noise, wavelength), Noise(numbers, noise, wavelength)};
  const auto key_low = static_cast<std::uint32_t>(seed),
             key_high = static_cast<std::uint32_t>(seed >> 32);
  Part* parts[2] = {&out.source, &out.target};
  for (std::size_t k = 0; k < scan.size; ++k) {
    const Eigen::Vector3d p = row(scan.points, scan.point_stride, k);
    if (!p.allFinite()) continue;
    const auto point = static_cast<std::uint32_t>(k);
    const std::size_t half = philox(point, number, 0, kOfPoint, key_low, key_high).v[0] >> 31;
    const HalfSpace(&planes)[2] = of_part[half];
    if (!planes[0].holds(p) || !planes[1].holds(p)) continue;
    Part& part = *parts[half];
    const Eigen::Vector3d noisy = p + noise_of[half].at(p, point);
    const bool target = half == 1;
    part.points.push_back((target ? moved(out.target_from_source, noisy) : noisy).cast<float>());
    if (scan.normals != nullptr) {
      const Eigen::Vector3d n = row(scan.normals, scan.normal_stride, k);
      part.normals.push_back((target ? turned(out.target_from_source, n) : n).cast<float>());
    }
    if (scan.features != nullptr) {
      const std::size_t stride =
          scan.feature_stride > 0 ? scan.feature_stride : scan.feature_dimension;
      const float* feature = scan.features + k * stride;
      part.features.insert(part.features.end(), feature, feature + scan.feature_dimension);
    }
  }
  const ViewpointSource known = prepared.statistics().viewpoint;
  for (const bool target : {false, true}) {
    Part& part = *parts[target];
    part.feature_dimension = scan.feature_dimension;
    part.infer_viewpoint = known != ViewpointSource::none;
    const auto add = [&](const Eigen::Vector3d& v) {
      part.viewpoints.push_back((target ? moved(out.target_from_source, v) : v).cast<float>());
    };
    for (std::size_t k = 0; k < scan.viewpoint_count; ++k) add(row(scan.viewpoints, 3, k));
    // What was inferred of the whole scan holds for its parts, which the origin moves away from.
    if (scan.viewpoint_count == 0 && known == ViewpointSource::origin)
      add({-scan.origin[0], -scan.origin[1], -scan.origin[2]});
  }
  return out;
}

}  // namespace gpureg::calibration
