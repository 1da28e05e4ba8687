// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/connections.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <queue>
#include <utility>

namespace gpureg::reconstruction {
namespace {

std::uint32_t find(std::vector<std::uint32_t>& parent, std::uint32_t k) {
  while (parent[k] != k) k = parent[k] = parent[parent[k]];
  return k;
}

/// A confirming edge is never less likely to be wrong: registrations of one map fail together.
constexpr double kLeastWrong = 0.2;
/// Confidences down to which connections are made, one after the other, before the least one.
constexpr double kLevels[] = {0.9999, 0.999, 0.99, 0.97, 0.95, 0.92, 0};

/// An edge is also wrong if it puts the whole scan off by so many times its error over the overlap,
/// or turns it so far (Frobenius norm: six degrees).
constexpr double kMostOff = 1.5, kMostTurn = 0.148;

}  // namespace

void Connection::add(const Edge& edge, bool lone) {
  // Registrations of one map fail together: each scan is counted once, for and against.
  std::vector<std::uint32_t>& used = edge.accepted ? used_ : used_against_;
  double& all_wrong = edge.accepted ? accepted_wrong_ : rejected_wrong_;
  if (lone) {
    all_wrong *= 1 - std::min(edge.confidence, kMostConfidence);
    return;
  }
  const auto counted = [&](std::uint32_t scan) {
    return std::find(used.begin(), used.end(), scan) != used.end();
  };
  if (counted(edge.source) || counted(edge.target)) return;
  const double wrong =
      1 - std::min({edge.confidence, edge.accepted ? edge.pair_confidence : 1, kMostConfidence});
  all_wrong *= used.empty() ? wrong : std::max(kLeastWrong, wrong);
  used.insert(used.end(), {edge.source, edge.target});
}

double Connection::confidence() const {
  const double accepted = 1 / accepted_wrong_ - 1, rejected = 1 / rejected_wrong_ - 1;
  return accepted / (1 + accepted + rejected);
}

std::vector<std::size_t> by_confidence(const std::vector<Edge>& edges) {
  std::vector<std::size_t> order(edges.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return edges[a].confidence > edges[b].confidence;
  });
  return order;
}

std::vector<std::uint32_t> certain_parts(std::size_t scans, const std::vector<Edge>& edges,
                                         const std::vector<Odometry>& odometry,
                                         double min_confidence) {
  std::vector<std::uint32_t> parent(scans);
  std::iota(parent.begin(), parent.end(), 0u);
  for (const Odometry& edge : odometry) {
    const auto [a, b] = std::minmax({find(parent, edge.source), find(parent, edge.target)});
    parent[b] = a;
  }
  const std::vector<std::size_t> order = by_confidence(edges);
  std::vector<std::uint32_t> size(scans);
  for (const double level : kLevels) {
    const double least = std::max(level, min_confidence) - kRounding;
    for (bool merged = true; merged;) {
      merged = false;
      std::fill(size.begin(), size.end(), 0u);
      for (std::uint32_t k = 0; k < scans; ++k) ++size[find(parent, k)];
      std::map<std::pair<std::uint32_t, std::uint32_t>, Connection> connections;
      for (const std::size_t k : order) {
        const auto [a, b] =
            std::minmax({find(parent, edges[k].source), find(parent, edges[k].target)});
        if (a != b) connections[{a, b}].add(edges[k], std::min(size[a], size[b]) == 1);
      }
      for (const auto& [between, connection] : connections) {
        if (connection.confidence() < least) continue;
        const auto [a, b] =
            std::minmax({find(parent, between.first), find(parent, between.second)});
        parent[b] = a;
        merged = true;
      }
    }
  }
  std::vector<std::uint32_t> part(scans);
  for (std::size_t k = 0; k < scans; ++k) part[k] = find(parent, static_cast<std::uint32_t>(k));
  return part;
}

double deviation(const Edge& edge, const Reconstruction& map, double max_error) {
  const UnalignedIsometry3d measured =
      map.scans[edge.target].island_from_scan * edge.target_from_source;
  const UnalignedIsometry3d& refined = map.scans[edge.source].island_from_scan;
  const Eigen::Matrix3d turn = measured.linear() - refined.linear();
  const double error =
      std::sqrt((measured * edge.overlap_centre - refined * edge.overlap_centre).squaredNorm() +
                std::max(0.0, (turn * edge.overlap_spread * turn.transpose()).trace()));
  // The overlap of a pair that is small tells little about its turn.
  const double off = (measured.translation() - refined.translation()).norm();
  const bool deviates = error > max_error || off > kMostOff * max_error || turn.norm() > kMostTurn;
  return deviates ? std::max(error, off) : 0;
}

std::size_t reject_deviating(Reconstruction& map, double max_error) {
  std::vector<std::pair<double, std::size_t>> deviating;
  for (std::size_t k = 0; k < map.edges.size(); ++k) {
    const Edge& edge = map.edges[k];
    if (!edge.accepted || !map.scans[edge.source].placed) continue;
    if (const double error = deviation(edge, map, max_error); error > 0)
      deviating.emplace_back(-error, k);
  }
  std::sort(deviating.begin(), deviating.end());
  std::size_t rejected = 0;
  for (const auto& [minus_error, candidate] : deviating) {
    std::vector<std::uint32_t> parent(map.scans.size());
    std::iota(parent.begin(), parent.end(), 0u);
    for (const Odometry& odometry : map.odometry)
      parent[find(parent, odometry.source)] = find(parent, odometry.target);
    for (std::size_t k = 0; k < map.edges.size(); ++k)
      if (map.edges[k].accepted && k != candidate)
        parent[find(parent, map.edges[k].source)] = find(parent, map.edges[k].target);
    Edge& edge = map.edges[candidate];
    if (find(parent, edge.source) != find(parent, edge.target)) continue;
    edge.accepted = false;
    edge.weight = 0;
    edge.reason = EdgeReason::inconsistent;
    ++rejected;
  }
  return rejected;
}

void set_confidence(Reconstruction& map) {
  struct Neighbor {
    std::uint32_t scan;
    double confidence;
  };
  std::vector<std::vector<Neighbor>> neighbors(map.scans.size());
  std::vector<double> sum(map.scans.size(), 0);
  for (const Edge& edge : map.edges) {
    if (!edge.accepted || !map.scans[edge.source].placed) continue;
    neighbors[edge.source].push_back({edge.target, edge.confidence});
    neighbors[edge.target].push_back({edge.source, edge.confidence});
    sum[edge.source] += edge.confidence;
    sum[edge.target] += edge.confidence;
  }
  for (const Odometry& odometry : map.odometry) {
    neighbors[odometry.source].push_back({odometry.target, odometry.confidence});
    neighbors[odometry.target].push_back({odometry.source, odometry.confidence});
  }
  for (const Island& island : map.islands) {
    const std::uint32_t root =
        *std::max_element(island.scans.begin(), island.scans.end(),
                          [&](std::uint32_t a, std::uint32_t b) { return sum[a] < sum[b]; });
    for (const std::uint32_t scan : island.scans) {
      map.scans[scan].confidence = 0;
      // A placed scan without an accepted edge has odometry.
      map.scans[scan].reason = sum[scan] > 0 ? ScanReason::none : ScanReason::odometry_only;
    }
    std::priority_queue<std::pair<double, std::uint32_t>> queue;  // Dijkstra 1959, by products
    map.scans[root].confidence = 1;
    queue.emplace(1.0, root);
    while (!queue.empty()) {
      const auto [confidence, scan] = queue.top();
      queue.pop();
      if (confidence < map.scans[scan].confidence) continue;
      for (const Neighbor& next : neighbors[scan]) {
        const double reached = confidence * next.confidence;
        if (reached <= map.scans[next.scan].confidence) continue;
        map.scans[next.scan].confidence = reached;
        queue.emplace(reached, next.scan);
      }
    }
  }
}

}  // namespace gpureg::reconstruction
