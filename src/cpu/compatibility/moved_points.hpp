// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cpu/common/cell_summary.hpp"
#include "cpu/common/stages.hpp"

namespace gpureg::cpu {

/// The points of one cloud under poses, against the cells of another cloud: a walk that skips the
/// points that the cell summaries refute, and prefetches all look-ups.
class MovedPoints {
 public:
  static constexpr std::size_t kGroup = 64;  ///< points per group

  /// order: of all points of moved, or of some; limits: for the normal test of the walk.
  MovedPoints(const ScoringOrder& order, const CloudView& other, const SummaryLimits& limits)
      : order_(order),
        other_(other),
        cells_(executor_data(other).summaries),
        limits_(limits),
        cell_(order.x.size()) {}

  std::size_t groups() const { return order_.remaining.size(); }
  const ScoringOrder& order() const { return order_; }
  /// Mask of the points of a group that are not padding.
  std::uint64_t present(std::size_t group) const {
    std::uint64_t mask = 0;
    for (std::size_t k = 0; k < kGroup; ++k)
      mask |= static_cast<std::uint64_t>(order_.index[group * kGroup + k] != kNoValue) << k;
    return mask;
  }
  Vec3 point(std::size_t k) const { return {order_.x[k], order_.y[k], order_.z[k]}; }
  Vec3 normal(std::size_t k) const { return {order_.nx[k], order_.ny[k], order_.nz[k]}; }

  /// Calls visit(group, bounds) for every group; bounds: of its inliers. closest() is valid for the
  /// visited group.
  template <typename Visit>
  void for_each_group(const Rigid& pose, Visit&& visit) {
    if (groups() == 0) return;
    if (cells_.block.empty()) {  // a cloud too wide for the table has no bounds
      for (std::size_t g = 0; g < groups(); ++g) visit(g, PointBounds{~std::uint64_t(0), 0});
      return;
    }
    locate_cells(order_, 0, pose, cells_, cell_.data());
    for (std::size_t g = 0; g < groups(); ++g) {
      if (g + 1 < groups())
        locate_cells(order_, (g + 1) * kGroup, pose, cells_, cell_.data() + (g + 1) * kGroup);
      visit(g, bound_inliers(order_, g * kGroup, pose, cells_, limits_, cell_.data() + g * kGroup));
    }
  }

  /// Of the points in the mask, those with a point of the other cloud near their cell.
  std::uint64_t near_any(std::size_t group, std::uint64_t mask) const {
    if (cells_.block.empty()) return mask;
    std::uint64_t out = 0;
    for (std::size_t k = 0; k < kGroup; ++k)
      out |= static_cast<std::uint64_t>(
                 cells_.summary[static_cast<std::size_t>(cell_[group * kGroup + k])] != 0)
             << k;
    return out & mask;
  }

  /// Calls visit(k, q, closest) for the points of a group in the mask: k is their position in the
  /// order, q their moved location. Prefetches the lists of all points before the first is read.
  template <typename Visit>
  void closest(const Rigid& pose, std::size_t group, std::uint64_t mask, float max_squared,
               Visit&& visit) const {
    constexpr std::uint32_t kCells = ClosestGridView::kBlockCells;
    const ClosestGridView& grid = other_.closest;
    if (cells_.block.empty()) {
      for (; mask != 0; mask &= mask - 1) {
        const std::size_t k = group * kGroup + static_cast<std::size_t>(__builtin_ctzll(mask));
        const Vec3 q = apply(pose, point(k));
        visit(k, q, find_closest(grid, other_.points, q, max_squared));
      }
      return;
    }
    const std::uint32_t* start[kGroup];
    int count = 0;
    for (std::uint64_t left = mask; left != 0; left &= left - 1) {
      const std::uint32_t cell = static_cast<std::uint32_t>(
          cell_[group * kGroup + static_cast<std::size_t>(__builtin_ctzll(left))]);
      start[count] = grid.cell_start.data +
                     static_cast<std::size_t>(cell / kCells - 1) * (kCells + 1) + cell % kCells;
      __builtin_prefetch(start[count++]);
    }
    for (int n = 0; n < count; ++n) __builtin_prefetch(grid.candidates.data + *start[n]);
    for (int n = 0; mask != 0; mask &= mask - 1, ++n) {
      const std::size_t k = group * kGroup + static_cast<std::size_t>(__builtin_ctzll(mask));
      const Vec3 q = apply(pose, point(k));
      visit(k, q,
            closest_candidate(grid.candidates.data, start[n][0], start[n][1], other_.points, q,
                              max_squared));
    }
  }

 private:
  const ScoringOrder& order_;
  const CloudView& other_;
  const CellSummaries& cells_;
  const SummaryLimits& limits_;
  std::vector<std::int32_t> cell_;
};

/// Every stride-th point of a cloud, ordered for such a walk. index: of the points in the cloud.
inline ScoringOrder sampled_order(const CpuCloud& cloud, std::uint32_t stride) {
  if (stride == 1) return cloud.order;
  std::vector<Vec3> points, normals;
  for (std::size_t i = 0; i < cloud.points.size(); i += stride) {
    points.push_back(cloud.points[i]);
    normals.push_back(cloud.normals[i]);
  }
  ScoringOrder out = scoring_order(points, normals, cloud.options.max_correspondence_distance);
  for (std::uint32_t& i : out.index) i = i == kNoValue ? kNoValue : i * stride;
  return out;
}

/// True where the summaries' bit for covered cells applies to this correspondence distance.
inline bool exact_distance(const CloudView& cloud, float max_squared) {
  const float built_for = executor_data(cloud).options.max_correspondence_distance;
  return built_for * built_for == max_squared;
}

}  // namespace gpureg::cpu
