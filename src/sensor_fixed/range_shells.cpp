// SPDX-License-Identifier: BSD-3-Clause
#include "sensor_fixed/range_shells.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gpureg {
namespace {

/// Rows of which it is decided whether all are worth a look: ten of a shell of one per cent.
constexpr std::size_t kSampledRows = 1024;
constexpr std::size_t kJitter = 7919;
/// Widths of a shell as shares of its range, from the smallest (quantised ranges) in powers of two.
/// Near the sensor the noise is a larger share of the range.
constexpr double kThinnest = 1.0 / 8192, kThickestFar = 1.0 / 128, kThickestNear = 1.0 / 16;
/// The range of a smooth surface has its steepest end where it is largest along a ridge (a barrel
/// around the sensor): then the last width has as many points as the three widths before it. A
/// shell has this many times more.
constexpr std::size_t kMoreThanBefore = 8;
/// The same in the sample, where all rows are looked at afterwards.
constexpr std::size_t kMoreInSample = 3, kLeastInSample = 4;
/// Fewer points, and a smaller share of them, support no pose.
constexpr std::size_t kLeastPoints = 32, kLeastOfShell = 500;
/// A surface has more than a third of the points: a sphere about the sensor.
constexpr std::size_t kSurfaceShare = 3;
/// The ranges of a plane in these directions differ on the average by the range times the spread of
/// the directions (one minus the length of their mean). Those of a shell differ by less than an
/// eighth of it.
constexpr double kFlatterThanPlane = 1.0 / 8;
/// Rings of a scanner on level ground have one range each, and directions on one cone. Relative to
/// the extent of the directions, two neighbouring rings are below this solidity, a disc of
/// directions has 0.3, a strip of three degrees 0.001.
constexpr double kLeastSolidity = 1e-3;
/// Points nearer than the thousandth of a thousandth of the largest range are at the sensor: rays
/// without a return. Of the squares.
constexpr float kAtSensor = 1e-12f;
/// The smallest range of a sensor is far below the distances of what it looks at.
constexpr double kNearShare = 1.0 / 4;

/// Rows as seen from the first viewpoint.
class Viewed {
 public:
  explicit Viewed(const RawCloud& raw) : raw_(raw) {
    if (raw.viewpoint_count > 0) from_ = {raw.viewpoints[0], raw.viewpoints[1], raw.viewpoints[2]};
  }
  Vec3 ray(std::size_t row) const {
    const float* p = raw_.points + row * raw_.point_stride;
    return Vec3{p[0], p[1], p[2]} - from_;
  }

 private:
  const RawCloud& raw_;
  Vec3 from_{0, 0, 0};
};

struct SeenRay {
  double range;
  Vec3 to;
};

/// Mean of the directions and their second moments about it.
struct Directions {
  double mean[3] = {0, 0, 0}, moments[6] = {0, 0, 0, 0, 0, 0};

  Directions(const std::vector<SeenRay>& rays, std::size_t count) {
    const auto direction = [&](std::size_t k, double(&d)[3]) {
      d[0] = static_cast<double>(rays[k].to.x) / rays[k].range;
      d[1] = static_cast<double>(rays[k].to.y) / rays[k].range;
      d[2] = static_cast<double>(rays[k].to.z) / rays[k].range;
    };
    double d[3];
    const double share = 1.0 / static_cast<double>(count);
    for (std::size_t k = 0; k < count; ++k) {
      direction(k, d);
      for (int a = 0; a < 3; ++a) mean[a] += share * d[a];
    }
    for (std::size_t k = 0; k < count; ++k) {
      direction(k, d);
      int at = 0;
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b <= a; ++b) moments[at++] += share * (d[a] - mean[a]) * (d[b] - mean[b]);
    }
  }
  double spread() const {
    return 1 - std::sqrt(mean[0] * mean[0] + mean[1] * mean[1] + mean[2] * mean[2]);
  }
  /// The determinant of the moments over that of directions as wide in two directions that bulge
  /// as the unit sphere does: 0 where all are on one cone or in one plane.
  double solidity() const {
    const double xx = moments[0], xy = moments[1], yy = moments[2], xz = moments[3],
                 yz = moments[4], zz = moments[5], half = 0.5 * (xx + yy + zz);
    const double determinant =
        xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    return half > 0 ? determinant / (half * half * half * half) : 0;
  }
};

/// One end of the ranges: the largest (sign 1) or the smallest (-1).
struct End {
  double sign, thickest;

  bool beyond(double a, double b) const { return sign * a > sign * b; }
};
constexpr End kFar{1, kThickestFar}, kNear{-1, kThickestNear};

/// The rays of one end of the ranges.
class Shell {
 public:
  /// @param last the range at the end.
  Shell(const End& end, double last) : end_(end), last_(last), reach_(limit_of(4 * end.thickest)) {}

  void offer(Vec3 to, float squared_range) {
    if (!end_.beyond(static_cast<double>(squared_range), reach_ * reach_)) return;
    const double range = std::sqrt(static_cast<double>(squared_range));
    rays_.push_back({range, to});
  }
  /// Looks for the widest shell that has far more points than three such widths before it.
  bool find(std::size_t more, std::size_t least) {
    if (rays_.size() < least) return false;
    std::sort(rays_.begin(), rays_.end(), [&](const SeenRay& a, const SeenRay& b) {
      return a.range != b.range ? end_.beyond(a.range, b.range)
             : a.to.x != b.to.x ? a.to.x < b.to.x
             : a.to.y != b.to.y ? a.to.y < b.to.y
                                : a.to.z < b.to.z;
    });
    for (double share = end_.thickest; share >= kThinnest; share *= 0.5) {
      size_ = within(share);
      if (size_ >= least && size_ >= more * (within(4 * share) - size_ + 1)) {
        limit_ = limit_of(share);
        return true;
      }
    }
    return false;
  }
  /// Of the shell found: it is no surface that faces the sensor, and no rings on the ground.
  /// planar: of a 2-D scanner.
  bool surrounds_sensor(bool planar) const {
    double depth = 0;
    for (std::size_t k = 0; k < size_; ++k)
      depth += std::abs(rays_[k].range - last_) / static_cast<double>(size_);
    const Directions directions(rays_, size_);
    return depth <= kFlatterThanPlane * last_ * directions.spread() &&
           (planar || directions.solidity() >= kLeastSolidity);
  }

  double last() const { return last_; }
  std::size_t size() const { return size_; }
  double limit() const { return limit_; }  ///< ranges beyond it are of the shell found

 private:
  double limit_of(double share) const { return last_ * (1 - end_.sign * share); }
  std::size_t within(double share) const {
    const double limit = limit_of(share);
    return static_cast<std::size_t>(
        std::partition_point(rays_.begin(), rays_.end(),
                             [&](const SeenRay& ray) { return end_.beyond(ray.range, limit); }) -
        rays_.begin());
  }

  End end_;
  double last_, reach_, limit_ = 0;
  std::vector<SeenRay> rays_;
  std::size_t size_ = 0;
};

/// The ends of the ranges, squared.
struct RangeExtent {
  float nearest = std::numeric_limits<float>::infinity(), farthest = 0;
  std::size_t finite = 0, at_sensor = 0;

  /// at_most: squared range of points at the sensor.
  void add(Vec3 to, float squared, float at_most) {
    if (!all_finite(to)) return;
    ++finite;
    if (squared > farthest) farthest = squared;
    if (squared <= at_most)
      ++at_sensor;
    else if (squared < nearest)
      nearest = squared;
  }
  double near_range() const { return std::sqrt(static_cast<double>(nearest)); }
  double far_range() const { return std::sqrt(static_cast<double>(farthest)); }
};

/// Some of the rows, in no rhythm that rows may have.
class RangeSample {
 public:
  RangeSample(const RawCloud& raw, const Viewed& viewed) {
    const std::size_t step = std::max<std::size_t>(1, raw.size / kSampledRows),
                      further = kJitter % step;
    std::size_t within = 0;  // the step
    for (std::size_t row = 0; row + step <= raw.size; row += step) {
      const Vec3 to = viewed.ray(row + within);
      within += further;
      if (within >= step) within -= step;
      const float squared = squared_norm(to);
      if (!(squared <= std::numeric_limits<float>::max())) continue;
      to_[size_] = to;
      squared_[size_++] = squared;
      farthest_ = squared > farthest_ ? squared : farthest_;
    }
    at_sensor_ = kAtSensor * farthest_;
    for (std::size_t k = 0; k < size_; ++k) {
      some_at_sensor_ |= squared_[k] <= at_sensor_;
      const float seen = squared_[k] > at_sensor_ ? squared_[k] : nearest_;
      nearest_ = seen < nearest_ ? seen : nearest_;
    }
  }

  float at_sensor() const { return at_sensor_; }
  bool some_at_sensor() const { return some_at_sensor_; }
  bool suspects_far() const { return suspects(kFar, farthest_); }
  bool suspects_near() const {
    return suspects(kNear, nearest_) &&
           std::sqrt(static_cast<double>(nearest_)) <= 2 * kNearShare * median();
  }
  double median() const {
    std::vector<float> squares;
    for (std::size_t k = 0; k < size_; ++k)
      if (squared_[k] > at_sensor_) squares.push_back(squared_[k]);
    if (squares.empty()) return 0;
    const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    return std::sqrt(static_cast<double>(*middle));
  }
  /// Of a 2-D scanner: all directions are in one plane.
  bool planar() const {
    std::vector<SeenRay> seen;
    for (std::size_t k = 0; k < size_; ++k)
      if (squared_[k] > at_sensor_)
        seen.push_back({std::sqrt(static_cast<double>(squared_[k])), to_[k]});
    return !seen.empty() && Directions(seen, seen.size()).solidity() < kLeastSolidity;
  }

 private:
  bool suspects(const End& end, float squared_last) const {
    Shell shell(end, std::sqrt(static_cast<double>(squared_last)));
    for (std::size_t k = 0; k < size_; ++k)
      if (squared_[k] > at_sensor_) shell.offer(to_[k], squared_[k]);
    return shell.find(kMoreInSample, kLeastInSample);
  }

  // A step is at least a sampled share of the rows, so there are fewer than twice as many.
  Vec3 to_[2 * kSampledRows];
  float squared_[2 * kSampledRows];
  std::size_t size_ = 0;
  float farthest_ = 0, nearest_ = std::numeric_limits<float>::infinity(), at_sensor_ = 0;
  bool some_at_sensor_ = false;
};

}  // namespace

RangeShells range_shells(const RawCloud& raw) {
  RangeShells out;
  if (raw.size < kLeastPoints) return out;
  const Viewed viewed(raw);
  const RangeSample sample(raw, viewed);
  const bool far_suspect = sample.suspects_far(), near_suspect = sample.suspects_near();
  if (!far_suspect && !near_suspect && !sample.some_at_sensor()) return out;
  RangeExtent extent;
  for (std::size_t i = 0; i < raw.size; ++i) {
    const Vec3 to = viewed.ray(i);
    extent.add(to, squared_norm(to), sample.at_sensor());
  }
  Shell far(kFar, extent.far_range()), near(kNear, extent.near_range());
  for (std::size_t i = 0; i < raw.size && (far_suspect || near_suspect); ++i) {
    const Vec3 to = viewed.ray(i);
    const float squared = squared_norm(to);
    if (!all_finite(to) || squared <= sample.at_sensor()) continue;
    if (far_suspect) far.offer(to, squared);
    if (near_suspect) near.offer(to, squared);
  }
  const std::size_t least = std::max(kLeastPoints, extent.finite / kLeastOfShell);
  const bool planar = sample.planar();
  const auto is_shell = [&](Shell& shell) {
    return shell.find(kMoreThanBefore, least) && shell.size() <= extent.finite / kSurfaceShare &&
           shell.surrounds_sensor(planar);
  };
  out.to = std::numeric_limits<double>::infinity();
  if (extent.at_sensor >= least && extent.finite - extent.at_sensor >= kLeastPoints) {
    out.limits.smallest_points = extent.at_sensor;
    out.from = std::sqrt(static_cast<double>(sample.at_sensor()));
  }
  if (near.last() <= kNearShare * sample.median() && is_shell(near)) {
    out.limits.smallest_points += near.size();
    out.limits.smallest_range = near.last();
    out.from = near.limit();
  }
  if (is_shell(far)) {
    out.limits.largest_points = far.size();
    out.limits.largest_range = far.last();
    out.to = far.limit();
  }
  return out;
}

WithoutRangeShells::WithoutRangeShells(const RawCloud& raw, bool keep) : kept_(raw) {
  if (keep) return;
  shells_ = range_shells(raw);
  if (!shells_.exist()) return;
  const Viewed viewed(raw);
  std::vector<std::uint32_t> rows;
  for (std::size_t i = 0; i < raw.size; ++i) {
    const Vec3 to = viewed.ray(i);
    const double range = std::sqrt(static_cast<double>(squared_norm(to)));
    // Invalid rows are counted by the preparation.
    if (!all_finite(to) || (range > shells_.from && range <= shells_.to))
      rows.push_back(static_cast<std::uint32_t>(i));
  }
  kept_.keep(raw, rows);
}

void WithoutRangeShells::count(PrepareStatistics& statistics) const {
  const RangeLimits& limits = shells_.limits;
  statistics.input_points += limits.points();
  statistics.range_limit_points = limits.points();
  statistics.smallest_range = limits.smallest_range;
  statistics.largest_range = limits.largest_range;
}

}  // namespace gpureg
