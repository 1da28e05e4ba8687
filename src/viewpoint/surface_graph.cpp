// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/surface_graph.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "math/span.hpp"

namespace gpureg {
namespace {

/// Largest number of edges that contradiction() reads; a share of so many is good to 0.1 %.
constexpr std::size_t kCountedEdges = 40'000;
/// Below this cosine two neighbours lie on different surfaces and tell nothing about each other.
constexpr float kSameSurface = 0.5f;

float weight_of(float cosine) { return std::fabs(cosine) < kSameSurface ? 0.0f : cosine * cosine; }

std::uint32_t bits_of(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

double share(double part, double whole) { return whole > 0 ? part / whole : 0.0; }

/// Sets of connected points, each with the parity of its sign to that of its root.
class SignedSets {
 public:
  explicit SignedSets(std::size_t size) : link_(size) {
    for (std::uint32_t i = 0; i < size; ++i) link_[i] = {i, 0};
  }
  struct Link {
    std::uint32_t root, flipped;
  };
  /// Root of a point, and whether the point has the other sign.
  Link find(std::uint32_t point) {
    const Link link = link_[point];
    if (link_[link.root].root == link.root) return link;
    return shorten(point);
  }
  void join(std::uint32_t a, std::uint32_t b, bool opposite) {
    const Link of_a = find(a), of_b = find(b);
    if (of_a.root == of_b.root) return;
    // The lower index stays the root, so that the result depends on the order of the edges alone.
    const auto [root, child] = std::minmax(of_a.root, of_b.root);
    link_[child] = {root, of_a.flipped ^ of_b.flipped ^ std::uint32_t(opposite)};
  }

 private:
  /// Links a point and those between it and the root to the root.
  Link shorten(std::uint32_t point) {
    std::uint32_t root = point, flipped = 0;
    for (; link_[root].root != root; root = link_[root].root) flipped ^= link_[root].flipped;
    const Link found{root, flipped};
    while (link_[point].root != root) {
      const Link next = link_[point];
      link_[point] = {root, flipped};
      flipped ^= next.flipped;
      point = next.root;
    }
    return found;
  }

  std::vector<Link> link_;  ///< to another point, or to the point itself where it is a root
};

/// Edges in buckets of falling cosines, without signs. Most of the later edges join nothing, so no
/// bucket is sorted before its turn.
class CosineBuckets {
 public:
  explicit CosineBuckets(const std::vector<SurfaceEdge>& edges) : begin_(kBuckets + 2, 0) {
    std::vector<std::uint16_t> bucket(edges.size());
    for (std::size_t k = 0; k < edges.size(); ++k) {
      bucket[k] = bucket_of(edges[k].cosine);
      ++begin_[bucket[k] + 2u];
    }
    for (std::size_t b = 2; b < begin_.size(); ++b) begin_[b] += begin_[b - 1];
    edge_.resize(edges.size());
    for (std::uint32_t k = 0; k < edges.size(); ++k) edge_[begin_[bucket[k] + 1u]++] = k;
  }
  static constexpr std::size_t kBuckets = 1024;
  /// The edges of a bucket, ascending.
  Span<const std::uint32_t> operator[](std::size_t bucket) const {
    return {edge_.data() + begin_[bucket], begin_[bucket + 1] - begin_[bucket]};
  }

 private:
  /// Narrow buckets near 1: smooth surfaces have most of their cosines there.
  static std::uint16_t bucket_of(float cosine) {
    constexpr float kLeast = 1.0f / (1 << 24);
    constexpr int kShift = 18;  // 32 buckets for each power of 2
    const std::uint32_t bits = bits_of(std::max(kLeast, 1.0f - std::fabs(cosine)));
    return static_cast<std::uint16_t>((bits - bits_of(kLeast)) >> kShift);
  }

  std::vector<std::uint32_t> begin_, edge_;
};

}  // namespace

SurfaceGraph::SurfaceGraph(std::vector<Vec3> points, std::vector<Vec3> normals, float radius,
                           ThreadGroup& threads)
    : points_(std::move(points)),
      normals_(std::move(normals)),
      radius_(radius),
      threads_(&threads) {
  edges_ = surface_edges(points_, normals_, radius, threads);
  choose_counted();
}

void SurfaceGraph::choose_counted() {
  const std::size_t stride = std::max<std::size_t>(1, edges_.size() / kCountedEdges);
  for (std::size_t k = 0; k < edges_.size(); k += stride) {
    const SurfaceEdge& e = edges_[k];
    const float weight = weight_of(e.cosine);
    if (weight > 0) counted_.edges.push_back({e.a, e.b, std::copysign(weight, e.cosine)});
  }
  // A viewpoint is compared with the ends of these edges alone: in a large map hardly any points.
  std::vector<std::uint32_t> place(points_.size(), 0);
  for (const CountedEdges::Edge& e : counted_.edges) place[e.a] = place[e.b] = 1;
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    if (place[i] == 0) continue;
    place[i] = static_cast<std::uint32_t>(counted_ends_.size());
    counted_ends_.push_back(i);
    counted_.points.push_back(points_[i]);
    counted_.normals.push_back(normals_[i]);
  }
  counted_.weight.resize(counted_ends_.size(), 0.0f);
  for (CountedEdges::Edge& e : counted_.edges) {
    e.a = place[e.a];
    e.b = place[e.b];
    for (const std::uint32_t end : {e.a, e.b}) counted_.weight[end] += 0.5f * std::fabs(e.weight);
  }
}

std::vector<double> SurfaceGraph::contradictions(const std::vector<Vec3>& viewpoints,
                                                 double limit) const {
  std::vector<double> shares(viewpoints.size());
  const std::size_t together = viewpoints_at_once();
  threads_->parallel((viewpoints.size() + together - 1) / together, [&](std::size_t part) {
    const std::size_t first = part * together;
    count_contradictions(counted_, viewpoints.data() + first,
                         std::min(together, viewpoints.size() - first), limit,
                         shares.data() + first);
  });
  return shares;
}

double SurfaceGraph::contradiction(const Signs& signs) const {
  double bad = 0, all = 0;
  for (const CountedEdges::Edge& e : counted_.edges) {
    const bool opposite = signs[counted_ends_[e.a]] != signs[counted_ends_[e.b]];
    const auto weight = static_cast<double>(std::fabs(e.weight));
    all += weight;
    if (opposite != (e.weight < 0)) bad += weight;
  }
  return share(bad, all);
}

SurfaceGraph::Signs SurfaceGraph::signs_towards(Vec3 viewpoint) const {
  Signs signs(points_.size());
  find_signs_towards(viewpoint, points_, normals_, signs.data());
  return signs;
}

SurfaceGraph::Signs SurfaceGraph::consistent_signs() const {
  SignedSets sets(points_.size());
  const CosineBuckets buckets(edges_);
  std::vector<std::uint64_t> order;
  for (std::size_t bucket = 0; bucket < CosineBuckets::kBuckets; ++bucket) {
    order.clear();
    for (const std::uint32_t k : buckets[bucket]) {
      const SurfaceEdge& e = edges_[k];
      // The bits of a number that is not negative sort like the number.
      if (sets.find(e.a).root != sets.find(e.b).root)
        order.push_back(std::uint64_t(~bits_of(std::fabs(e.cosine))) << 32 | k);
    }
    std::sort(order.begin(), order.end());
    for (const std::uint64_t item : order) {
      const SurfaceEdge& e = edges_[static_cast<std::uint32_t>(item)];
      sets.join(e.a, e.b, e.cosine < 0);
    }
  }
  Signs signs(points_.size());
  for (std::uint32_t i = 0; i < points_.size(); ++i) signs[i] = sets.find(i).flipped ? -1 : 1;
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
