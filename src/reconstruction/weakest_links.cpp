// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "common/stop_scope.hpp"
#include "gpureg/reconstruction.hpp"
#include "math/exponential.hpp"
#include "reconstruction/connections.hpp"

namespace gpureg::reconstruction {
namespace {

/// Edges and odometry within the islands, as edges, the most confident first.
std::vector<Edge> known_edges(const Reconstruction& map) {
  std::vector<Edge> all = map.edges, out;
  for (const Odometry& odometry : map.odometry) {
    Edge edge;
    edge.source = odometry.source;
    edge.target = odometry.target;
    edge.confidence = edge.pair_confidence = odometry.confidence;
    edge.accepted = true;
    all.push_back(edge);
  }
  for (const std::size_t k : by_confidence(all)) {
    const Scan &first = map.scans[all[k].source], &second = map.scans[all[k].target];
    if (first.placed && second.placed && first.island == second.island) out.push_back(all[k]);
  }
  return out;
}

/// Kruskal 1956: neighbours of each scan in the most confident spanning forest.
std::vector<std::vector<std::uint32_t>> spanning_forest(std::size_t scans,
                                                        const std::vector<Edge>& edges) {
  std::vector<std::uint32_t> parent(scans);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto find = [&](std::uint32_t k) {
    while (parent[k] != k) k = parent[k] = parent[parent[k]];
    return k;
  };
  std::vector<std::vector<std::uint32_t>> tree(scans);
  for (const Edge& edge : edges) {
    if (!edge.accepted || find(edge.source) == find(edge.target)) continue;
    parent[find(edge.source)] = find(edge.target);
    tree[edge.source].push_back(edge.target);
    tree[edge.target].push_back(edge.source);
  }
  return tree;
}

/// A tree in depth-first order: the scans below k are order[begin[k] .. end[k]).
struct Order {
  explicit Order(std::size_t scans) : begin(scans, 0), end(scans, 0) {}
  std::vector<std::uint32_t> order;
  std::vector<std::size_t> begin, end;
};

void walk(std::uint32_t root, const std::vector<std::vector<std::uint32_t>>& tree, Order& out) {
  struct Step {
    std::uint32_t scan, from;
    std::size_t next;
  };
  std::vector<Step> stack = {{root, root, 0}};
  out.begin[root] = out.order.size();
  out.order.push_back(root);
  while (!stack.empty()) {
    Step& step = stack.back();
    if (step.next == tree[step.scan].size()) {
      out.end[step.scan] = out.order.size();
      stack.pop_back();
      continue;
    }
    const std::uint32_t next = tree[step.scan][step.next++];
    if (next == step.from) continue;
    out.begin[next] = out.order.size();
    out.order.push_back(next);
    stack.push_back({next, step.scan, 0});
  }
}

}  // namespace

std::vector<Link> weakest_links(const Reconstruction& map) {
  const std::vector<Edge> edges = known_edges(map);
  const auto tree = spanning_forest(map.scans.size(), edges);
  std::vector<std::vector<const Edge*>> edges_of(map.islands.size());
  for (const Edge& edge : edges) edges_of[map.scans[edge.source].island].push_back(&edge);
  std::vector<Link> links;
  Order order(map.scans.size());
  for (std::size_t place = 0; place < map.islands.size(); ++place) {
    const Island& island = map.islands[place];
    order.order.clear();
    walk(island.scans.front(), tree, order);
    for (const std::uint32_t top : island.scans) {
      if (top == island.scans.front()) continue;
      StopScope::poll();
      const auto below = [&](std::uint32_t scan) {
        return order.begin[scan] >= order.begin[top] && order.begin[scan] < order.end[top];
      };
      const std::size_t size = order.end[top] - order.begin[top];
      const bool lone = size == 1 || size + 1 == island.scans.size();
      Link link;
      Connection connection;
      for (const Edge* edge : edges_of[place]) {
        if (below(edge->source) == below(edge->target)) continue;
        connection.add(*edge, lone);
        ++(edge->accepted ? link.accepted : link.rejected);
      }
      link.confidence = connection.confidence();
      const bool smaller = 2 * size <= island.scans.size();
      for (const std::uint32_t scan : island.scans)
        if (below(scan) == smaller) link.scans.push_back(scan);
      links.push_back(std::move(link));
    }
  }
  return links;
}

void split_at_weak_links(const std::vector<Edge>& edges, const std::vector<Odometry>& odometry,
                         double min_confidence, std::vector<std::uint32_t>& parts) {
  Reconstruction map;
  map.edges = edges;
  map.odometry = odometry;
  map.scans.resize(parts.size());
  for (Scan& scan : map.scans) scan.placed = true;
  std::vector<std::vector<std::uint32_t>> scans_of(parts.size());
  for (std::uint32_t k = 0; k < parts.size(); ++k) scans_of[parts[k]].push_back(k);
  const auto divides = [](const Link& link, const auto& edge) {
    const auto within = [&](std::uint32_t scan) {
      return std::binary_search(link.scans.begin(), link.scans.end(), scan);
    };
    return within(edge.source) != within(edge.target);
  };
  const auto held_by_odometry = [&](const Link& link) {
    return std::any_of(odometry.begin(), odometry.end(),
                       [&](const Odometry& step) { return divides(link, step); });
  };
  // How much more the rejected edges say than the accepted ones, each taken for itself. A wrong
  // edge at one scan makes all connections of that scan weak; this finds the edge.
  const auto contradiction = [&](const Link& link) {
    double sum = 0;
    const std::uint32_t island = map.scans[link.scans.front()].island;
    for (const Edge& edge : edges) {
      if (map.scans[edge.source].island != island || map.scans[edge.target].island != island ||
          !divides(link, edge))
        continue;
      const double evidence = -portable::log(1 - std::min(edge.pair_confidence, kMostConfidence));
      sum += edge.accepted ? -evidence : evidence;
    }
    return sum;
  };
  while (true) {
    map.islands.clear();
    for (std::vector<std::uint32_t>& scans : scans_of) {
      if (scans.empty()) continue;
      for (const std::uint32_t scan : scans)
        map.scans[scan].island = static_cast<std::uint32_t>(map.islands.size());
      map.islands.push_back({});
      map.islands.back().scans = scans;
    }
    const std::vector<Link> links = weakest_links(map);
    const Link* split = nullptr;
    double most = 0;
    for (const Link& link : links) {
      if (link.confidence >= min_confidence - kRounding || held_by_odometry(link)) continue;
      const double against = contradiction(link);
      if (split && against <= most) continue;
      split = &link;
      most = against;
    }
    if (!split) return;
    const std::vector<std::uint32_t> all = scans_of[parts[split->scans.front()]];
    std::vector<std::uint32_t> rest;
    std::set_difference(all.begin(), all.end(), split->scans.begin(), split->scans.end(),
                        std::back_inserter(rest));
    scans_of[all.front()].clear();
    // A part has the number of its smallest scan.
    for (const std::vector<std::uint32_t>& part : {split->scans, rest}) {
      for (const std::uint32_t scan : part) parts[scan] = part.front();
      scans_of[part.front()] = part;
    }
  }
}

}  // namespace gpureg::reconstruction
