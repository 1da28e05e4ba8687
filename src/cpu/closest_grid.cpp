// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "algorithm/closest_build.hpp"
#include "cpu/reachable_blocks.hpp"
#include "cpu/stages.hpp"
#include "pipeline/checks.hpp"

namespace gpureg::cpu {
namespace {

constexpr int kEdge = ClosestGridView::kBlockEdge;
constexpr int kCells = ClosestGridView::kBlockCells;
/// Keys (32 MB) from which on duplicates are removed in between.
constexpr std::size_t kLeastKeys = std::size_t(1) << 22;

struct BlockLists {
  std::vector<std::uint32_t> counts;      // per cell
  std::vector<std::uint32_t> candidates;  // cells one after another
};

/// Points within the search distance of the block, ascending by index.
std::vector<std::uint32_t> points_near_block(const GridView& grid, Vec3 center,
                                             const ClosestGeometry& g) {
  const float reach = block_reach(g);
  const Cell lo =
      cell_of({center.x - reach, center.y - reach, center.z - reach}, grid.inverse_cell_size);
  const Cell hi =
      cell_of({center.x + reach, center.y + reach, center.z + reach}, grid.inverse_cell_size);
  std::vector<std::uint32_t> near;
  for (std::int32_t z = lo.z; z <= hi.z; ++z)
    for (std::int32_t y = lo.y; y <= hi.y; ++y)
      for (std::int32_t x = lo.x; x <= hi.x; ++x) {
        const std::uint32_t cell = find_cell(grid.table, cell_key({x, y, z}));
        if (cell == kNoValue) continue;
        for (std::uint32_t k = grid.cell_start[cell]; k < grid.cell_start[cell + 1]; ++k) {
          const Vec3 d = grid.points[k] - center;
          if (std::fabs(d.x) <= reach && std::fabs(d.y) <= reach && std::fabs(d.z) <= reach)
            near.push_back(grid.index[k]);
        }
      }
  std::sort(near.begin(), near.end());
  return near;
}

void build_block(const GridView& grid, const std::vector<Vec3>& points, Cell block,
                 const ClosestGeometry& g, BlockLists& out) {
  const Vec3 block_center = cell_center(block, block_edge(g));
  const std::vector<std::uint32_t> near = points_near_block(grid, block_center, g);
  const std::size_t n = near.size();
  std::vector<float> x(n), y(n), z(n), d2(n);
  for (std::size_t k = 0; k < n; ++k) {
    x[k] = points[near[k]].x;
    y[k] = points[near[k]].y;
    z[k] = points[near[k]].z;
  }
  out.counts.assign(kCells, 0);
  for (int cell = 0; cell < kCells; ++cell) {
    const Cell c{block.x * kEdge + (cell & 7), block.y * kEdge + ((cell >> 3) & 7),
                 block.z * kEdge + (cell >> 6)};
    const Vec3 center = cell_center(c, g.cell_size);
    float nearest2 = 3.402823466e38f;
    for (std::size_t k = 0; k < n; ++k) {
      const float dx = x[k] - center.x, dy = y[k] - center.y, dz = z[k] - center.z;
      d2[k] = fmaf(dz, dz, fmaf(dy, dy, dx * dx));
      nearest2 = d2[k] < nearest2 ? d2[k] : nearest2;
    }
    const float nearest = std::sqrt(nearest2);
    if (n == 0 || !can_reach_cell(nearest, g)) continue;
    const float limit = candidate_limit(nearest, g);
    const float limit2 = limit * limit;
    std::size_t first = 0;
    while (d2[first] != nearest2) ++first;
    const Vec3 best = points[near[first]];
    for (std::size_t k = 0; k < n; ++k) {
      if (d2[k] > limit2) continue;
      const Vec3 p{x[k], y[k], z[k]};
      if (k != first && !can_win_in_cell(center, best, p, k > first, g)) continue;
      out.candidates.push_back(near[k]);
      ++out.counts[cell];
    }
    if (out.candidates.size() > limits::kMaxBlockCandidates)
      pipeline::throw_too_dense(g.search_distance);
  }
}

}  // namespace

std::vector<std::uint64_t> reachable_blocks(const std::vector<Vec3>& points,
                                            const ClosestGeometry& g, std::size_t least_keys) {
  const float inverse = 1.0f / block_edge(g);
  const float reach = point_reach(g);
  std::vector<std::uint64_t> keys;
  std::size_t most_keys = least_keys;
  const auto remove_duplicates = [&] {
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  };
  for (const Vec3& p : points) {
    const Cell lo = cell_of({p.x - reach, p.y - reach, p.z - reach}, inverse);
    const Cell hi = cell_of({p.x + reach, p.y + reach, p.z + reach}, inverse);
    for (std::int32_t z = lo.z; z <= hi.z; ++z)
      for (std::int32_t y = lo.y; y <= hi.y; ++y)
        for (std::int32_t x = lo.x; x <= hi.x; ++x) {
          const std::uint64_t key = cell_key({x, y, z});
          if (keys.empty() || keys.back() != key) keys.push_back(key);
        }
    if (keys.size() > most_keys) {
      remove_duplicates();
      // A large map has more blocks than the first limit: sorting them all for every few points
      // would never end.
      most_keys = std::max(least_keys, 2 * keys.size());
    }
  }
  remove_duplicates();
  return keys;
}

ClosestGridView ClosestGrid::view() const {
  return {1.0f / cell_size, span_of(table.entries), span_of(cell_start), span_of(candidates)};
}

std::vector<ClosestGrid> build_closest_grids(Exec& exec,
                                             const std::vector<DownsampledCloud>& clouds,
                                             const std::vector<Grid>& grids,
                                             const PrepareOptions& options) {
  std::vector<ClosestGrid> out(clouds.size());
  std::vector<ClosestGeometry> geometry(clouds.size());
  std::vector<std::vector<std::uint64_t>> keys(clouds.size());
  std::vector<std::vector<BlockLists>> lists(clouds.size());
  exec.parallel(clouds.size(), [&](std::size_t c) {
    geometry[c] = closest_geometry(options.max_correspondence_distance, clouds[c].radius);
    keys[c] = reachable_blocks(clouds[c].points, geometry[c], kLeastKeys);
    lists[c].resize(keys[c].size());
  });
  exec.parallel_items(
      clouds.size(), [&](std::size_t c) { return keys[c].size(); }, 16,
      [&](std::size_t c, std::size_t begin, std::size_t end) {
        const GridView grid = grids[c].view();
        for (std::size_t b = begin; b < end; ++b)
          build_block(grid, clouds[c].points, cell_from_key(keys[c][b]), geometry[c], lists[c][b]);
      });
  exec.parallel(clouds.size(), [&](std::size_t c) {
    ClosestGrid& grid = out[c];
    grid.cell_size = geometry[c].cell_size;
    std::size_t total = 0;
    for (const BlockLists& l : lists[c]) total += l.candidates.size();
    if (pipeline::too_many_candidates(total, clouds[c].points.size()))
      pipeline::throw_too_dense(options.max_correspondence_distance);
    grid.table.reset(keys[c].size());
    grid.cell_start.reserve(keys[c].size() * (kCells + 1));
    grid.candidates.reserve(total);
    for (std::size_t b = 0; b < keys[c].size(); ++b) {
      grid.table.insert(keys[c][b], static_cast<std::uint32_t>(b));
      grid.blocks.push_back(cell_from_key(keys[c][b]));
      std::uint32_t offset = static_cast<std::uint32_t>(grid.candidates.size());
      for (int cell = 0; cell < kCells; ++cell) {
        grid.cell_start.push_back(offset);
        offset += lists[c][b].counts[cell];
      }
      grid.cell_start.push_back(offset);
      grid.candidates.insert(grid.candidates.end(), lists[c][b].candidates.begin(),
                             lists[c][b].candidates.end());
      lists[c][b] = BlockLists();  // a map's lists take as much memory as its grid
    }
  });
  return out;
}

}  // namespace gpureg::cpu
