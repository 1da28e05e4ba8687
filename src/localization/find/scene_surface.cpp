// SPDX-License-Identifier: BSD-3-Clause
#include "localization/find/scene_surface.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "algorithm/cell.hpp"

namespace gpureg::localization {
namespace {

/// Face of the cube around the viewpoint and cell in it.
std::uint32_t bin_of(const Eigen::Vector3f& d, int bins) {
  int axis = 0;
  const float most = d.cwiseAbs().maxCoeff(&axis);
  const auto place = [&](float v) {
    return std::clamp(static_cast<int>((v / most + 1) * 0.5f * static_cast<float>(bins)), 0,
                      bins - 1);
  };
  const int face = 2 * axis + (d[axis] < 0 ? 1 : 0);
  return static_cast<std::uint32_t>((face * bins + place(d[(axis + 1) % 3])) * bins +
                                    place(d[(axis + 2) % 3]));
}

Eigen::Vector3f direction_of(std::uint32_t bin, int bins) {
  const int b = static_cast<int>(bin), face = b / (bins * bins), axis = face / 2;
  const auto at = [&](int k) {
    return (static_cast<float>(k) + 0.5f) / static_cast<float>(bins) * 2 - 1;
  };
  Eigen::Vector3f d;
  d[axis] = face % 2 == 0 ? 1.0f : -1.0f;
  d[(axis + 1) % 3] = at(b / bins % bins);
  d[(axis + 2) % 3] = at(b % bins);
  return d.normalized();
}

std::uint64_t hash(std::uint64_t key) {
  key ^= key >> 31;
  key *= 0x9E3779B97F4A7C15ull;
  return key ^ key >> 29;
}

}  // namespace

SceneView::SceneView(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& viewpoint)
    : viewpoint_(viewpoint) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    const Eigen::Vector3f d = points[k] - viewpoint;
    if (d.squaredNorm() > 0) order.emplace_back(bin_of(d, kBins), k);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [bin, k] : order) {
    const auto place = static_cast<std::uint32_t>(points_.size());
    if (place == 0 || bin != order[place - 1].first)
      bins_.push_back({direction_of(bin, kBins), place, place});
    bins_.back().end = place + 1;
    points_.push_back(points[k] - viewpoint);
  }
}

SceneSurface::SceneSurface(std::vector<Eigen::Vector3f> points,
                           std::vector<Eigen::Vector3f> normals, bool oriented, float reach)
    : oriented_(oriented), reach_(reach), inverse_(0.5f / reach) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    const Vec3 p{points[k].x(), points[k].y(), points[k].z()};
    order.emplace_back(cell_key(cell_of(p, inverse_)), k);
  }
  std::sort(order.begin(), order.end());
  std::size_t size = 16;
  while (size < 3 * order.size()) size *= 2;
  table_.resize(size);
  for (std::uint32_t k = 0; k < order.size(); ++k) {
    points_.push_back(points[order[k].second]);
    normals_.push_back(normals[order[k].second]);
    if (k > 0 && order[k].first == order[k - 1].first) continue;
    std::uint32_t end = k + 1;
    while (end < order.size() && order[end].first == order[k].first) ++end;
    std::size_t slot = hash(order[k].first) & (size - 1);
    while (table_[slot].end > 0) slot = (slot + 1) & (size - 1);
    table_[slot] = {order[k].first, k, end};
  }
  number_blocks();
}

void SceneSurface::number_blocks() {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  for (std::uint32_t k = 0; k < points_.size(); ++k) {
    const Vec3 p{points_[k].x(), points_[k].y(), points_[k].z()};
    order.emplace_back(cell_key(cell_of(p, 1 / reach_)), k);
  }
  std::sort(order.begin(), order.end());
  blocks_.resize(points_.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    block_count_ += k == 0 || order[k].first != order[k - 1].first;
    blocks_[order[k].second] = static_cast<std::uint32_t>(block_count_ - 1);
  }
}

const SceneSurface::Bucket* SceneSurface::bucket_of(std::uint64_t key) const {
  const std::size_t mask = table_.size() - 1;
  for (std::size_t slot = hash(key) & mask; table_[slot].end > 0; slot = (slot + 1) & mask)
    if (table_[slot].key == key) return &table_[slot];
  return nullptr;
}

SceneSurface::Nearest SceneSurface::nearest(const Eigen::Vector3f& point,
                                            const Eigen::Vector3f& normal, float min_cosine) const {
  Nearest best;
  float closest = reach_ * reach_;
  // Cells are twice the reach wide: those of the corners of the box around the point.
  const Vec3 low{point.x() - reach_, point.y() - reach_, point.z() - reach_},
      high{point.x() + reach_, point.y() + reach_, point.z() + reach_};
  const Cell first = cell_of(low, inverse_), last = cell_of(high, inverse_);
  for (std::int32_t z = first.z; z <= last.z; ++z)
    for (std::int32_t y = first.y; y <= last.y; ++y)
      for (std::int32_t x = first.x; x <= last.x; ++x) {
        const Cell cell{x, y, z};
        if (!in_key_range(cell)) continue;
        const Bucket* bucket = bucket_of(cell_key(cell));
        if (bucket == nullptr) continue;
        for (std::uint32_t k = bucket->begin; k < bucket->end; ++k) {
          const Eigen::Vector3f d = point - points_[k];
          const float squared = d.squaredNorm();
          if (squared >= closest) continue;
          const float cosine = normals_[k].dot(normal);
          if ((oriented_ ? cosine : std::abs(cosine)) < min_cosine) continue;
          closest = squared;
          best = {k, normals_[k].dot(d)};
        }
      }
  return best;
}

}  // namespace gpureg::localization
