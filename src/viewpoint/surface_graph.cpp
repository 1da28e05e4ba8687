// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/surface_graph.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>

#include "common/radix_sort.hpp"

namespace gpureg {
namespace {

/// Largest number of edges that contradiction() reads; a share of so many is good to 0.1 %.
constexpr std::size_t kCountedEdges = 40'000;
/// Viewpoints that are compared with an edge at once, and edges whose weights are summed as float.
constexpr std::size_t kLanes = 8, kFloatSums = 64;
/// Below this cosine two neighbours lie on different surfaces and tell nothing about each other.
constexpr float kSameSurface = 0.5f;

float weight_of(float cosine) { return std::fabs(cosine) < kSameSurface ? 0.0f : cosine * cosine; }

std::uint32_t bits_of(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

/// One number for each of several viewpoints. The loops over them become vector instructions.
struct alignas(32) Lanes {
  float of[kLanes];
};

/// Cosines of the angles between a normal and the directions to the viewpoints; 0 at the point.
Lanes cosines_towards(Vec3 point, Vec3 normal, const Lanes& x, const Lanes& y, const Lanes& z) {
  Lanes out;
#pragma omp simd
  for (std::size_t l = 0; l < kLanes; ++l) {
    const float dx = x.of[l] - point.x, dy = y.of[l] - point.y, dz = z.of[l] - point.z;
    const float squared = std::max(dx * dx + dy * dy + dz * dz, std::numeric_limits<float>::min());
    out.of[l] = (normal.x * dx + normal.y * dy + normal.z * dz) / std::sqrt(squared);
  }
  return out;
}

/// Adds the weight of an edge, and the same, negative where its ends show different sides.
void add_edge(const Lanes& a, const Lanes& b, float weight, Lanes& all, Lanes& signed_sum) {
  const float size = std::fabs(weight);
#pragma omp simd
  for (std::size_t l = 0; l < kLanes; ++l) {
    const float here = size * std::min(std::fabs(a.of[l]), std::fabs(b.of[l]));
    all.of[l] += here;
    signed_sum.of[l] += std::copysign(here, a.of[l] * b.of[l] * weight);
  }
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

SurfaceGraph::SurfaceGraph(std::vector<Vec3> points, std::vector<Vec3> normals, float radius,
                           std::size_t threads)
    : points_(std::move(points)), normals_(std::move(normals)), radius_(radius) {
  edges_ = surface_edges(points_, normals_, radius, threads);
  choose_counted();
}

void SurfaceGraph::choose_counted() {
  const std::size_t stride = std::max<std::size_t>(1, edges_.size() / kCountedEdges);
  for (std::size_t k = 0; k < edges_.size(); k += stride) {
    const SurfaceEdge& e = edges_[k];
    const float weight = weight_of(e.cosine);
    if (weight > 0) counted_.push_back({e.a, e.b, std::copysign(weight, e.cosine)});
  }
  // A viewpoint is compared with the ends of these edges alone: in a large map hardly any points.
  std::vector<std::uint32_t> place(points_.size(), 0);
  for (const CountedEdge& e : counted_) place[e.a] = place[e.b] = 1;
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    if (place[i] == 0) continue;
    place[i] = static_cast<std::uint32_t>(counted_ends_.size());
    counted_ends_.push_back(i);
  }
  for (CountedEdge& e : counted_) {
    e.a = place[e.a];
    e.b = place[e.b];
  }
}

std::vector<double> SurfaceGraph::contradictions(const std::vector<Vec3>& viewpoints) const {
  std::vector<double> shares;
  std::vector<Lanes> towards(counted_ends_.size());
  for (std::size_t first = 0; first < viewpoints.size(); first += kLanes) {
    const std::size_t count = std::min(kLanes, viewpoints.size() - first);
    Lanes x, y, z;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const Vec3& viewpoint = viewpoints[first + std::min(l, count - 1)];
      x.of[l] = viewpoint.x;
      y.of[l] = viewpoint.y;
      z.of[l] = viewpoint.z;
    }
    for (std::size_t k = 0; k < counted_ends_.size(); ++k)
      towards[k] = cosines_towards(points_[counted_ends_[k]], normals_[counted_ends_[k]], x, y, z);
    double bad[kLanes] = {0}, all[kLanes] = {0};
    for (std::size_t begin = 0; begin < counted_.size(); begin += kFloatSums) {
      Lanes all_here{}, signed_here{};
      for (std::size_t k = begin; k < std::min(begin + kFloatSums, counted_.size()); ++k)
        add_edge(towards[counted_[k].a], towards[counted_[k].b], counted_[k].weight, all_here,
                 signed_here);
      for (std::size_t l = 0; l < kLanes; ++l) {
        bad[l] += 0.5 * static_cast<double>(all_here.of[l] - signed_here.of[l]);
        all[l] += static_cast<double>(all_here.of[l]);
      }
    }
    for (std::size_t l = 0; l < count; ++l) shares.push_back(share(bad[l], all[l]));
  }
  return shares;
}

double SurfaceGraph::contradiction(const Signs& signs) const {
  double bad = 0, all = 0;
  for (const CountedEdge& e : counted_) {
    const bool opposite = signs[counted_ends_[e.a]] != signs[counted_ends_[e.b]];
    const auto weight = static_cast<double>(std::fabs(e.weight));
    all += weight;
    if (opposite != (e.weight < 0)) bad += weight;
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
  // The bits of a number that is not negative sort like the number.
  std::vector<std::uint64_t> order(edges_.size());
  for (std::uint32_t k = 0; k < edges_.size(); ++k)
    order[k] = std::uint64_t(~bits_of(std::fabs(edges_[k].cosine))) << 32 | k;
  radix_sort(order, [](std::uint64_t item) { return item >> 32; });
  SignedSets sets(points_.size());
  for (const std::uint64_t item : order) {
    const SurfaceEdge& e = edges_[static_cast<std::uint32_t>(item)];
    sets.join(e.a, e.b, e.cosine < 0);
  }
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
