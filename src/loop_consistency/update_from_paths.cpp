// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/stop_scope.hpp"
#include "loop_consistency/consistency_graph.hpp"
#include "math/exponential.hpp"

namespace gpureg {
namespace {

/// Maximum spanning forest of the edges by their confidence (Kruskal 1956), and the paths in it.
class SpanningForest {
 public:
  explicit SpanningForest(const ConsistencyGraph& graph)
      : graph_(graph), taken_(graph.edges().size(), false), nodes_(graph.clouds()) {
    choose_edges();
    for (std::uint32_t k = 0; k < nodes_.size(); ++k)
      if (nodes_[k].depth == kUnseen) grow_from(k);
  }

  bool holds(std::size_t edge) const { return taken_[edge]; }

  struct Path {
    std::uint32_t edges;  ///< 0: the clouds are not connected
    double confidence;    ///< probability that all of them are correct
    UnalignedIsometry3d first_from_second;
  };

  Path between(std::uint32_t first, std::uint32_t second) const {
    const Node &a = nodes_[first], &b = nodes_[second];
    if (a.root != b.root) return {0, 0.0, UnalignedIsometry3d::Identity()};
    const Node& top = nodes_[common_ancestor(first, second)];
    return {a.depth + b.depth - 2 * top.depth,
            portable::exp(a.log_confidence + b.log_confidence - 2 * top.log_confidence),
            a.root_from_here.inverse() * b.root_from_here};
  }

 private:
  static constexpr std::uint32_t kUnseen = 0xFFFFFFFFu;
  static constexpr double kMinPathConfidence = 1e-9;

  struct Node {
    std::uint32_t root = 0, depth = kUnseen, parent = 0;
    /// An ancestor farther up: logarithmic number of steps to any ancestor (Myers 1983).
    std::uint32_t jump = 0;
    double log_confidence = 0;  ///< of the path from the root
    UnalignedIsometry3d root_from_here = UnalignedIsometry3d::Identity();
    std::vector<ConsistencyNeighbor> edges;
  };

  void choose_edges() {
    const std::vector<ConsistencyEdge>& edges = graph_.edges();
    std::vector<std::uint32_t> order(edges.size()), group(nodes_.size());
    std::iota(order.begin(), order.end(), 0u);
    std::iota(group.begin(), group.end(), 0u);
    std::vector<double> confidence;
    for (const ConsistencyEdge& e : edges) confidence.push_back(e.confidence());
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return confidence[a] > confidence[b];
    });
    const auto group_of = [&](std::uint32_t k) {
      while (group[k] != k) k = group[k] = group[group[k]];
      return k;
    };
    for (const std::uint32_t e : order) {
      const std::uint32_t a = group_of(edges[e].first), b = group_of(edges[e].second);
      if (a == b) continue;
      group[a] = b;
      taken_[e] = true;
      nodes_[edges[e].first].edges.push_back({edges[e].second, e});
      nodes_[edges[e].second].edges.push_back({edges[e].first, e});
    }
  }

  void grow_from(std::uint32_t root) {
    Node& start = nodes_[root];
    start.root = start.parent = start.jump = root;
    start.depth = 0;
    std::vector<std::uint32_t> open{root};
    for (std::size_t k = 0; k < open.size(); ++k) {
      const std::uint32_t here = open[k];
      for (const ConsistencyNeighbor& n : nodes_[here].edges) {
        Node& next = nodes_[n.cloud];
        if (next.depth != kUnseen) continue;
        const Node &up = nodes_[here], &far = nodes_[up.jump];
        const ConsistencyEdge& edge = graph_.edges()[n.edge];
        next.root = root;
        next.parent = here;
        next.depth = up.depth + 1;
        next.jump = up.depth - far.depth == far.depth - nodes_[far.jump].depth ? far.jump : here;
        next.log_confidence =
            up.log_confidence + portable::log(std::max(kMinPathConfidence, edge.confidence()));
        next.root_from_here = up.root_from_here * edge.pose(edge.most_likely(), here);
        open.push_back(n.cloud);
      }
    }
  }

  /// Lowest common ancestor.
  std::uint32_t common_ancestor(std::uint32_t a, std::uint32_t b) const {
    if (nodes_[a].depth < nodes_[b].depth) std::swap(a, b);
    const std::uint32_t depth = nodes_[b].depth;
    while (nodes_[a].depth > depth)
      a = nodes_[nodes_[a].jump].depth >= depth ? nodes_[a].jump : nodes_[a].parent;
    while (a != b) {
      const bool far = nodes_[a].jump != nodes_[b].jump;
      a = far ? nodes_[a].jump : nodes_[a].parent;
      b = far ? nodes_[b].jump : nodes_[b].parent;
    }
    return a;
  }

  const ConsistencyGraph& graph_;
  std::vector<bool> taken_;
  std::vector<Node> nodes_;
};

}  // namespace

void update_from_paths(ConsistencyGraph& graph) {
  const SpanningForest forest(graph);
  for (std::size_t k = 0; k < graph.edges().size(); ++k) {
    StopScope::poll();
    if (forest.holds(k)) continue;
    ConsistencyEdge& edge = graph.edges()[k];
    const SpanningForest::Path path = forest.between(edge.first, edge.second);
    edge.path = path.edges;
    // Errors add up along the path: the tolerance of a loop of three for every pair of it.
    const double tolerance = std::sqrt(static_cast<double>(path.edges + 1));
    const auto ratio = [&](const ConsistencyCandidate& c) {
      return graph.closing_ratio(
          c.first_from_second * path.first_from_second.inverse(), tolerance,
          {graph.centre(edge.first), path.first_from_second * graph.centre(edge.second)});
    };
    // Pairs that close loops with a pose that the path contradicts are perceptual aliases, too: if
    // the path is correct, these loops do not count.
    const bool contradicted = ratio(edge.candidates[edge.most_likely()]) < 1.0;
    double none = 1.0, none_if_path_correct = 1.0, sum = 0;
    std::vector<double> out(edge.probability.size());
    for (std::size_t m = 0; m < out.size(); ++m) {
      const double if_path_correct = contradicted
                                         ? std::min(edge.probability[m], edge.candidates[m].prior)
                                         : edge.probability[m];
      none -= edge.probability[m];
      none_if_path_correct -= if_path_correct;
      sum += out[m] = (1.0 - path.confidence) * edge.probability[m] +
                      path.confidence * ratio(edge.candidates[m]) * if_path_correct;
    }
    sum += std::max((1.0 - path.confidence) * none + path.confidence * none_if_path_correct,
                    kMinNoneProbability);
    for (std::size_t m = 0; m < out.size(); ++m) edge.probability[m] = out[m] / sum;
  }
}

}  // namespace gpureg
