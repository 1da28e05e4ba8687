// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "cpu/common/stage_data.hpp"

namespace gpureg::cpu {

/// Points of a grid, one array per coordinate, and the first point of each row of cells along x.
/// The cells of a row are adjacent in memory, so a ball is a few runs of points instead of many
/// look-ups. A position is a point's index in the order of the grid.
class NeighborRows {
 public:
  NeighborRows(const Grid& grid, const std::vector<Vec3>& normals)
      : inverse_(1.0f / grid.cell_size), index_(grid.index) {
    const std::size_t n = grid.points.size(), cells = grid.cell_start.size() - 1;
    for (auto* v : {&x_, &y_, &z_, &nx_, &ny_, &nz_}) v->resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      const Vec3 p = grid.points[k], m = normals[grid.index[k]];
      x_[k] = p.x;
      y_[k] = p.y;
      z_[k] = p.z;
      nx_[k] = m.x;
      ny_[k] = m.y;
      nz_[k] = m.z;
    }
    for (std::size_t c = 0; c < cells; ++c) {
      const Cell cell = cell_of(grid.points[grid.cell_start[c]], inverse_);
      if (rows_.empty() || rows_.back().y != cell.y || rows_.back().z != cell.z)
        rows_.push_back({cell.y, cell.z, static_cast<std::uint32_t>(c)});
      cell_x_.push_back(cell.x);
    }
    rows_.push_back({0, 0, static_cast<std::uint32_t>(cells)});
    for (std::size_t r = 0; r + 1 < rows_.size(); ++r)
      if (planes_.empty() || planes_.back().z != rows_[r].z)
        planes_.push_back({rows_[r].z, static_cast<std::uint32_t>(r)});
    planes_.push_back({0, static_cast<std::uint32_t>(rows_.size() - 1)});
    start_ = grid.cell_start;
  }

  std::size_t size() const { return index_.size(); }
  std::uint32_t index(std::size_t place) const { return index_[place]; }
  Vec3 point(std::size_t place) const { return {x_[place], y_[place], z_[place]}; }
  Vec3 normal(std::size_t place) const { return {nx_[place], ny_[place], nz_[place]}; }

  /// Calls run(first, last) for runs of positions that together contain every point within the
  /// radius, in the order of for_each_neighbor().
  template <typename Run>
  void for_each_run(Vec3 q, float radius, Run&& run) const {
    const float reach = radius * kBallMargin;
    const Cell lo = cell_of({q.x - reach, q.y - reach, q.z - reach}, inverse_),
               hi = cell_of({q.x + reach, q.y + reach, q.z + reach}, inverse_);
    auto plane = std::lower_bound(planes_.begin(), planes_.end() - 1, lo.z,
                                  [](const Plane& a, std::int32_t z) { return a.z < z; });
    for (; plane + 1 != planes_.end() && plane->z <= hi.z; ++plane) {
      const auto end = rows_.begin() + (plane + 1)->first_row;
      auto row = std::lower_bound(rows_.begin() + plane->first_row, end, lo.y,
                                  [](const Row& a, std::int32_t y) { return a.y < y; });
      for (; row != end && row->y <= hi.y; ++row) {
        std::uint32_t first = row->first_cell;
        const std::uint32_t stop = (row + 1)->first_cell;
        while (first < stop && cell_x_[first] < lo.x) ++first;
        std::uint32_t last = first;
        while (last < stop && cell_x_[last] <= hi.x) ++last;
        if (first < last) run(start_[first], start_[last]);
      }
    }
  }

  /// Positions within the radius of q for which keep(position, squared distance) is true, in the
  /// order of for_each_neighbor(), and their squared distances. The vectors grow as needed and
  /// never shrink.
  template <typename Keep>
  std::size_t within(Vec3 q, float radius, std::vector<std::uint32_t>& places,
                     std::vector<float>& squared, Keep&& keep) const {
    const float r2 = radius * radius;
    std::size_t n = 0;
    for_each_run(q, radius, [&](std::uint32_t first, std::uint32_t last) {
      if (places.size() < n + (last - first)) {
        places.resize(2 * (n + (last - first)));
        squared.resize(places.size());
      }
      std::uint32_t* place = places.data();
      float* d2 = squared.data();
      // Writes every point and overwrites those outside: a branch on the distance is unpredictable.
      for (std::uint32_t k = first; k < last; ++k) {
        const float d = squared_norm(point(k) - q);
        place[n] = k;
        d2[n] = d;
        n += static_cast<std::size_t>((d <= r2) & keep(k, d));
      }
    });
    return n;
  }

 private:
  struct Row {
    std::int32_t y, z;
    std::uint32_t first_cell;
  };
  struct Plane {
    std::int32_t z;
    std::uint32_t first_row;
  };
  float inverse_;
  const std::vector<std::uint32_t>& index_;
  std::vector<float> x_, y_, z_, nx_, ny_, nz_;
  std::vector<std::uint32_t> start_;
  std::vector<std::int32_t> cell_x_;
  std::vector<Row> rows_;
  std::vector<Plane> planes_;
};

}  // namespace gpureg::cpu
