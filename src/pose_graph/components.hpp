// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <numeric>
#include <utility>
#include <vector>

#include "pose_graph/problem.hpp"

namespace gpureg::pose_graph {

/// Sets of nodes, merged by edges. The representative is the smallest position.
class UnionFind {
 public:
  explicit UnionFind(int size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
  int find(int node) {
    while (parent_[node] != node) node = parent_[node] = parent_[parent_[node]];
    return node;
  }
  /// false where they were together already.
  bool merge(int a, int b) {
    a = find(a);
    b = find(b);
    if (a == b) return false;
    if (a > b) std::swap(a, b);
    parent_[b] = a;
    return true;
  }

 private:
  std::vector<int> parent_;
};

/// The component of each node, numbered by smallest node, over the edges that connect(edge) admits.
template <typename Connect>
std::vector<int> components_of(const Problem& problem, const Connect& connect) {
  UnionFind sets(problem.node_count());
  for (int k = 0; k < problem.edge_count(); ++k)
    if (connect(k)) sets.merge(problem.edges[k].source, problem.edges[k].target);
  std::vector<int> number(problem.ids.size(), -1);
  int next = 0;
  for (int node = 0; node < problem.node_count(); ++node) {
    const int root = sets.find(node);
    number[node] = root == node ? next++ : number[root];
  }
  return number;
}

}  // namespace gpureg::pose_graph
