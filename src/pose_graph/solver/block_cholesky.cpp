// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/solver/block_cholesky.hpp"

#include <algorithm>
#include <cstring>

#include "pose_graph/parallel.hpp"
#include "pose_graph/solver/dense_kernels.hpp"
#include "pose_graph/solver/elimination.hpp"

namespace gpureg::pose_graph {
namespace {

constexpr int kBlock = 6;
/// Below this work a factorisation takes less time than starting a thread.
constexpr double kParallelFlops = 5e6;

std::size_t scalars(std::size_t blocks) { return kBlock * blocks; }

double flops_of(double columns, double rows) {
  const double c = kBlock * columns, r = kBlock * rows;
  return c * c * c / 3 + c * c * r + c * r * r;
}

/// Adds the lower block triangle of a child's Schur complement into the parent's front.
void extend_add(std::vector<double>& front, std::size_t front_size,
                const std::vector<double>& update, const std::vector<int>& slots) {
  const std::size_t size = scalars(slots.size());
  for (std::size_t a = 0; a < slots.size(); ++a)
    for (int column = 0; column < kBlock; ++column) {
      const double* from = &update[(scalars(a) + column) * size];
      double* to = &front[(scalars(slots[a]) + column) * front_size];
      for (std::size_t b = a; b < slots.size(); ++b)
        for (int row = 0; row < kBlock; ++row)
          to[scalars(slots[b]) + row] += from[scalars(b) + row];
    }
}

/// Four partial sums, so that the additions need not wait for each other.
double dot(const double* a, const double* b, std::size_t size) {
  double sum[4] = {};
  std::size_t k = 0;
  for (; k + 4 <= size; k += 4)
    for (int lane = 0; lane < 4; ++lane) sum[lane] += a[k + lane] * b[k + lane];
  for (; k < size; ++k) sum[0] += a[k] * b[k];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

}  // namespace

BlockCholesky::BlockCholesky(int size, const std::vector<std::pair<int, int>>& pattern, int threads)
    : size_(size), threads_(threads) {
  Elimination elimination = eliminate(size, pattern);
  order_ = std::move(elimination.order);
  inverse_.resize(order_.size());
  for (int k = 0; k < size; ++k) inverse_[order_[k]] = k;
  fronts_.resize(elimination.supernodes.size());
  std::vector<int> front_of(size);
  for (std::size_t s = 0; s < fronts_.size(); ++s) {
    Supernode& supernode = elimination.supernodes[s];
    fronts_[s].first = supernode.first;
    fronts_[s].columns = supernode.columns;
    fronts_[s].rows = std::move(supernode.rows);
    for (int k = 0; k < supernode.columns; ++k) front_of[supernode.first + k] = static_cast<int>(s);
    flops_ += flops_of(fronts_[s].columns, static_cast<double>(fronts_[s].rows.size()));
  }
  const auto slot_of = [](const Front& front, int position) {
    if (position < front.first + front.columns) return position - front.first;
    const auto at = std::lower_bound(front.rows.begin(), front.rows.end(), position);
    return front.columns + static_cast<int>(at - front.rows.begin());
  };
  for (std::size_t s = 0; s < fronts_.size(); ++s) {
    Front& front = fronts_[s];
    if (front.rows.empty()) continue;
    front.parent = front_of[front.rows[0]];
    Front& parent = fronts_[front.parent];
    parent.children.push_back(static_cast<int>(s));
    for (const int row : front.rows) front.parent_slot.push_back(slot_of(parent, row));
  }
  for (std::size_t k = 0; k < pattern.size(); ++k) {
    const int a = inverse_[pattern[k].first], b = inverse_[pattern[k].second];
    Front& front = fronts_[front_of[std::min(a, b)]];
    front.scatter.push_back({static_cast<int>(k), slot_of(front, std::max(a, b))});
  }
  for (const auto& [column, row] : pattern) pattern_.push_back({inverse_[column], inverse_[row]});
}

bool BlockCholesky::process(Front& front, const BlockMatrix& matrix) {
  const std::size_t rows = front.rows.size();
  const std::size_t size = scalars(front.columns + rows), columns = scalars(front.columns);
  std::vector<double> work(size * size, 0.0);
  const auto add = [&](const auto& block, int row_slot, int column_slot) {
    for (int column = 0; column < kBlock; ++column)
      for (int row = 0; row < kBlock; ++row)
        work[(scalars(column_slot) + column) * size + scalars(row_slot) + row] +=
            block(row, column);
  };
  for (int k = 0; k < front.columns; ++k) add(matrix.diagonal[order_[front.first + k]], k, k);
  for (const auto& [index, slot] : front.scatter) {
    const auto [column, row] = pattern_[index];
    if (column < row)
      add(matrix.blocks[index], slot, column - front.first);
    else
      add(matrix.blocks[index].transpose(), slot, row - front.first);
  }
  for (const int child : front.children) {
    extend_add(work, size, fronts_[child].update, fronts_[child].parent_slot);
    std::vector<double>().swap(fronts_[child].update);
  }
  if (!partial_cholesky(work.data(), static_cast<int>(size), static_cast<int>(columns), threads_))
    return false;
  front.factor.assign(work.begin(), work.begin() + static_cast<std::ptrdiff_t>(size * columns));
  const std::size_t rest = scalars(rows);
  front.update.resize(rest * rest);
  for (std::size_t j = 0; j < rest; ++j)
    std::memcpy(&front.update[j * rest], &work[(columns + j) * size + columns],
                rest * sizeof(double));
  return true;
}

bool BlockCholesky::factorise(const BlockMatrix& matrix) {
  std::vector<int> parents;
  for (const Front& front : fronts_) parents.push_back(front.parent);
  const int threads = flops_ < kParallelFlops ? 1 : threads_;
  return for_each_bottom_up(parents, threads,
                            [&](int front) { return process(fronts_[front], matrix); });
}

std::vector<double> BlockCholesky::permuted(const std::vector<Vector6d>& blocks) const {
  std::vector<double> x(scalars(size_));
  for (int k = 0; k < size_; ++k)
    for (int i = 0; i < kBlock; ++i) x[scalars(k) + i] = blocks[order_[k]][i];
  return x;
}

void BlockCholesky::unpermute(const std::vector<double>& x, std::vector<Vector6d>& blocks) const {
  for (int k = 0; k < size_; ++k)
    for (int i = 0; i < kBlock; ++i) blocks[order_[k]][i] = x[scalars(k) + i];
}

void BlockCholesky::substitute_forward(std::vector<double>& x) const {
  std::vector<double> below;
  for (const Front& front : fronts_) {
    const std::size_t columns = scalars(front.columns), rest = scalars(front.rows.size());
    const std::size_t size = columns + rest;
    double* top = &x[scalars(front.first)];
    below.assign(rest, 0.0);
    for (std::size_t j = 0; j < columns; ++j) {
      const double* column = &front.factor[j * size];
      const double value = top[j] /= column[j];
      for (std::size_t i = j + 1; i < columns; ++i) top[i] -= column[i] * value;
      for (std::size_t i = 0; i < rest; ++i) below[i] += column[columns + i] * value;
    }
    for (std::size_t r = 0; r < front.rows.size(); ++r)
      for (int i = 0; i < kBlock; ++i) x[scalars(front.rows[r]) + i] -= below[scalars(r) + i];
  }
}

void BlockCholesky::substitute_backward(std::vector<double>& x) const {
  std::vector<double> below;
  for (auto front = fronts_.rbegin(); front != fronts_.rend(); ++front) {
    const std::size_t columns = scalars(front->columns), rest = scalars(front->rows.size());
    const std::size_t size = columns + rest;
    double* top = &x[scalars(front->first)];
    below.resize(rest);
    for (std::size_t r = 0; r < front->rows.size(); ++r)
      for (int i = 0; i < kBlock; ++i) below[scalars(r) + i] = x[scalars(front->rows[r]) + i];
    for (std::size_t j = columns; j-- > 0;) {
      const double* column = &front->factor[j * size];
      const double sum = dot(column + columns, below.data(), rest) +
                         dot(column + j + 1, top + j + 1, columns - j - 1);
      top[j] = (top[j] - sum) / column[j];
    }
  }
}

void BlockCholesky::solve(std::vector<Vector6d>& rhs) const {
  std::vector<double> x = permuted(rhs);
  substitute_forward(x);
  substitute_backward(x);
  unpermute(x, rhs);
}

void BlockCholesky::colour(std::vector<Vector6d>& noise) const {
  std::vector<double> x = permuted(noise);
  substitute_backward(x);
  unpermute(x, noise);
}

}  // namespace gpureg::pose_graph
