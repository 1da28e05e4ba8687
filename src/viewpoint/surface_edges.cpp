// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/surface_edges.hpp"

#include <algorithm>
#include <utility>

#include "algorithm/cell.hpp"
#include "common/radix_sort.hpp"
#include "common/vector_targets.hpp"

namespace gpureg {
namespace {

/// Nearest neighbours of each point that become edges.
constexpr std::size_t kNeighbors = 12;
/// Points that one thread at a time searches the neighbours of.
constexpr std::size_t kPointsOfPart = 600;

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

/// Places of the points of a cell and of those around it: consecutive points of up to 9 rows. Goes
/// from one cell to a later one.
class Rows {
 public:
  Rows(const Cells& cells, std::size_t first_cell) : cells_(cells) {
    if (first_cell >= cells.keys.size()) return;
    for (std::size_t row = 0; row < 9; ++row)
      first_[row] = static_cast<std::size_t>(
          std::lower_bound(cells.keys.begin(), cells.keys.end(), start(first_cell, row)) -
          cells.keys.begin());
  }
  /// Calls visit(begin, end) for the places of each row.
  template <typename Visit>
  void at(std::size_t cell, const Visit& visit) {
    const std::vector<std::uint64_t>& keys = cells_.keys;
    for (std::size_t row = 0; row < 9; ++row) {
      // Cells of one row have consecutive keys.
      const std::uint64_t first_key = start(cell, row);
      std::size_t& first = first_[row];
      while (first < keys.size() && keys[first] < first_key) ++first;
      std::size_t last = first;
      while (last < keys.size() && keys[last] <= first_key + 2) ++last;
      if (first != last) visit(cells_.begin[first], cells_.begin[last]);
    }
  }

 private:
  /// Key of the first cell of a row about a cell: greater for a later cell.
  std::uint64_t start(std::size_t cell, std::size_t row) const {
    const Cell c = cell_from_key(cells_.keys[cell]);
    return cell_key({c.x - 1, c.y - 1 + static_cast<std::int32_t>(row % 3),
                     c.z - 1 + static_cast<std::int32_t>(row / 3)});
  }

  const Cells& cells_;
  std::size_t first_[9];
};

float cosine_of(Vec3 n, Vec3 m) { return n.x * m.x + n.y * m.y + n.z * m.z; }

struct Pair {
  std::uint32_t a, b;
};

/// Points whose neighbours are searched together, and one number for each.
constexpr std::size_t kTogether = 8;
struct alignas(32) OfEach {
  float of[kTogether];
};

/// Points that may be neighbours of some points.
struct Candidates {
  std::vector<Vec3> position;
  std::vector<std::uint32_t> index;
  std::vector<OfEach> squared;  ///< distances to the points
  /// Places of the nearest ones of each point, the point itself among them: kNeighbors + 1 or all
  /// within the radius, and more where several are at the largest distance.
  std::vector<std::uint32_t> near[kTogether];
  std::size_t found[kTogether];

  void clear() {
    position.clear();
    index.clear();
  }
  void make_room() {
    if (squared.size() >= position.size()) return;
    squared.resize(position.size());
    for (std::vector<std::uint32_t>& of_point : near) of_point.resize(position.size() + 1);
  }
};

void find_nearest(const OfEach (&point)[3], float squared_radius, Candidates& candidates) {
  const std::size_t size = candidates.position.size();
  for (std::size_t k = 0; k < size; ++k)
#pragma omp simd
    for (std::size_t l = 0; l < kTogether; ++l) {
      const Vec3& c = candidates.position[k];
      const float x = point[0].of[l] - c.x, y = point[1].of[l] - c.y, z = point[2].of[l] - c.z;
      candidates.squared[k].of[l] = x * x + y * y + z * z;
    }
  for (std::size_t l = 0; l < kTogether; ++l) {
    std::uint32_t* const near = candidates.near[l].data();
    std::size_t found = 0;
    for (std::uint32_t k = 0; k < size; ++k) {
      near[found] = k;
      found += candidates.squared[k].of[l] <= squared_radius;
    }
    candidates.found[l] = found;
    if (found <= kNeighbors + 1) continue;
    const auto squared = [&](std::uint32_t k) { return candidates.squared[k].of[l]; };
    std::nth_element(near, near + kNeighbors, near + found,
                     [&](std::uint32_t a, std::uint32_t b) { return squared(a) < squared(b); });
    const float limit = squared(near[kNeighbors]);
    candidates.found[l] = static_cast<std::size_t>(
        std::partition(near, near + found, [&](std::uint32_t k) { return squared(k) <= limit; }) -
        near);
  }
}

#ifdef GPUREG_HAS_VECTOR_TARGETS
/// The same in vectors. The least distances stay sorted in registers.
GPUREG_TARGET_8_LANES void find_nearest_in_vectors(const OfEach (&point)[3], float squared_radius,
                                                   Candidates& candidates) {
  const std::size_t size = candidates.position.size();
  OfEach* const squared = candidates.squared.data();
  const __m256 x = _mm256_load_ps(point[0].of), y = _mm256_load_ps(point[1].of),
               z = _mm256_load_ps(point[2].of);
  __m256 least[kNeighbors + 1];
#pragma GCC unroll 13
  for (__m256& l : least) l = _mm256_set1_ps(squared_radius);
  for (std::size_t k = 0; k < size; ++k) {
    const Vec3& c = candidates.position[k];
    const __m256 dx = _mm256_sub_ps(x, _mm256_set1_ps(c.x)),
                 dy = _mm256_sub_ps(y, _mm256_set1_ps(c.y)),
                 dz = _mm256_sub_ps(z, _mm256_set1_ps(c.z));
    __m256 here = _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy)),
                                _mm256_mul_ps(dz, dz));
    _mm256_store_ps(squared[k].of, here);
#pragma GCC unroll 13
    for (__m256& l : least) {
      const __m256 before = l;
      l = _mm256_min_ps(here, before);
      here = _mm256_max_ps(here, before);
    }
  }
  std::fill(candidates.found, candidates.found + kTogether, 0);
  constexpr std::uint32_t kBytes = 32;
  for (std::uint32_t first = 0; first < size; first += kBytes) {
    // A bit per point for each candidate, and then a bit per candidate for each point.
    alignas(32) std::uint8_t is_near[kBytes] = {};
    for (std::uint32_t k = first; k < std::min<std::size_t>(size, first + kBytes); ++k)
      is_near[k - first] = static_cast<std::uint8_t>(_mm256_movemask_ps(
          _mm256_cmp_ps(_mm256_load_ps(squared[k].of), least[kNeighbors], _CMP_LE_OQ)));
    __m256i bits = _mm256_load_si256(reinterpret_cast<const __m256i*>(is_near));
    for (std::size_t l = kTogether; l-- > 0; bits = _mm256_add_epi8(bits, bits)) {
      std::uint32_t* const near = candidates.near[l].data();
      std::size_t found = candidates.found[l];
      for (auto mask = static_cast<unsigned>(_mm256_movemask_epi8(bits)); mask != 0;
           mask &= mask - 1)
        near[found++] = first + static_cast<std::uint32_t>(__builtin_ctz(mask));
      candidates.found[l] = found;
    }
  }
}
#endif

/// The nearest neighbours of the points of some cells.
class PairFinder {
 public:
  PairFinder(const Cells& cells, float radius) : cells_(cells), squared_radius_(radius * radius) {
#ifdef GPUREG_HAS_VECTOR_TARGETS
    if (float_lanes() >= 8) find_nearest_ = find_nearest_in_vectors;
#endif
  }

  std::vector<Pair> pairs_of_cells(std::size_t first, std::size_t last) {
    if (first == last) return {};
    pairs_.resize(kNeighbors * (cells_.begin[last] - cells_.begin[first]) + 1);
    Rows rows(cells_, first);
    for (std::size_t cell = first; cell < last; ++cell) {
      candidates_.clear();
      rows.at(cell, [&](std::uint32_t begin, std::uint32_t end) {
        const auto from = static_cast<std::ptrdiff_t>(begin), to = static_cast<std::ptrdiff_t>(end);
        const auto append = [&](auto& some, const auto& all) {
          some.insert(some.end(), all.begin() + from, all.begin() + to);
        };
        append(candidates_.position, cells_.position);
        append(candidates_.index, cells_.index);
      });
      candidates_.make_room();
      for (std::uint32_t at = cells_.begin[cell]; at < cells_.begin[cell + 1]; at += kTogether)
        add_pairs(at, std::min<std::uint32_t>(kTogether, cells_.begin[cell + 1] - at));
    }
    pairs_.resize(size_);
    return std::move(pairs_);
  }

 private:
  /// Those of `count` points from a place on.
  void add_pairs(std::uint32_t at, std::uint32_t count) {
    OfEach point[3];
    for (std::uint32_t l = 0; l < kTogether; ++l) {
      const Vec3& p = cells_.position[at + std::min(l, count - 1)];
      point[0].of[l] = p.x;
      point[1].of[l] = p.y;
      point[2].of[l] = p.z;
    }
    find_nearest_(point, squared_radius_, candidates_);
    for (std::uint32_t l = 0; l < count; ++l) {
      const std::uint32_t i = cells_.index[at + l];
      if (candidates_.found[l] > kNeighbors + 1) keep_lower_indices(i, l);
      for (std::size_t k = 0; k < candidates_.found[l]; ++k) {
        const std::uint32_t j = candidates_.index[candidates_.near[l][k]];
        pairs_[size_] = {std::min(i, j), std::max(i, j)};
        size_ += j != i;
      }
    }
  }
  /// Of several candidates at the largest distance, the lower indices count.
  void keep_lower_indices(std::uint32_t point, std::uint32_t lane) {
    const auto index = [&](std::uint32_t k) { return candidates_.index[k]; };
    const auto squared = [&](std::uint32_t k) { return candidates_.squared[k].of[lane]; };
    const auto near = candidates_.near[lane].begin();
    const auto end =
        std::remove_if(near, near + static_cast<std::ptrdiff_t>(candidates_.found[lane]),
                       [&](std::uint32_t k) { return index(k) == point; });
    std::nth_element(near, near + kNeighbors, end, [&](std::uint32_t a, std::uint32_t b) {
      return squared(a) != squared(b) ? squared(a) < squared(b) : index(a) < index(b);
    });
    candidates_.found[lane] = kNeighbors;
  }

  const Cells& cells_;
  float squared_radius_;
  void (*find_nearest_)(const OfEach (&)[3], float, Candidates&) = find_nearest;
  Candidates candidates_;
  std::vector<Pair> pairs_;
  std::size_t size_ = 0;
};

/// Second points of the pairs of each first point, ascending, each once. Sorted by buckets: by the
/// second points, then by the first ones.
struct SecondPoints {
  std::vector<std::size_t> begin, end;  ///< of each first point, in second
  std::vector<std::uint32_t> second;

  SecondPoints(std::vector<std::vector<Pair>>& parts, std::size_t points) : begin(points + 1, 0) {
    std::vector<std::size_t> of_second(points + 2, 0);
    begin[0] = 1;  // there is something before the first bucket
    for (const std::vector<Pair>& pairs : parts)
      for (const Pair& pair : pairs) {
        ++begin[pair.a + 1];
        ++of_second[pair.b + 2];
      }
    for (std::size_t i = 0; i < points; ++i) {
      begin[i + 1] += begin[i];
      of_second[i + 2] += of_second[i + 1];
    }
    std::vector<std::uint32_t> first(of_second.back());
    for (std::vector<Pair>& pairs : parts) {
      for (const Pair& pair : pairs) first[of_second[pair.b + 1]++] = pair.a;
      pairs = {};
    }
    end = begin;
    second.resize(begin.back() + 1);
    for (std::uint32_t b = 0; b < points; ++b)
      for (std::size_t k = of_second[b]; k < of_second[b + 1]; ++k) {
        const std::uint32_t a = first[k];
        const std::size_t at = end[a];
        const bool again = (at > begin[a]) & (second[at - 1] == b);
        second[at] = b;
        end[a] = at + !again;
      }
  }
};

}  // namespace

std::vector<SurfaceEdge> surface_edges(const std::vector<Vec3>& points,
                                       const std::vector<Vec3>& normals, float radius,
                                       ThreadGroup& threads) {
  const Cells cells = sorted_into_cells(points, normals, radius);
  const std::size_t parts = 1 + points.size() / kPointsOfPart;
  std::vector<std::vector<Pair>> found(parts);
  threads.parallel(parts, [&](std::size_t part) {
    found[part] = PairFinder(cells, radius)
                      .pairs_of_cells(part * cells.keys.size() / parts,
                                      (part + 1) * cells.keys.size() / parts);
  });
  const SecondPoints of(found, points.size());
  std::size_t count = 0;
  for (std::size_t a = 0; a < points.size(); ++a) count += of.end[a] - of.begin[a];
  std::vector<SurfaceEdge> edges;
  edges.reserve(count);
  for (std::uint32_t a = 0; a < points.size(); ++a)
    for (std::size_t k = of.begin[a]; k < of.end[a]; ++k)
      edges.push_back({a, of.second[k], cosine_of(normals[a], normals[of.second[k]])});
  return edges;
}

}  // namespace gpureg
