// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/common/surface_matcher.hpp"

#include "common/radix_sort.hpp"

namespace gpureg::cpu {

SurfaceGrid::SurfaceGrid(const SurfaceArrays& surface, float distance)
    : bounds(surface_grid_of(surface, distance)) {
  std::vector<KeyIndex> order;
  order.reserve(surface.usable);
  for (std::uint32_t i = 0; i < surface.size; ++i) {
    const Vec3 p = row_of(surface.points, i);
    if (usable(p, row_of(surface.normals, i)))
      order.push_back({cell_key(surface_cell(bounds, p)), i});
  }
  radix_sort(order);
  std::uint32_t cells = 0;
  for (std::size_t k = 0; k < order.size(); ++k)
    cells += k == 0 || order[k].key != order[k - 1].key;
  std::uint32_t size = 8;
  while (size < 2 * cells) size *= 2;
  table.assign(size, {kEmptyKey, 0, 0});
  points.reserve(order.size());
  normals.reserve(order.size());
  for (const KeyIndex& item : order) {
    points.push_back({row_of(surface.points, item.index), item.index});
    normals.push_back({row_of(surface.normals, item.index), surface.variances[item.index]});
  }
  for (std::uint32_t first = 0, last; first < order.size(); first = last) {
    const std::uint64_t key = order[first].key;
    for (last = first; last < order.size() && order[last].key == key;) ++last;
    std::uint32_t slot = cell_slot(key, size - 1);
    while (table[slot].key != kEmptyKey) slot = (slot + 1) & (size - 1);
    table[slot] = {key, first, last};
  }
}

SurfaceGridView SurfaceGrid::view() const {
  SurfaceGridView out = bounds;
  out.table = span_of(table);
  out.points = points.data();
  out.normals = normals.data();
  return out;
}

void CpuSurfaces::build_grids(Span<const SurfacePairInput> pairs, float distance) {
  if (distance != distance_) grids_.clear();
  distance_ = distance;
  grids_.resize(surfaces_.size());
  std::vector<std::uint8_t> needed(surfaces_.size(), 0);
  for (const SurfacePairInput& pair : pairs)
    needed[pair.target] = surfaces_[pair.target].usable > 0 && !grids_[pair.target];
  exec_.parallel(surfaces_.size(), [&](std::size_t k) {
    if (needed[k]) grids_[k] = std::make_unique<SurfaceGrid>(surfaces_[k], distance);
  });
}

void CpuSurfaces::add_up(Span<const SurfacePairInput> pairs, const SurfaceTerms& terms,
                         Span<SurfaceSums> sums) {
  const std::lock_guard<std::mutex> lock(mutex_);
  build_grids(pairs, terms.max_distance);
  exec_.parallel(pairs.size, [&](std::size_t p) {
    const SurfacePairInput& pair = pairs[p];
    SurfaceSums sum{};
    const SurfaceArrays& source = surfaces_[pair.source];
    if (grids_[pair.target] && source.usable > 0) {
      const SurfaceGridView target = grids_[pair.target]->view();
      const std::uint32_t step = surface_step(source.size, terms.max_points);
      SurfaceCorrespondence c;
      for (std::uint64_t i = 0; i < source.size; i += step) {
        if (!surface_correspondence(source, target, pair.target_from_source, terms,
                                    static_cast<std::uint32_t>(i), c))
          continue;
        add_icp_term(c.arm, c.normal, c.residual, c.weight, sum.equations);
        sum.squared += to_icp_fixed(c.residual * c.residual);
        ++sum.count;
      }
    }
    sums[p] = sum;
  });
}

}  // namespace gpureg::cpu
