// SPDX-License-Identifier: BSD-3-Clause
#include "spacing/stray_points.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "algorithm/closest_build.hpp"
#include "common/limits.hpp"
#include "common/radix_sort.hpp"
#include "common/shown.hpp"
#include "gpureg/error.hpp"
#include "pipeline/checks.hpp"

namespace gpureg {
namespace {

/// Fewer points than this around a location have no normal.
constexpr std::uint32_t kNormalPoints = 3;
/// A cloud with a smaller share of other points has nothing to align.
constexpr std::uint64_t kLeastShare = 100;

/// A box of rows. quick: of all coordinates that are numbers; else of the finite rows.
struct Box {
  float lo[3], hi[3];
  std::uint64_t finite = 0;

  Box(const RawCloud& raw, bool quick) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    std::fill(lo, lo + 3, inf);
    std::fill(hi, hi + 3, -inf);
    const std::size_t together = quick && raw.point_stride == 3 ? raw.size / kRows : 0;
    if (together > 0) add_rows(raw.points, together);
    finite = together * kRows;
    for (std::size_t i = together * kRows; i < raw.size; ++i) {
      const float* p = raw.points + i * raw.point_stride;
      if (!quick && !all_finite({p[0], p[1], p[2]})) continue;
      ++finite;
      for (int k = 0; k < 3; ++k) {
        lo[k] = p[k] < lo[k] ? p[k] : lo[k];
        hi[k] = p[k] > hi[k] ? p[k] : hi[k];
      }
    }
  }
  /// Coordinates of several rows side by side, as vector instructions take them.
  static constexpr std::size_t kRows = 8;
  void add_rows(const float* p, std::size_t times) {
    float low[3 * kRows], high[3 * kRows];
    for (std::size_t l = 0; l < 3 * kRows; ++l) low[l] = lo[l % 3], high[l] = hi[l % 3];
    for (std::size_t k = 0; k < times; ++k, p += 3 * kRows)
      for (std::size_t l = 0; l < 3 * kRows; ++l) {
        low[l] = p[l] < low[l] ? p[l] : low[l];
        high[l] = p[l] > high[l] ? p[l] : high[l];
      }
    for (std::size_t l = 0; l < 3 * kRows; ++l) {
      lo[l % 3] = std::min(lo[l % 3], low[l]);
      hi[l % 3] = std::max(hi[l % 3], high[l]);
    }
  }
  double size(int k) const { return static_cast<double>(hi[k]) - static_cast<double>(lo[k]); }
  double diagonal() const {
    return std::sqrt(size(0) * size(0) + size(1) * size(1) + size(2) * size(2));
  }
  double blocks(float edge, float reach) const {
    double product = 1;
    for (int k = 0; k < 3; ++k)
      product *=
          std::floor((size(k) + 2 * static_cast<double>(reach)) / static_cast<double>(edge)) + 2;
    return product;
  }
};

ClosestGeometry geometry_of(const Box& box, const PrepareSettings& options) {
  return closest_geometry(options.max_correspondence_distance,
                          0.5f * static_cast<float>(box.diagonal()));
}

struct Place {
  double at[3];
};

Place place_of(const float* p, double shift) {
  Place out;
  for (int k = 0; k < 3; ++k) out.at[k] = static_cast<double>(p[k]) + shift;
  return out;
}

/// Cells of an edge. Those of the box start at 1, so that each has a cell before it; they fit keys
/// where in_range() says so.
struct Lattice {
  double edge, corner[3];

  Lattice(const Box& box, double cell_edge) : edge(cell_edge) {
    for (int k = 0; k < 3; ++k)
      corner[k] = (std::floor(static_cast<double>(box.lo[k]) / edge) - 1) * edge;
  }
  bool in_range(const Box& box) const {
    return box.diagonal() / edge < static_cast<double>(limits::kMaxCells) - 4;
  }
  std::int32_t along(int axis, const Place& p) const {
    return static_cast<std::int32_t>(std::floor((p.at[axis] - corner[axis]) / edge));
  }
  Cell of(const Place& p) const { return {along(0, p), along(1, p), along(2, p)}; }
  Place center(Cell c) const {
    return {{corner[0] + edge * (c.x + 0.5), corner[1] + edge * (c.y + 0.5),
             corner[2] + edge * (c.z + 0.5)}};
  }
};

/// A set of keys of cells, as large as its content asks for.
class KeySet {
 public:
  KeySet() : slots_(std::size_t(1) << 12, kEmptyKey) {}
  std::size_t size() const { return size_; }
  void add(std::uint64_t key) {
    if (!place(key)) return;
    if (2 * ++size_ > slots_.size()) grow();
  }

 private:
  bool place(std::uint64_t key) {
    const std::uint32_t mask = static_cast<std::uint32_t>(slots_.size()) - 1;
    std::uint32_t slot = cell_slot(key, mask);
    while (slots_[slot] != kEmptyKey && slots_[slot] != key) slot = (slot + 1) & mask;
    const bool is_new = slots_[slot] != key;
    slots_[slot] = key;
    return is_new;
  }
  void grow() {
    std::vector<std::uint64_t> before(2 * slots_.size(), kEmptyKey);
    before.swap(slots_);
    for (const std::uint64_t key : before)
      if (key != kEmptyKey) place(key);
  }

  std::vector<std::uint64_t> slots_;
  std::size_t size_ = 0;
};

bool is_finite(const RawCloud& raw, std::size_t i) {
  const float* p = raw.points + i * raw.point_stride;
  return all_finite({p[0], p[1], p[2]});
}

/// True where the blocks within reach of the points are more than `most`.
bool exceeds(const RawCloud& raw, const Lattice& blocks, double reach, std::uint64_t most) {
  KeySet keys;
  Cell last_lo{-1, -1, -1}, last_hi = last_lo;
  const auto same = [](Cell a, Cell b) { return a.x == b.x && a.y == b.y && a.z == b.z; };
  for (std::size_t i = 0; i < raw.size; ++i) {
    if (!is_finite(raw, i)) continue;
    const float* p = raw.points + i * raw.point_stride;
    const Cell lo = blocks.of(place_of(p, -reach)), hi = blocks.of(place_of(p, reach));
    if (same(lo, last_lo) && same(hi, last_hi)) continue;
    last_lo = lo, last_hi = hi;
    for (std::int32_t z = lo.z; z <= hi.z; ++z)
      for (std::int32_t y = lo.y; y <= hi.y; ++y)
        for (std::int32_t x = lo.x; x <= hi.x; ++x) keys.add(cell_key({x, y, z}));
    if (keys.size() > most) return true;
  }
  return false;
}

/// Cells with the rows in them, in the order of their keys.
struct CellRows {
  std::vector<KeyIndex> order;
  std::vector<std::size_t> begin;     // per cell, and the end
  std::vector<std::uint32_t> voxels;  // per cell, at most kNormalPoints
  std::size_t size() const { return voxels.size(); }
  std::uint64_t key(std::size_t cell) const { return order[begin[cell]].key; }
};

/// Centroids within the normal radius of each other are of voxels in neighbouring cells.
CellRows sort_into_cells(const RawCloud& raw, const Box& box, const PrepareSettings& options) {
  const double voxel = static_cast<double>(options.voxel_size);
  const Lattice voxels(box, voxel > 0 ? voxel : 1),
      cells(box, static_cast<double>(options.normal_radius) + voxel);
  const auto voxel_of_row = [&](std::size_t row) {
    return voxels.of(place_of(raw.points + row * raw.point_stride, 0));
  };
  CellRows out;
  for (std::size_t i = 0; i < raw.size; ++i) {
    if (!is_finite(raw, i)) continue;
    const Place p =
        voxel > 0 ? voxels.center(voxel_of_row(i)) : place_of(raw.points + i * raw.point_stride, 0);
    out.order.push_back({cell_key(cells.of(p)), static_cast<std::uint32_t>(i)});
  }
  radix_sort(out.order);
  std::uint64_t seen[kNormalPoints];
  for (std::size_t k = 0; k < out.order.size(); ++k) {
    if (k == 0 || out.order[k].key != out.order[k - 1].key) {
      out.begin.push_back(k);
      out.voxels.push_back(0);
    }
    std::uint32_t& count = out.voxels.back();
    if (count == kNormalPoints) continue;
    seen[count] = voxel > 0 ? cell_key(voxel_of_row(out.order[k].index)) : k;
    count += std::find(seen, seen + count, seen[count]) == seen + count;
  }
  out.begin.push_back(out.order.size());
  return out;
}

/// Of each cell: voxels in it and in the 26 around it.
std::vector<std::uint32_t> voxels_around(const CellRows& cells) {
  std::vector<std::uint32_t> sums(cells.size(), 0);
  for (int row = 0; row < 9; ++row) {
    // Three cells along x have keys one after another; they move on as the keys ascend.
    const std::int64_t y = row % 3 - 1, z = row / 3 - 1;
    const std::int64_t shift = (z * (std::int64_t(1) << (2 * limits::kCellBits))) +
                               (y * (std::int64_t(1) << limits::kCellBits)) - 1;
    std::size_t first = 0;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const std::uint64_t key = cells.key(k) + static_cast<std::uint64_t>(shift);
      while (first < cells.size() && cells.key(first) < key) ++first;
      for (std::size_t at = first; at < cells.size() && cells.key(at) <= key + 2; ++at)
        sums[k] += cells.voxels[at];
    }
  }
  return sums;
}

/// Rows that are neither stray nor invalid, ascending.
std::vector<std::uint32_t> rows_with_neighbors(const RawCloud& raw, const Box& box,
                                               const PrepareSettings& options) {
  const CellRows cells = sort_into_cells(raw, box, options);
  const std::vector<std::uint32_t> around = voxels_around(cells);
  std::vector<std::uint32_t> rows;
  for (std::size_t c = 0; c < cells.size(); ++c)
    if (around[c] >= kNormalPoints)
      for (std::size_t k = cells.begin[c]; k < cells.begin[c + 1]; ++k)
        rows.push_back(cells.order[k].index);
  std::sort(rows.begin(), rows.end());
  return rows;
}

std::string extent_of(const Box& box) {
  return shown(box.size(0), 6) + " x " + shown(box.size(1), 6) + " x " + shown(box.size(2), 6);
}

/// As pipeline::check_density() says it of a cloud without other points.
[[noreturn]] void throw_isolated(const Box& box, const PrepareSettings& options) {
  throw InvalidArgument("nearly all of " + std::to_string(box.finite) +
                        " points are isolated within normal_radius " +
                        shown(options.normal_radius) + ", in " + extent_of(box) + ": " +
                        pipeline::resolution_of(options) +
                        " or the radii are too small for the cloud; are they in the unit of the "
                        "points?");
}

[[noreturn]] void throw_too_wide(const Box& box, std::uint64_t stray,
                                 const PrepareSettings& options) {
  throw InvalidArgument(
      std::to_string(box.finite) + " points in " + extent_of(box) + ", " + std::to_string(stray) +
      " of them without two others within normal_radius " + shown(options.normal_radius) +
      ", are too few for " + pipeline::resolution_of(options) +
      ": a search for the closest of them would exhaust the memory; use a larger voxel_size, "
      "remove stray points, or check the unit of the points");
}

}  // namespace

WithoutStrayPoints::WithoutStrayPoints(const RawCloud& raw, const PrepareSettings& options)
    : kept_(raw), input_points_(raw.size) {
  const std::uint64_t most = std::max<std::uint64_t>(
      limits::kMaxClosestBlocks,
      static_cast<std::uint64_t>(limits::kBlocksPerPoint * static_cast<double>(raw.size)));
  constexpr std::uint64_t kBlocksOfPoint = 8;
  if (raw.size <= most / kBlocksOfPoint) return;
  const auto fits = [&](const Box& box) {
    const ClosestGeometry g = geometry_of(box, options);
    return box.blocks(block_edge(g), point_reach(g)) <= static_cast<double>(most);
  };
  if (fits(Box(raw, true))) return;
  const Box box(raw, false);
  if (box.finite == 0 || fits(box)) return;
  const ClosestGeometry g = geometry_of(box, options);
  const double edge = static_cast<double>(block_edge(g)),
               reach = static_cast<double>(point_reach(g));
  const Lattice blocks(box, edge);
  // A cloud out of range is refused by pipeline::check_extent().
  if (!Lattice(box, static_cast<double>(options.voxel_size > 0 ? options.voxel_size
                                                               : options.normal_radius))
           .in_range(box) ||
      !blocks.in_range(box) || !exceeds(raw, blocks, reach, most))
    return;
  rows_ = rows_with_neighbors(raw, box, options);
  invalid_points_ = raw.size - box.finite;
  stray_points_ = box.finite - rows_.size();
  if (rows_.size() * kLeastShare < box.finite) throw_isolated(box, options);
  kept_.keep(raw, rows_);
  if (exceeds(cloud(), blocks, reach, most)) throw_too_wide(box, stray_points_, options);
}

void WithoutStrayPoints::count(PrepareStatistics& statistics) const {
  statistics.input_points = input_points_;
  statistics.invalid_points += invalid_points_;
  statistics.stray_points = stray_points_;
}

}  // namespace gpureg
