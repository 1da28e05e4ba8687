// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>

#include "algorithm/closest_build.hpp"
#include "cpu/common/stages.hpp"
#include "cpu/prepare/candidate_lanes.hpp"
#include "cpu/prepare/reachable_blocks.hpp"
#include "pipeline/checks.hpp"

namespace gpureg::cpu {
namespace {

constexpr int kEdge = ClosestGridView::kBlockEdge;
constexpr int kCells = ClosestGridView::kBlockCells;
/// Keys (32 MB) from which on duplicates are removed in between.
constexpr std::size_t kLeastKeys = std::size_t(1) << 22;

/// Cells along an edge of a part of a block. The points that matter to a part are found once for
/// its cells.
constexpr int kPart = 2;

/// Blocks of a cloud whose candidates are listed before they move to the grid.
constexpr std::size_t kBlocksTogether = 4096;

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

/// Points near a block or a part of it, ascending by index, one array per coordinate. Infinite
/// points fill whole vectors.
struct NearPoints {
  std::vector<float> x, y, z, d2;
  std::vector<std::uint32_t> index;

  void clear() {
    for (auto* v : {&x, &y, &z}) v->clear();
    index.clear();
  }
  void add(Vec3 p, std::uint32_t i) {
    x.push_back(p.x);
    y.push_back(p.y);
    z.push_back(p.z);
    index.push_back(i);
  }
  void pad() {
    const std::size_t whole = (index.size() + kLanes - 1) / kLanes * kLanes;
    for (auto* v : {&x, &y, &z}) v->resize(whole, std::numeric_limits<float>::infinity());
    d2.resize(whole);
  }
  /// Squared distances to a location; returns the least.
  template <typename Lanes>
  GPUREG_ALWAYS_INLINE float measure(Vec3 center) {
    return Lanes::measure(x.data(), y.data(), z.data(), x.size(), center, d2.data());
  }
  /// Calls visit(k) for the points within a distance of the location measured last.
  template <typename Lanes, typename Visit>
  GPUREG_ALWAYS_INLINE void for_each_within(float squared, Visit&& visit) const {
    for (std::size_t begin = 0; begin < x.size(); begin += kLanes)
      for (std::uint32_t mask = Lanes::within(d2.data() + begin, squared); mask != 0;
           mask &= mask - 1)
        visit(begin + static_cast<std::size_t>(__builtin_ctz(mask)));
  }
};

/// Candidates of the cells of a block before they are put in order.
struct CellLists {
  std::uint32_t begin[kCells], count[kCells];
  std::vector<std::uint32_t> candidates;
};

template <typename Lanes>
GPUREG_ALWAYS_INLINE void fill_cell(NearPoints& near, Vec3 center, const ClosestGeometry& g,
                                    std::vector<std::uint32_t>& out) {
  const float nearest2 = near.measure<Lanes>(center), nearest = std::sqrt(nearest2);
  if (!can_reach_cell(nearest, g)) return;
  const float limit = candidate_limit(nearest, g);
  std::size_t first = 0;
  while (near.d2[first] != nearest2) ++first;
  const Vec3 best{near.x[first], near.y[first], near.z[first]};
  for (std::size_t begin = 0; begin < near.x.size(); begin += kLanes) {
    std::uint32_t mask = Lanes::within(&near.d2[begin], limit * limit);
    if (mask == 0) continue;
    mask &= Lanes::undominated(&near.x[begin], &near.y[begin], &near.z[begin], &near.d2[begin],
                               best, nearest2, g);
    for (; mask != 0; mask &= mask - 1) {
      const std::size_t k = begin + static_cast<std::size_t>(__builtin_ctz(mask));
      if (k > first && coincide({near.x[k], near.y[k], near.z[k]}, best)) continue;
      out.push_back(near.index[k]);
    }
  }
}

template <typename Lanes>
GPUREG_ALWAYS_INLINE void fill_block(NearPoints& near, Cell block, const ClosestGeometry& g,
                                     CellLists& out) {
  const float part_edge = static_cast<float>(kPart) * g.cell_size;
  // Of every cell of a part: its centre is this far from that of the part.
  const float offset = kHalfDiagonal * (part_edge - g.cell_size);
  const float slack = 1.0f + 1e-5f;
  NearPoints some;
  for (int part = 0; part < kCells / (kPart * kPart * kPart); ++part) {
    constexpr int kParts = kEdge / kPart;
    const int x = part % kParts * kPart, y = part / kParts % kParts * kPart,
              z = part / (kParts * kParts) * kPart;
    const Cell corner{block.x * kEdge + x, block.y * kEdge + y, block.z * kEdge + z};
    const Vec3 middle =
        cell_center(corner, g.cell_size) + Vec3{0.5f, 0.5f, 0.5f} * (part_edge - g.cell_size);
    const float nearest = std::sqrt(near.measure<Lanes>(middle));
    if (!can_reach_cell((nearest - offset) / slack - g.margin, g)) continue;
    // A candidate of a cell is within candidate_limit() of the centre of the cell, whose nearest
    // point is at most `offset` farther than that of the part.
    const float limit = (candidate_limit(nearest + offset, g) + offset + g.margin) * slack;
    some.clear();
    near.for_each_within<Lanes>(limit * limit, [&](std::size_t k) {
      some.add({near.x[k], near.y[k], near.z[k]}, near.index[k]);
    });
    if (some.index.empty()) continue;
    some.pad();
    for (int k = 0; k < kPart * kPart * kPart; ++k) {
      const Cell c{corner.x + k % kPart, corner.y + k / kPart % kPart,
                   corner.z + k / (kPart * kPart)};
      const int cell = (z + k / (kPart * kPart)) * kEdge * kEdge + (y + k / kPart % kPart) * kEdge +
                       x + k % kPart;
      out.begin[cell] = static_cast<std::uint32_t>(out.candidates.size());
      fill_cell<Lanes>(some, cell_center(c, g.cell_size), g, out.candidates);
      out.count[cell] = static_cast<std::uint32_t>(out.candidates.size()) - out.begin[cell];
    }
    if (out.candidates.size() > limits::kMaxBlockCandidates)
      pipeline::throw_too_dense(g.search_distance);
  }
}

#ifdef GPUREG_WIDE_TARGET
GPUREG_WIDE_TARGET void fill_block_wide(NearPoints& near, Cell block, const ClosestGeometry& g,
                                        CellLists& out) {
  fill_block<WideLanes>(near, block, g, out);
}
#endif

/// @param counts number of candidates of each cell. @return the candidates, cells one after
/// another.
std::vector<std::uint32_t> build_block(const GridView& grid, const std::vector<Vec3>& points,
                                       Cell block, const ClosestGeometry& g,
                                       std::uint32_t* counts) {
  NearPoints near;
  for (const std::uint32_t i : points_near_block(grid, cell_center(block, block_edge(g)), g))
    near.add(points[i], i);
  near.pad();
  CellLists lists{};
  if (!near.index.empty()) {
#ifdef GPUREG_WIDE_TARGET
    if (has_wide_vectors())
      fill_block_wide(near, block, g, lists);
    else
#endif
      fill_block<NarrowLanes>(near, block, g, lists);
  }
  std::copy(lists.count, lists.count + kCells, counts);
  std::vector<std::uint32_t> out;
  out.reserve(lists.candidates.size());
  for (int cell = 0; cell < kCells; ++cell)
    out.insert(out.end(), lists.candidates.begin() + lists.begin[cell],
               lists.candidates.begin() + lists.begin[cell] + lists.count[cell]);
  return out;
}

/// A grid while it is built, some blocks at a time: of a large cloud, the candidates take most of
/// the memory of a preparation, so that they are never there twice.
struct GrowingGrid {
  ClosestGeometry geometry;
  std::vector<std::uint64_t> keys;
  std::vector<std::uint32_t> cell_start;
  std::vector<std::vector<std::uint32_t>> lists;       // of the blocks at hand
  std::vector<std::vector<std::uint32_t>> candidates;  // of all blocks before, in pieces
  std::size_t done = 0, total = 0;

  std::size_t at_hand() const { return std::min(kBlocksTogether, keys.size() - done); }
  std::uint32_t* starts(std::size_t block) { return &cell_start[block * (kCells + 1)]; }

  /// Moves the blocks at hand to those before.
  void add_lists() {
    std::size_t size = 0;
    for (const auto& list : lists) size += list.size();
    std::vector<std::uint32_t> piece;
    piece.reserve(size);
    std::uint32_t offset = static_cast<std::uint32_t>(total);
    for (const auto& list : lists) {
      piece.insert(piece.end(), list.begin(), list.end());
      std::uint32_t* start = starts(done++);
      for (int cell = 0; cell < kCells; ++cell) {
        const std::uint32_t count = start[cell];
        start[cell] = offset;
        offset += count;
      }
      start[kCells] = offset;
    }
    lists.clear();
    total += size;
    candidates.push_back(std::move(piece));
  }

  std::vector<std::uint32_t> all_candidates() {
    if (candidates.size() == 1) return std::move(candidates.front());
    std::vector<std::uint32_t> out;
    out.reserve(total);
    for (auto& piece : candidates) {
      out.insert(out.end(), piece.begin(), piece.end());
      piece = {};
    }
    return out;
  }
};

bool same_points(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](Vec3 p, Vec3 q) {
           return p.x == q.x && p.y == q.y && p.z == q.z;
         });
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

std::vector<std::shared_ptr<const ClosestGrid>> build_closest_grids(
    Exec& exec, const std::vector<DownsampledCloud>& clouds, const std::vector<Grid>& grids,
    const PrepareSettings& options) {
  std::vector<std::shared_ptr<const ClosestGrid>> out(clouds.size());
  std::vector<GrowingGrid> growing(clouds.size());
  // Both sides of a cloud come one after the other, and the grid knows no sides.
  const auto same_as_previous = [&](std::size_t c) {
    return c > 0 && clouds[c].radius == clouds[c - 1].radius &&
           same_points(clouds[c].points, clouds[c - 1].points);
  };
  exec.parallel(clouds.size(), [&](std::size_t c) {
    if (clouds[c].matched_only || same_as_previous(c)) return;
    GrowingGrid& g = growing[c];
    g.geometry = closest_geometry(options.max_correspondence_distance, clouds[c].radius);
    g.keys = reachable_blocks(clouds[c].points, g.geometry, kLeastKeys);
    g.cell_start.resize(g.keys.size() * (kCells + 1));
  });
  const auto unfinished = [](const GrowingGrid& g) { return g.done < g.keys.size(); };
  while (std::any_of(growing.begin(), growing.end(), unfinished)) {
    for (GrowingGrid& g : growing) g.lists.resize(g.at_hand());
    exec.parallel_items(
        clouds.size(), [&](std::size_t c) { return growing[c].lists.size(); }, 16,
        [&](std::size_t c, std::size_t begin, std::size_t end) {
          GrowingGrid& g = growing[c];
          const GridView grid = grids[c].view();
          for (std::size_t k = begin; k < end; ++k)
            g.lists[k] = build_block(grid, clouds[c].points, cell_from_key(g.keys[g.done + k]),
                                     g.geometry, g.starts(g.done + k));
        });
    exec.parallel(clouds.size(), [&](std::size_t c) {
      if (!unfinished(growing[c])) return;
      growing[c].add_lists();
      if (pipeline::too_many_candidates(growing[c].total, clouds[c].points.size()))
        pipeline::throw_too_dense(options.max_correspondence_distance);
    });
  }
  exec.parallel(clouds.size(), [&](std::size_t c) {
    if (same_as_previous(c)) return;
    auto kept = std::make_shared<ClosestGrid>();
    out[c] = kept;
    ClosestGrid& grid = *kept;
    GrowingGrid& g = growing[c];
    grid.cell_size = g.geometry.cell_size;
    grid.table.reset(g.keys.size());
    for (std::size_t b = 0; b < g.keys.size(); ++b) {
      grid.table.insert(g.keys[b], static_cast<std::uint32_t>(b));
      grid.blocks.push_back(cell_from_key(g.keys[b]));
    }
    grid.cell_start = std::move(g.cell_start);
    grid.candidates = g.all_candidates();
  });
  for (std::size_t c = 0; c < clouds.size(); ++c)
    if (same_as_previous(c)) out[c] = out[c - 1];
  return out;
}

}  // namespace gpureg::cpu
