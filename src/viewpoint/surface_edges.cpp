// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/surface_edges.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "algorithm/cell.hpp"
#include "common/host_threads.hpp"
#include "common/radix_sort.hpp"

namespace gpureg {
namespace {

/// Nearest neighbours of each point that become edges.
constexpr std::size_t kNeighbors = 12;

/// Points in the order of their cells, whose edge is the radius of neighbours.
struct Cells {
  std::vector<std::uint32_t> index;  ///< of the points
  std::vector<Vec3> position;
  std::vector<std::uint64_t> keys;   ///< of the cells
  std::vector<std::uint32_t> begin;  ///< of the points of each cell, and the end
};

Cells sorted_into_cells(const std::vector<Vec3>& points, const std::vector<Vec3>& normals,
                        float radius) {
  const float inverse = 1.0f / radius;
  std::vector<KeyIndex> order;
  order.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (!is_zero(normals[i])) order.push_back({cell_key(cell_of(points[i], inverse)), i});
  radix_sort(order);
  Cells cells;
  cells.index.reserve(order.size());
  cells.position.reserve(order.size());
  for (std::uint32_t k = 0; k < order.size(); ++k) {
    cells.index.push_back(order[k].index);
    cells.position.push_back(points[order[k].index]);
    if (k > 0 && order[k].key == order[k - 1].key) continue;
    cells.keys.push_back(order[k].key);
    cells.begin.push_back(k);
  }
  cells.begin.push_back(static_cast<std::uint32_t>(order.size()));
  return cells;
}

/// Places of the points of a cell and of those around it: consecutive points of up to 9 rows.
struct Rows {
  std::uint32_t begin[9], end[9];
  std::uint32_t size = 0;

  Rows(const Cells& cells, std::uint64_t key) {
    const Cell cell = cell_from_key(key);
    for (std::int32_t z = cell.z - 1; z <= cell.z + 1; ++z)
      for (std::int32_t y = cell.y - 1; y <= cell.y + 1; ++y) {
        // Cells of one row have consecutive keys.
        const std::uint64_t first = cell_key({cell.x - 1, y, z});
        auto at = std::lower_bound(cells.keys.begin(), cells.keys.end(), first);
        const auto from = at - cells.keys.begin();
        while (at != cells.keys.end() && *at <= first + 2) ++at;
        const auto to = at - cells.keys.begin();
        if (from == to) continue;
        begin[size] = cells.begin[static_cast<std::size_t>(from)];
        end[size++] = cells.begin[static_cast<std::size_t>(to)];
      }
  }
};

// Without fused operations: those are calls of a function where the processor may lack them.
float squared_distance(Vec3 p, Vec3 q) {
  const float x = p.x - q.x, y = p.y - q.y, z = p.z - q.z;
  return x * x + y * y + z * z;
}

float cosine_of(Vec3 n, Vec3 m) { return n.x * m.x + n.y * m.y + n.z * m.z; }

/// A squared distance and an index as one word that sorts by the one, then by the other.
std::uint64_t packed(float squared, std::uint32_t index) {
  std::uint32_t bits;
  std::memcpy(&bits, &squared, sizeof bits);  // not negative: its bits sort like the number
  return std::uint64_t(bits) << 32 | index;
}

struct Pair {
  std::uint32_t a, b;
};

/// The nearest neighbours of the points of some cells.
std::vector<Pair> pairs_of_cells(const Cells& cells, std::size_t first, std::size_t last,
                                 float radius) {
  std::vector<Pair> pairs;
  std::vector<std::uint64_t> near;
  for (std::size_t cell = first; cell < last; ++cell) {
    const Rows rows(cells, cells.keys[cell]);
    std::size_t candidates = 0;
    for (std::uint32_t r = 0; r < rows.size; ++r) candidates += rows.end[r] - rows.begin[r];
    near.resize(candidates + 1);
    for (std::uint32_t at = cells.begin[cell]; at < cells.begin[cell + 1]; ++at) {
      std::size_t found = 0;
      for (std::uint32_t r = 0; r < rows.size; ++r)
        for (std::uint32_t k = rows.begin[r]; k < rows.end[r]; ++k) {
          const float squared = squared_distance(cells.position[at], cells.position[k]);
          near[found] = packed(squared, cells.index[k]);
          found += (squared <= radius * radius) & (k != at);
        }
      if (found > kNeighbors)
        std::nth_element(near.begin(), near.begin() + kNeighbors,
                         near.begin() + static_cast<std::ptrdiff_t>(found));
      const std::uint32_t i = cells.index[at];
      for (std::size_t k = 0; k < std::min(found, kNeighbors); ++k) {
        const auto j = static_cast<std::uint32_t>(near[k]);
        pairs.push_back({std::min(i, j), std::max(i, j)});
      }
    }
  }
  return pairs;
}

}  // namespace

std::vector<SurfaceEdge> surface_edges(const std::vector<Vec3>& points,
                                       const std::vector<Vec3>& normals, float radius,
                                       std::size_t threads) {
  const Cells cells = sorted_into_cells(points, normals, radius);
  const std::size_t parts = std::max<std::size_t>(threads, 1);
  std::vector<std::vector<Pair>> found(parts);
  on_threads(parts, [&](std::size_t part) {
    found[part] = pairs_of_cells(cells, part * cells.keys.size() / parts,
                                 (part + 1) * cells.keys.size() / parts, radius);
  });

  // Sorted by buckets, one for each first point.
  std::vector<std::size_t> begin(points.size() + 2, 0);
  for (const std::vector<Pair>& pairs : found)
    for (const Pair& pair : pairs) ++begin[pair.a + 2];
  for (std::size_t i = 2; i < begin.size(); ++i) begin[i] += begin[i - 1];
  std::vector<std::uint32_t> second(begin.back());
  for (std::vector<Pair>& pairs : found) {
    for (const Pair& pair : pairs) second[begin[pair.a + 1]++] = pair.b;
    pairs = {};
  }
  std::vector<std::vector<SurfaceEdge>> edges(parts);
  on_threads(parts, [&](std::size_t part) {
    for (std::size_t a = part * points.size() / parts; a < (part + 1) * points.size() / parts;
         ++a) {
      const auto from = second.begin() + static_cast<std::ptrdiff_t>(begin[a]),
                 to = second.begin() + static_cast<std::ptrdiff_t>(begin[a + 1]);
      std::sort(from, to);
      const auto end = std::unique(from, to);
      for (auto b = from; b != end; ++b)
        edges[part].push_back(
            {static_cast<std::uint32_t>(a), *b, cosine_of(normals[a], normals[*b])});
    }
  });
  for (std::size_t part = 1; part < parts; ++part) {
    edges[0].insert(edges[0].end(), edges[part].begin(), edges[part].end());
    edges[part] = {};
  }
  return std::move(edges[0]);
}

}  // namespace gpureg
