// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <numeric>

#include "cpu/common/cell_summary.hpp"
#include "cpu/common/stages.hpp"
#include "cpu/quadruples/inlier.hpp"

namespace gpureg::cpu {
namespace {

const CpuCloud& executor_data(const CloudView& cloud) {
  return *static_cast<const CpuCloud*>(cloud.executor_data);
}

/// Groups of points in descending order of the poses that failed at them. The order decides how
/// early a pose is abandoned, never the result.
class GroupOrder {
 public:
  explicit GroupOrder(std::size_t groups)
      : group_(groups), looked_(groups, 1), failed_(groups, 0), rate_(groups) {
    std::iota(group_.begin(), group_.end(), std::size_t(0));
  }
  std::size_t group(std::size_t n) const { return group_[n]; }
  void record(std::size_t g, std::uint32_t looked, std::uint32_t failed) {
    looked_[g] += looked;
    failed_[g] += failed;
  }
  void renew() {
    for (std::size_t g = 0; g < rate_.size(); ++g)
      rate_[g] = static_cast<float>(failed_[g]) / static_cast<float>(looked_[g]);
    std::stable_sort(group_.begin(), group_.end(),
                     [&](std::size_t a, std::size_t b) { return rate_[a] > rate_[b]; });
  }

 private:
  std::vector<std::size_t> group_;
  std::vector<std::uint32_t> looked_, failed_;
  std::vector<float> rate_;
};

/// Data shared by the hypotheses of one pair.
class PairScorer {
 public:
  PairScorer(const PairView& pair, const InlierTest& test, const SummaryLimits& exact,
             const SummaryLimits& inexact)
      : source_(pair.source),
        target_(pair.target),
        test_(test),
        order_(executor_data(pair.source).order),
        cells_(executor_data(pair.target).summaries),
        limits_(executor_data(pair.target).options.max_correspondence_distance *
                            executor_data(pair.target).options.max_correspondence_distance ==
                        test.max_squared
                    ? exact
                    : inexact),
        bounds_(order_.remaining.size()),
        cell_(order_.x.size()),
        by_bound_(bounds_.size()),
        by_look_(bounds_.size()) {}

  /// Support of one pose. Abandons it (inliers 0) as soon as it cannot reach `needed` inliers; such
  /// a hypothesis is not the best one, so this changes no result. The cell summaries bound every
  /// point first, then the undecided points are searched, and the residual is measured only for a
  /// pose that reaches `needed`. The groups at which poses of this pair fail come first.
  Support score(const Rigid& pose, std::uint32_t needed) {
    if (cells_.block.empty()) return all_points(pose);
    if (scored_++ % kRenewal == 0) {
      by_bound_.renew();
      by_look_.renew();
    }
    std::uint32_t possible = source_.size;
    if (!bounds_.empty()) locate(by_bound_.group(0), pose);
    for (std::size_t n = 0; n < bounds_.size(); ++n) {
      const std::size_t g = by_bound_.group(n);
      if (n + 1 < bounds_.size()) locate(by_bound_.group(n + 1), pose);
      bounds_[g] = bound_inliers(order_, g * 64, pose, cells_, limits_, cell_.data() + g * 64);
      const std::uint32_t failed =
          points_in(g) - static_cast<std::uint32_t>(__builtin_popcountll(bounds_[g].possible));
      by_bound_.record(g, points_in(g), failed);
      possible -= failed;
      if (possible < needed) return {0, 0, 0};
    }
    for (std::size_t n = 0; n < bounds_.size(); ++n) {
      const std::size_t g = by_look_.group(n);
      const std::uint64_t mask = bounds_[g].possible & ~bounds_[g].certain;
      if (mask == 0) continue;
      Support undecided{0, 0, 0};
      count_group(pose, g, mask, undecided);
      const std::uint32_t looked = static_cast<std::uint32_t>(__builtin_popcountll(mask));
      by_look_.record(g, looked, looked - undecided.inliers);
      possible -= looked - undecided.inliers;
      if (possible < needed) return {0, 0, 0};
    }
    Support s{0, 0, 0};
    for (std::size_t g = 0; g < bounds_.size(); ++g) count_group(pose, g, bounds_[g].possible, s);
    return s;
  }

 private:
  /// Hypotheses between two updates of the order of the groups.
  static constexpr std::uint32_t kRenewal = 8;

  void locate(std::size_t g, const Rigid& pose) {
    locate_cells(order_, g * 64, pose, cells_, cell_.data() + g * 64);
  }

  std::uint32_t points_in(std::size_t g) const {
    return (g == 0 ? source_.size : order_.remaining[g - 1]) - order_.remaining[g];
  }

  Support all_points(const Rigid& pose) const {
    Support s{0, 0, 0};
    for (std::uint32_t i = 0; i < source_.size; ++i)
      count_point(source_, target_, pose, test_, i, s);
    return s;
  }

  /// Searches the points of one group in the mask. Their cells are known from the bounds, which
  /// saves the look-up of the block. Prefetches the lists of all points before the first is read.
  void count_group(const Rigid& pose, std::size_t group, std::uint64_t mask, Support& s) const {
    constexpr std::uint32_t kCells = ClosestGridView::kBlockCells;
    const ClosestGridView& grid = target_.closest;
    const std::uint32_t* start[64];
    int count = 0;
    for (std::uint64_t left = mask; left != 0; left &= left - 1) {
      const std::uint32_t cell = static_cast<std::uint32_t>(
          cell_[group * 64 + static_cast<std::size_t>(__builtin_ctzll(left))]);
      start[count] = grid.cell_start.data +
                     static_cast<std::size_t>(cell / kCells - 1) * (kCells + 1) + cell % kCells;
      __builtin_prefetch(start[count++]);
    }
    for (int k = 0; k < count; ++k) __builtin_prefetch(grid.candidates.data + *start[k]);
    for (int n = 0; mask != 0; mask &= mask - 1, ++n) {
      const std::size_t k = group * 64 + static_cast<std::size_t>(__builtin_ctzll(mask));
      const Vec3 q = apply(pose, {order_.x[k], order_.y[k], order_.z[k]});
      count_inlier(source_, target_, pose, test_, order_.index[k],
                   closest_candidate(grid.candidates.data, start[n][0], start[n][1], target_.points,
                                     q, test_.max_squared),
                   s);
    }
  }

  const CloudView& source_;
  const CloudView& target_;
  const InlierTest& test_;
  const ScoringOrder& order_;
  const CellSummaries& cells_;
  const SummaryLimits& limits_;
  std::vector<PointBounds> bounds_;
  std::vector<std::int32_t> cell_;
  GroupOrder by_bound_, by_look_;
  std::uint32_t scored_ = 0;
};

}  // namespace

Support measure_support(const CloudView& source, const CloudView& target, const Rigid& pose,
                        const RegistrationSettings& options) {
  const InlierTest test =
      inlier_test(options.prepare.max_correspondence_distance, options.quadruples.max_normal_angle);
  Support s{0, 0, 0};
  for (std::uint32_t i = 0; i < source.size; ++i) count_point(source, target, pose, test, i, s);
  return s;
}

std::vector<BestPose> score_hypotheses(Exec& exec, Span<const PairView> pairs,
                                       const std::vector<Hypotheses>& hypotheses,
                                       const RegistrationSettings& options) {
  constexpr std::size_t kGrain = 256;
  const InlierTest test =
      inlier_test(options.prepare.max_correspondence_distance, options.quadruples.max_normal_angle);
  const SummaryLimits exact_limits(options.quadruples.max_normal_angle, true),
      reach_limits(options.quadruples.max_normal_angle, false);
  std::vector<std::vector<Support>> best_of_block(pairs.size);
  std::vector<std::vector<std::size_t>> index_of_block(pairs.size);
  std::vector<std::atomic<std::uint32_t>> most(pairs.size);
  for (std::size_t p = 0; p < pairs.size; ++p) {
    const std::size_t blocks = (hypotheses[p].id.size() + kGrain - 1) / kGrain;
    best_of_block[p].assign(blocks, Support{0, ~0u, 0});
    index_of_block[p].assign(blocks, 0);
    most[p] = 0;
  }
  exec.parallel_items(
      pairs.size, [&](std::size_t p) { return hypotheses[p].id.size(); }, kGrain,
      [&](std::size_t p, std::size_t begin, std::size_t end) {
        Support& best = best_of_block[p][begin / kGrain];
        PairScorer scorer(pairs[p], test, exact_limits, reach_limits);
        for (std::size_t k = begin; k < end; ++k) {
          const std::uint32_t needed = most[p].load(std::memory_order_relaxed);
          Support s = scorer.score(to_rigid(hypotheses[p].pose[k]), needed);
          s.hypothesis = hypotheses[p].id[k];
          if (!better(s, best)) continue;
          best = s;
          index_of_block[p][begin / kGrain] = k;
          std::uint32_t seen = most[p].load(std::memory_order_relaxed);
          while (s.inliers > seen &&
                 !most[p].compare_exchange_weak(seen, s.inliers, std::memory_order_relaxed)) {
          }
        }
      });
  std::vector<BestPose> out(pairs.size);
  for (std::size_t p = 0; p < pairs.size; ++p)
    for (std::size_t b = 0; b < best_of_block[p].size(); ++b) {
      if (out[p].found && !better(best_of_block[p][b], out[p].support)) continue;
      out[p].found = true;
      out[p].support = best_of_block[p][b];
      out[p].pose = widen(hypotheses[p].pose[index_of_block[p][b]]);
    }
  return out;
}

}  // namespace gpureg::cpu
