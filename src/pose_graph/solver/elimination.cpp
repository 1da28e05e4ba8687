// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/solver/elimination.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

namespace gpureg::pose_graph {
namespace {

using Pattern = std::vector<std::pair<int, int>>;
using Columns = std::vector<std::vector<int>>;

/// Supernodes are merged while they have at most so many block columns ...
constexpr int kMaxMergedColumns = 16;
/// ... and while at most this share of the merged columns' blocks are zeros. Dense work on a few
/// zeros is faster than another front.
constexpr double kMaxZeroShare = 0.25;

std::vector<int> minimum_degree(int size, const Pattern& pattern) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int k = 0; k < size; ++k) entries.emplace_back(k, k, 1.0);
  for (const auto& [column, row] : pattern)
    entries.emplace_back(std::max(column, row), std::min(column, row), 1.0);
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  const Eigen::SparseMatrix<double>& symmetric = matrix;
  Eigen::AMDOrdering<int>()(symmetric.selfadjointView<Eigen::Lower>(), permutation);
  const auto& indices = permutation.indices();
  return {indices.data(), indices.data() + size};
}

/// Rows below the diagonal of each column, in the positions of an order.
Columns lower_columns(int size, const Pattern& pattern, const std::vector<int>& order) {
  std::vector<int> position(size);
  for (int k = 0; k < size; ++k) position[order[k]] = k;
  Columns lower(size);
  for (const auto& [column, row] : pattern) {
    const auto [low, high] = std::minmax(position[column], position[row]);
    lower[low].push_back(high);
  }
  return lower;
}

/// Liu 1990, "The role of elimination trees in sparse factorization", algorithm 4.2.
std::vector<int> elimination_tree(const Columns& lower) {
  const int size = static_cast<int>(lower.size());
  Columns upper(size);
  for (int column = 0; column < size; ++column)
    for (const int row : lower[column]) upper[row].push_back(column);
  std::vector<int> parent(size, -1), ancestor(size, -1);
  for (int row = 0; row < size; ++row)
    for (int k : upper[row])
      while (k != -1 && k < row) {
        const int next = ancestor[k];
        ancestor[k] = row;
        if (next == -1) parent[k] = row;
        k = next;
      }
  return parent;
}

std::vector<int> postorder(const std::vector<int>& parent) {
  const int size = static_cast<int>(parent.size());
  Columns children(size);
  std::vector<int> stack, out;
  for (int k = size - 1; k >= 0; --k)
    if (parent[k] == -1)
      stack.push_back(k);
    else
      children[parent[k]].push_back(k);
  // Children lie in descending order; a node is output once all of them are.
  std::vector<std::size_t> next(size, 0);
  while (!stack.empty()) {
    const int node = stack.back();
    if (next[node] < children[node].size()) {
      stack.push_back(children[node][children[node].size() - 1 - next[node]++]);
    } else {
      out.push_back(node);
      stack.pop_back();
    }
  }
  return out;
}

/// Structure of each column of the factor, in elimination order.
Columns symbolic_factor(Columns lower, const std::vector<int>& parent) {
  const int size = static_cast<int>(lower.size());
  std::vector<int> mark(size, -1);
  Columns children(size);
  for (int k = 0; k < size; ++k)
    if (parent[k] >= 0) children[parent[k]].push_back(k);
  for (int column = 0; column < size; ++column) {
    std::vector<int>& rows = lower[column];
    mark[column] = column;
    for (const int row : rows) mark[row] = column;
    for (const int child : children[column])
      for (const int row : lower[child])
        if (mark[row] != column) {
          mark[row] = column;
          rows.push_back(row);
        }
    std::sort(rows.begin(), rows.end());
  }
  return lower;
}

/// Whether a supernode and the child that ends where it begins are worth merging.
bool worth_merging(const Supernode& child, const Supernode& parent) {
  const double columns = child.columns + parent.columns;
  const double rows = static_cast<double>(parent.rows.size());
  const double zeros = child.columns * (parent.columns + rows - double(child.rows.size()));
  if (zeros == 0) return true;
  return columns <= kMaxMergedColumns && zeros <= kMaxZeroShare * columns * (columns / 2 + rows);
}

std::vector<Supernode> supernodes_of(Columns structure, const std::vector<int>& parent) {
  std::vector<Supernode> out;
  for (int column = 0; column < static_cast<int>(structure.size()); ++column) {
    Supernode node{column, 1, std::move(structure[column])};
    // Postorder: the last child ends right before its parent.
    while (!out.empty()) {
      const Supernode& last = out.back();
      const int end = last.first + last.columns;
      if (end != node.first || parent[end - 1] < node.first ||
          parent[end - 1] >= node.first + node.columns || !worth_merging(last, node))
        break;
      node.first = last.first;
      node.columns += last.columns;
      out.pop_back();
    }
    out.push_back(std::move(node));
  }
  return out;
}

}  // namespace

Elimination eliminate(int size, const Pattern& pattern) {
  Elimination out;
  if (size == 0) return out;
  const std::vector<int> degree_order = minimum_degree(size, pattern);
  const std::vector<int> places =
      postorder(elimination_tree(lower_columns(size, pattern, degree_order)));
  for (const int place : places) out.order.push_back(degree_order[place]);
  Columns lower = lower_columns(size, pattern, out.order);
  const std::vector<int> parent = elimination_tree(lower);
  out.supernodes = supernodes_of(symbolic_factor(std::move(lower), parent), parent);
  return out;
}

}  // namespace gpureg::pose_graph
