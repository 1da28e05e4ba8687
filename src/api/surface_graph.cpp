// SPDX-License-Identifier: BSD-3-Clause
#include "api/surface_graph.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <thread>
#include <utility>

#include "algorithm/cell.hpp"
#include "common/host_threads.hpp"

namespace gpureg {
namespace {

/// Nearest neighbours of each point that become edges.
constexpr std::size_t kNeighbors = 12;
/// Largest number of edges that contradiction() reads; a share of so many is good to 0.1 %.
constexpr std::size_t kCountedEdges = 40'000;
/// Points from which another thread is worth its start, and the most threads.
constexpr std::size_t kPointsPerThread = 50'000, kMostThreads = 8;
/// Below this cosine two neighbours lie on different surfaces and tell nothing about each other.
constexpr float kSameSurface = 0.5f;

double weight_of(float cosine) {
  return std::fabs(cosine) < kSameSurface ? 0.0 : static_cast<double>(cosine) * cosine;
}

double share(double part, double whole) { return whole > 0 ? part / whole : 0.0; }

/// Sets of connected points, each with the parity of its sign to that of its root.
class SignedSets {
 public:
  explicit SignedSets(std::size_t size) : parent_(size), flipped_(size, 0) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t(0));
  }
  /// Root of a point, and whether the point has the other sign.
  std::pair<std::uint32_t, bool> find(std::uint32_t point) {
    std::uint32_t root = point;
    bool flipped = false;
    for (; parent_[root] != root; root = parent_[root]) flipped ^= flipped_[root] != 0;
    for (bool rest = flipped; parent_[point] != point;) {
      const std::uint32_t next = parent_[point];
      const bool step = flipped_[point] != 0;
      parent_[point] = root;
      flipped_[point] = rest;
      rest ^= step;
      point = next;
    }
    return {root, flipped};
  }
  void join(std::uint32_t a, std::uint32_t b, bool opposite) {
    const auto [root_a, flipped_a] = find(a);
    const auto [root_b, flipped_b] = find(b);
    if (root_a == root_b) return;
    // The lower index stays the root, so that the result depends on the order of the edges alone.
    const auto [root, child] = std::minmax(root_a, root_b);
    parent_[child] = root;
    flipped_[child] = (flipped_a != flipped_b) != opposite;
  }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint8_t> flipped_;
};

}  // namespace

SurfaceGraph::SurfaceGraph(std::vector<Vec3> points, std::vector<Vec3> normals, float radius)
    : points_(std::move(points)), normals_(std::move(normals)), radius_(radius) {
  add_edges(radius);
  choose_counted();
}

void SurfaceGraph::choose_counted() {
  const std::size_t stride = std::max<std::size_t>(1, edges_.size() / kCountedEdges);
  for (std::size_t k = 0; k < edges_.size(); k += stride) counted_.push_back(edges_[k]);
  // A viewpoint is compared with the ends of these edges alone: in a large map hardly any points.
  std::vector<std::uint32_t> place(points_.size(), 0);
  for (const Edge& e : counted_) place[e.a] = place[e.b] = 1;
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    if (place[i] == 0) continue;
    place[i] = static_cast<std::uint32_t>(counted_ends_.size());
    counted_ends_.push_back(i);
  }
  for (Edge& e : counted_) {
    e.a = place[e.a];
    e.b = place[e.b];
  }
}

void SurfaceGraph::add_edges(float radius) {
  const float inverse = 1.0f / radius;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> cells;
  for (std::uint32_t i = 0; i < points_.size(); ++i)
    if (!is_zero(normals_[i])) cells.emplace_back(cell_key(cell_of(points_[i], inverse)), i);
  std::sort(cells.begin(), cells.end());
  // The edges are sorted below: their order does not depend on the number of threads.
  const std::size_t threads = std::clamp<std::size_t>(
      std::min<std::size_t>(std::thread::hardware_concurrency(), cells.size() / kPointsPerThread),
      1, kMostThreads);
  std::vector<std::vector<Edge>> found(threads);
  on_threads(threads, [&](std::size_t thread) {
    std::vector<std::pair<float, std::uint32_t>> nearest;
    const std::size_t end = (thread + 1) * cells.size() / threads;
    for (std::size_t at = thread * cells.size() / threads; at < end; ++at) {
      const auto& [key, i] = cells[at];
      nearest.clear();
      const Cell cell = cell_from_key(key);
      for (std::int32_t z = cell.z - 1; z <= cell.z + 1; ++z)
        for (std::int32_t y = cell.y - 1; y <= cell.y + 1; ++y) {
          // Cells of one row have consecutive keys.
          const std::uint64_t first = cell_key({cell.x - 1, y, z});
          for (auto other = std::lower_bound(cells.begin(), cells.end(),
                                             std::make_pair(first, std::uint32_t(0)));
               other != cells.end() && other->first <= first + 2; ++other) {
            const float d2 = squared_norm(points_[other->second] - points_[i]);
            if (other->second != i && d2 <= radius * radius)
              nearest.emplace_back(d2, other->second);
          }
        }
      const std::size_t kept = std::min(kNeighbors, nearest.size());
      std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(kept),
                        nearest.end());
      for (std::size_t k = 0; k < kept; ++k) {
        const std::uint32_t j = nearest[k].second;
        found[thread].push_back({std::min(i, j), std::max(i, j), dot(normals_[i], normals_[j])});
      }
    }
  });
  for (const std::vector<Edge>& part : found) edges_.insert(edges_.end(), part.begin(), part.end());
  const auto before = [](const Edge& a, const Edge& b) {
    return a.a != b.a ? a.a < b.a : a.b < b.b;
  };
  std::sort(edges_.begin(), edges_.end(), before);
  edges_.erase(std::unique(edges_.begin(), edges_.end(),
                           [](const Edge& a, const Edge& b) { return a.a == b.a && a.b == b.b; }),
               edges_.end());
}

double SurfaceGraph::contradiction(Vec3 viewpoint) const {
  std::vector<float> towards(counted_ends_.size());
  for (std::size_t k = 0; k < counted_ends_.size(); ++k) {
    const std::uint32_t i = counted_ends_[k];
    towards[k] = dot(normals_[i], normalized_or_zero(viewpoint - points_[i]));
  }
  double bad = 0, all = 0;
  for (const Edge& e : counted_) {
    const float a = towards[e.a], b = towards[e.b];
    const double weight =
        weight_of(e.cosine) * static_cast<double>(std::min(std::fabs(a), std::fabs(b)));
    all += weight;
    if ((a < 0) != ((b < 0) != (e.cosine < 0))) bad += weight;
  }
  return share(bad, all);
}

double SurfaceGraph::contradiction(const Signs& signs) const {
  double bad = 0, all = 0;
  for (const Edge& e : counted_) {
    const bool opposite = signs[counted_ends_[e.a]] != signs[counted_ends_[e.b]];
    all += weight_of(e.cosine);
    if (opposite != (e.cosine < 0)) bad += weight_of(e.cosine);
  }
  return share(bad, all);
}

SurfaceGraph::Signs SurfaceGraph::signs_towards(Vec3 viewpoint) const {
  Signs signs(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i)
    signs[i] = dot(normals_[i], viewpoint - points_[i]) < 0 ? -1 : 1;
  return signs;
}

SurfaceGraph::Signs SurfaceGraph::consistent_signs() const {
  std::vector<Edge> sorted = edges_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Edge& a, const Edge& b) {
    return std::fabs(a.cosine) > std::fabs(b.cosine);
  });
  SignedSets sets(points_.size());
  for (const Edge& e : sorted) sets.join(e.a, e.b, e.cosine < 0);
  Signs signs(points_.size());
  for (std::uint32_t i = 0; i < points_.size(); ++i) signs[i] = sets.find(i).second ? -1 : 1;
  return signs;
}

double SurfaceGraph::flux(const Signs& signs) const {
  double sum[3] = {0, 0, 0}, count = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Vec3 n = normals_[i];
    if (is_zero(n)) continue;
    const double sign = signs[i];
    sum[0] += sign * static_cast<double>(n.x);
    sum[1] += sign * static_cast<double>(n.y);
    sum[2] += sign * static_cast<double>(n.z);
    count += 1;
  }
  return share(std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]), count);
}

bool SurfaceGraph::outwards(const Signs& signs) const {
  // The points lie about their local origin, near the centre of the cloud.
  double volume = 0;
  for (std::size_t i = 0; i < points_.size(); ++i)
    volume += signs[i] * static_cast<double>(dot(points_[i], normals_[i]));
  return volume >= 0;
}

}  // namespace gpureg
