// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/one_return.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "pipeline/finite_rows.hpp"

namespace gpureg {
namespace {

/// Rows of which directions are compared, and those of them whose neighbours are searched.
constexpr std::size_t kDirections = 8000, kReturns = 1500;
/// Neighbours in direction are on different surfaces from this ratio of their ranges on.
constexpr float kOtherSurface = 1.16f;
/// Distance of the places that a viewpoint is compared with, in median ranges.
constexpr float kBeside = 0.3f;
/// Largest mean of the directions of the points: they surround a spinning scanner. From a place far
/// outside of a cloud all ranges are alike.
constexpr float kLargestMeanDirection = 0.5f;
/// Least share of neighbours on different surfaces as seen from those places (fewer tell nothing),
/// and the largest ratio of the viewpoint's share to it. Measured on LiDAR, thinned or not, rooms,
/// objects and parts: no cloud that was moved is below both.
constexpr double kLeastBehind = 0.05, kBehindRatio = 0.55;

struct Ray {
  Vec3 direction;
  float range;
};

/// Directions in cubic cells. A cell has three rays or so, whatever the field of view.
class DirectionGrid {
 public:
  explicit DirectionGrid(const std::vector<Ray>& rays) {
    Vec3 hi{-1, -1, -1};
    for (const Ray& ray : rays) {
      const Vec3& d = ray.direction;
      low_ = {std::min(low_.x, d.x), std::min(low_.y, d.y), std::min(low_.z, d.z)};
      hi = {std::max(hi.x, d.x), std::max(hi.y, d.y), std::max(hi.z, d.z)};
    }
    const Vec3 extent = hi - low_;
    edge_ = std::max(std::max({extent.x, extent.y, extent.z}) / kCells, kSmallestEdge);
    std::vector<std::uint32_t> cell(rays.size());
    begin_.assign(kSide * kSide * kSide + 1, 0);
    for (std::size_t k = 0; k < rays.size(); ++k) {
      cell[k] = cell_of(rays[k].direction);
      ++begin_[cell[k] + 1];
    }
    for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    sorted_.resize(rays.size());
    for (std::size_t k = 0; k < rays.size(); ++k) sorted_[next[cell[k]]++] = rays[k];
  }

  const std::vector<Ray>& sorted() const { return sorted_; }

  /// The ray of another row whose direction is nearest to that of sorted()[at]; `at` where there is
  /// none.
  std::size_t nearest(std::size_t at) const {
    std::size_t best = at;
    float squared = std::numeric_limits<float>::infinity();
    const auto visit = [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const Vec3 d = sorted_[k].direction - sorted_[at].direction;
        const float here = d.x * d.x + d.y * d.y + d.z * d.z;
        if (here >= squared || k == at) continue;
        squared = here;
        best = k;
      }
    };
    const std::uint32_t cell = cell_of(sorted_[at].direction);
    for (std::uint32_t z = 0; z <= 2 * kSide * kSide; z += kSide * kSide)
      for (std::uint32_t y = 0; y <= 2 * kSide; y += kSide) {
        const std::uint32_t first = cell + z + y - kSide * kSide - kSide - 1;
        visit(begin_[first], begin_[first + 3]);
      }
    if (squared > edge_ * edge_) visit(0, sorted_.size());  // it may lie outside of these cells
    return best;
  }

 private:
  /// Cells along the largest extent, and with an empty one at each end.
  static constexpr std::uint32_t kCells = 30, kSide = kCells + 3;
  static constexpr float kSmallestEdge = 1e-6f;

  std::uint32_t cell_of(Vec3 direction) const {
    const auto along = [&](float from) {
      return 1 + std::min(kCells, static_cast<std::uint32_t>(from / edge_));
    };
    const Vec3 d = direction - low_;
    return (along(d.z) * kSide + along(d.y)) * kSide + along(d.x);
  }

  Vec3 low_{1, 1, 1};
  float edge_ = 1;
  std::vector<std::uint32_t> begin_;
  std::vector<Ray> sorted_;
};

/// Share of neighbours in direction that are on different surfaces, as seen from a place.
double share_behind(const std::vector<Vec3>& points, Vec3 place) {
  std::vector<Ray> rays;
  rays.reserve(points.size());
  for (const Vec3& p : points)
    if (const float range = norm(p - place); range > 0)
      rays.push_back({(p - place) * (1 / range), range});
  if (rays.empty()) return 0;
  const DirectionGrid grid(rays);
  const std::size_t count = std::min(kReturns, rays.size());
  std::size_t behind = 0;
  for (std::size_t s = 0; s < count; ++s) {
    const std::size_t at = s * rays.size() / count;
    const float a = grid.sorted()[at].range, b = grid.sorted()[grid.nearest(at)].range;
    behind += std::max(a, b) > kOtherSurface * std::min(a, b);
  }
  return static_cast<double>(behind) / static_cast<double>(count);
}

}  // namespace

bool has_one_return_per_direction(const RawCloud& rows, Vec3 viewpoint) {
  const std::vector<Vec3> all = finite_rows(rows);
  std::vector<Vec3> points;
  const std::size_t count = std::min(kDirections, all.size());
  for (std::size_t s = 0; s < count; ++s) points.push_back(all[s * all.size() / count]);
  if (points.empty()) return false;
  std::vector<float> ranges;
  Vec3 sum{0, 0, 0};
  for (const Vec3& p : points) {
    ranges.push_back(norm(p - viewpoint));
    sum = sum + normalized_or_zero(p - viewpoint);
  }
  if (!(norm(sum) <= kLargestMeanDirection * static_cast<float>(points.size()))) return false;
  const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
  std::nth_element(ranges.begin(), middle, ranges.end());
  std::vector<double> beside;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x)
        if (const int length = x * x + y * y + z * z; length == 1 || length == 3) {
          const Vec3 side = normalized_or_zero(
              {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
          beside.push_back(share_behind(points, viewpoint + side * (kBeside * *middle)));
        }
  const auto typical = beside.begin() + static_cast<std::ptrdiff_t>(beside.size() / 2);
  std::nth_element(beside.begin(), typical, beside.end());
  return *typical >= kLeastBehind && share_behind(points, viewpoint) <= kBehindRatio * *typical;
}

}  // namespace gpureg
