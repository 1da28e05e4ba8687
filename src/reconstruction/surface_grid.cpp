// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/surface_grid.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace gpureg::reconstruction {
namespace {

/// Bits of a key per axis: cells are counted from the low corner of the box.
constexpr int kAxisBits = 21;
constexpr int kMaxCell = (1 << kAxisBits) - 1;

std::uint64_t mixed(std::uint64_t key) {
  key *= 0x9E3779B97F4A7C15ull;
  return key ^ (key >> 32);
}

bool usable(const Surface& surface, std::size_t k) {
  return surface.points[k].allFinite() && surface.normals[k].squaredNorm() > 0.25f;
}

}  // namespace

SurfaceGrid::SurfaceGrid(const Surface& surface, float distance)
    : surface_(surface), distance_(distance) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  low_.setConstant(kInfinity);
  high_.setConstant(-kInfinity);
  for (std::size_t k = 0; k < surface.points.size(); ++k) {
    if (!usable(surface, k)) continue;
    low_ = low_.cwiseMin(surface.points[k]);
    high_ = high_.cwiseMax(surface.points[k]);
    indices_.push_back(static_cast<std::uint32_t>(k));
  }
  if (indices_.empty()) return;
  low_.array() -= distance;
  high_.array() += distance;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keyed;
  for (const std::uint32_t k : indices_) keyed.emplace_back(key_of(cell_of(surface.points[k])), k);
  std::sort(keyed.begin(), keyed.end());
  std::size_t size = 16;
  while (size < 2 * keyed.size()) size *= 2;
  cells_.resize(size);
  for (std::uint32_t begin = 0; begin < keyed.size();) {
    std::uint32_t end = begin;
    for (; end < keyed.size() && keyed[end].first == keyed[begin].first; ++end)
      indices_[end] = keyed[end].second;
    std::size_t slot = mixed(keyed[begin].first) & (size - 1);
    while (cells_[slot].key != kEmpty) slot = (slot + 1) & (size - 1);
    cells_[slot] = {keyed[begin].first, begin, end};
    begin = end;
  }
}

std::uint32_t SurfaceGrid::closest(const Eigen::Vector3f& p, const Eigen::Vector3f& normal,
                                   float min_cosine) const {
  if (indices_.empty() || !may_reach(p)) return kNone;
  const Eigen::Vector3i centre = cell_of(p);
  float least = distance_ * distance_;
  std::uint32_t best = kNone;
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const Eigen::Vector3i cell = centre + Eigen::Vector3i(dx, dy, dz);
        if ((cell.array() < 0).any()) continue;
        const Cell* found = find(key_of(cell));
        if (found == nullptr) continue;
        for (std::uint32_t at = found->begin; at < found->end; ++at) {
          const std::uint32_t k = indices_[at];
          const float squared = (surface_.points[k] - p).squaredNorm();
          if (squared > least || (squared == least && k >= best)) continue;
          if (surface_.normals[k].dot(normal) < min_cosine) continue;
          least = squared;
          best = k;
        }
      }
  return best;
}

std::uint64_t SurfaceGrid::key_of(const Eigen::Vector3i& cell) const {
  const auto bits = [&](int axis) { return static_cast<std::uint64_t>(cell[axis]); };
  return bits(0) << (2 * kAxisBits) | bits(1) << kAxisBits | bits(2);
}

Eigen::Vector3i SurfaceGrid::cell_of(const Eigen::Vector3f& p) const {
  // Beyond the key's range cells are shared at the border; distances still decide.
  return ((p - low_) / distance_)
      .array()
      .floor()
      .max(0.0f)
      .min(static_cast<float>(kMaxCell - 1))
      .cast<int>();
}

const SurfaceGrid::Cell* SurfaceGrid::find(std::uint64_t key) const {
  const std::size_t mask = cells_.size() - 1;
  for (std::size_t slot = mixed(key) & mask; cells_[slot].key != kEmpty; slot = (slot + 1) & mask)
    if (cells_[slot].key == key) return &cells_[slot];
  return nullptr;
}

}  // namespace gpureg::reconstruction
