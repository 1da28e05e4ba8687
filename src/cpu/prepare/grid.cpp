// SPDX-License-Identifier: BSD-3-Clause
#include "common/radix_sort.hpp"
#include "cpu/common/stages.hpp"
#include "pipeline/checks.hpp"

namespace gpureg::cpu {

void CellTable::reset(std::size_t keys) {
  std::size_t size = 8;
  while (size < 3 * keys) size *= 2;
  entries.assign(size, CellEntry{kEmptyKey, kNoValue, 0});
}

void CellTable::insert(std::uint64_t key, std::uint32_t value) {
  const std::uint32_t mask = static_cast<std::uint32_t>(entries.size()) - 1;
  std::uint32_t slot = cell_slot(key, mask);
  while (entries[slot].key != kEmptyKey && entries[slot].key != key) slot = (slot + 1) & mask;
  entries[slot] = {key, value, 0};
}

GridView Grid::view() const {
  return {cell_size,           1.0f / cell_size, span_of(table.entries),
          span_of(cell_start), span_of(points),  span_of(index)};
}

namespace {

double squared_cell_sizes(const Grid& grid) {
  double squares = 0;
  for (std::size_t k = 0; k + 1 < grid.cell_start.size(); ++k) {
    const double n = grid.cell_start[k + 1] - grid.cell_start[k];
    squares += n * n;
  }
  return squares;
}

}  // namespace

std::vector<Grid> build_grids(Exec& exec, const std::vector<DownsampledCloud>& clouds,
                              const PrepareSettings& options) {
  std::vector<Grid> grids(clouds.size());
  exec.parallel(clouds.size(), [&](std::size_t c) {
    Grid& grid = grids[c];
    const std::vector<Vec3>& points = clouds[c].points;
    // Half the feature radius: a ball overlaps about 5^3 cells, most of them empty, with few points
    // outside the ball.
    grid.cell_size = options.feature_radius * 0.5f;
    const float inverse = 1.0f / grid.cell_size;
    std::vector<KeyIndex> order(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      order[i] = {cell_key(cell_of(points[i], inverse)), static_cast<std::uint32_t>(i)};
    radix_sort(order);
    std::vector<std::uint64_t> keys;
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (i == 0 || order[i].key != order[i - 1].key) {
        keys.push_back(order[i].key);
        grid.cell_start.push_back(static_cast<std::uint32_t>(i));
      }
      grid.points.push_back(points[order[i].index]);
      grid.index.push_back(order[i].index);
    }
    grid.cell_start.push_back(static_cast<std::uint32_t>(points.size()));
    pipeline::check_density(squared_cell_sizes(grid), points.size(), options);
    grid.table.reset(keys.size());
    for (std::size_t k = 0; k < keys.size(); ++k)
      grid.table.insert(keys[k], static_cast<std::uint32_t>(k));
  });
  return grids;
}

}  // namespace gpureg::cpu
