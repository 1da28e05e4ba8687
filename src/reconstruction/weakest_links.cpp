// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <numeric>

#include "gpureg/reconstruction.hpp"
#include "reconstruction/connections.hpp"

namespace gpureg::reconstruction {
namespace {

struct Known {
  std::uint32_t a, b;
  double confidence;
  bool accepted;
};

std::vector<Known> known_edges(const Reconstruction& map) {
  std::vector<Known> out;
  const auto add = [&](std::uint32_t a, std::uint32_t b, double confidence, bool accepted) {
    const Scan &first = map.scans[a], &second = map.scans[b];
    if (first.placed && second.placed && first.island == second.island)
      out.push_back({a, b, confidence, accepted});
  };
  for (const Edge& edge : map.edges) add(edge.source, edge.target, edge.confidence, edge.accepted);
  for (const Odometry& edge : map.odometry) add(edge.source, edge.target, edge.confidence, true);
  // Stable: of equally confident edges the first.
  std::stable_sort(out.begin(), out.end(),
                   [](const Known& x, const Known& y) { return x.confidence > y.confidence; });
  return out;
}

/// Kruskal 1956: neighbours of each scan in the most confident spanning forest.
std::vector<std::vector<std::uint32_t>> spanning_forest(std::size_t scans,
                                                        const std::vector<Known>& edges) {
  std::vector<std::uint32_t> parent(scans);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto find = [&](std::uint32_t k) {
    while (parent[k] != k) k = parent[k] = parent[parent[k]];
    return k;
  };
  std::vector<std::vector<std::uint32_t>> tree(scans);
  for (const Known& edge : edges) {
    if (!edge.accepted || find(edge.a) == find(edge.b)) continue;
    parent[find(edge.a)] = find(edge.b);
    tree[edge.a].push_back(edge.b);
    tree[edge.b].push_back(edge.a);
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
  const std::vector<Known> edges = known_edges(map);
  const auto tree = spanning_forest(map.scans.size(), edges);
  std::vector<Link> links;
  for (const Island& island : map.islands) {
    Order order(map.scans.size());
    walk(island.scans.front(), tree, order);
    for (const std::uint32_t top : island.scans) {
      if (top == island.scans.front()) continue;
      const auto below = [&](std::uint32_t scan) {
        return order.begin[scan] >= order.begin[top] && order.begin[scan] < order.end[top];
      };
      Link link;
      Connection connection;
      for (const Known& edge : edges) {
        if (map.scans[edge.a].island != map.scans[top].island || below(edge.a) == below(edge.b))
          continue;
        connection.add(edge.confidence, edge.accepted);
        ++(edge.accepted ? link.accepted : link.rejected);
      }
      link.confidence = connection.confidence();
      const bool smaller = 2 * (order.end[top] - order.begin[top]) <= island.scans.size();
      for (const std::uint32_t scan : island.scans)
        if (below(scan) == smaller) link.scans.push_back(scan);
      links.push_back(std::move(link));
    }
  }
  return links;
}

}  // namespace gpureg::reconstruction
