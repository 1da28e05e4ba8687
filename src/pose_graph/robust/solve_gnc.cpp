// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <utility>

#include "pose_graph/initialise.hpp"
#include "pose_graph/robust/consensus.hpp"
#include "pose_graph/robust/join_parts.hpp"
#include "pose_graph/robust/robust.hpp"

namespace gpureg::pose_graph {
namespace {

/// From level to level, loops of sets smaller by this factor are admitted.
constexpr int kLevelFactor = 4;
/// A loop takes part in the levels with at least this probability.
constexpr double kMinProbability = 0.5;

/// Sets of so many loops are hardly ever an alias of one place: they may enter all at once.
constexpr int kLargeSet = 16;
/// Where at least this share of the loops agrees with others, and is accepted by a graduation from
/// those, there is nothing that levels could improve.
constexpr double kNearlyAll = 0.9;

bool any_flag(const std::vector<char>& flags) {
  return std::find(flags.begin(), flags.end(), 1) != flags.end();
}

class GncSolver {
 public:
  GncSolver(const Problem& problem, const std::vector<char>& known, Control& control)
      : problem_(problem),
        known_(known),
        control_(control),
        quantile_(chi_square_quantile(control.options.gnc.inlier_probability)),
        equations_(problem, control.threads) {}

  Estimate run() {
    const std::vector<char> all(problem_.edges.size(), 1);
    Estimate start = first_estimate(all_edges(problem_).modes);
    if (!control_.options.gnc.consensus) return settled(graduated(start, all, true));
    const Consensus consensus = find_consensus(problem_, quantile_, control_.threads);
    if (consensus.largest_cluster < 2) return without_consensus(start);
    if (nearly_all_agree(consensus)) {
      // Without the few others the system stays sparse; then those that drift explains enter.
      std::vector<char> agreeing(problem_.edges.size(), 0);
      for (int k = 0; k < problem_.edge_count(); ++k) agreeing[k] = in_large_set(consensus, k);
      Estimate direct = joined(start, agreeing, true);
      if (!direct.failed && !control_.cancelled)
        direct = settled(joined(direct, explained(direct, all), false));
      if (direct.failed || control_.cancelled || keeps_nearly_all(direct)) return direct;
    }
    return settled(by_levels(start, consensus));
  }

 private:
  Estimate from_paths(const std::vector<char>& trusted, const std::vector<int>& modes) const {
    Estimate out;
    out.poses = problem_.poses;
    out.selection = {std::vector<double>(problem_.edges.size(), 0.0), modes};
    for (int k = 0; k < problem_.edge_count(); ++k)
      if (problem_.edges[k].odometry) out.selection.weights[k] = 1;
    poses_from_paths(problem_, known_, trusted, modes, out.poses);
    return out;
  }

  double cost_of(const Estimate& estimate) const {
    return truncated_cost(problem_, estimate.poses, quantile_, control_.threads);
  }

  /// The given poses, unless paths from the anchor fit better: poses of a file may be placeholders.
  Estimate first_estimate(const std::vector<int>& modes) {
    const std::vector<char> none(problem_.edges.size(), 0);
    Estimate given = from_paths(none, modes);
    given.initial_cost = given.cost = cost_of(given);
    if (!problem_.priors.empty() || !problem_.gravity.empty()) return given;
    const std::vector<char> before = known_;
    known_ = problem_.held;
    Estimate paths = from_paths(none, modes);
    paths.initial_cost = given.initial_cost;
    if (cost_of(paths) < given.cost) return paths;
    known_ = before;
    return given;
  }

  Estimate graduated(Estimate estimate, const std::vector<char>& candidates,
                     bool least_squares_first) {
    graduate(problem_, equations_, candidates, least_squares_first, quantile_, control_, estimate);
    return estimate;
  }

  /// The estimate with nearly all loops: least squares where noise explains all that is left.
  Estimate joined(const Estimate& estimate, const std::vector<char>& candidates,
                  bool least_squares_first) {
    Estimate together = estimate;
    if (fit_all(problem_, equations_, candidates, quantile_, control_, together) ||
        together.failed || control_.cancelled)
      return together;
    return graduated(least_squares_first ? std::move(together) : estimate, candidates, false);
  }

  Estimate settled(Estimate estimate) {
    if (!estimate.failed && !control_.cancelled)
      settle(problem_, equations_, quantile_, control_, estimate);
    return estimate;
  }

  bool consistent(const Consensus& consensus, int k) const {
    return !problem_.edges[k].odometry && consensus.cluster_size[k] >= 2 &&
           consensus.probability[k] >= kMinProbability;
  }

  bool in_large_set(const Consensus& consensus, int k) const {
    return consistent(consensus, k) && consensus.cluster_size[k] >= kLargeSet;
  }

  bool nearly_all_agree(const Consensus& consensus) const {
    int loops = 0, agree = 0;
    for (int k = 0; k < problem_.edge_count(); ++k) {
      loops += !problem_.edges[k].odometry;
      agree += in_large_set(consensus, k);
    }
    return agree >= kNearlyAll * loops;
  }

  bool keeps_nearly_all(const Estimate& estimate) const {
    int loops = 0, kept = 0;
    for (int k = 0; k < problem_.edge_count(); ++k) {
      if (problem_.edges[k].odometry) continue;
      ++loops;
      kept += estimate.selection.weights[k] > 0.5;
    }
    return kept >= kNearlyAll * loops;
  }

  /// No two loops agree: nothing is known beforehand. Of the graduation from all loops and the one
  /// from the initial poses the better by its cost.
  Estimate without_consensus(const Estimate& start) {
    const std::vector<char> all(problem_.edges.size(), 1);
    Estimate first = settled(graduated(start, all, true));
    if (first.failed || control_.cancelled) return first;
    Estimate second = settled(graduated(start, explained(start, all), false));
    return second.failed || second.cost >= first.cost ? first : second;
  }

  std::vector<char> explained(const Estimate& estimate, const std::vector<char>& asked) {
    return explained_by_drift(problem_, equations_, asked, quantile_, control_, estimate);
  }

  /// Loops of the largest sets first. Later ones must be explained by the drift of the estimate.
  Estimate by_levels(Estimate estimate, const Consensus& consensus) {
    const int edges = problem_.edge_count();
    std::vector<char> admitted(edges, 0), seen(edges, 0);
    bool first = true;
    for (int size = consensus.largest_cluster;; size /= kLevelFactor) {
      const bool last = size < 2 * kLevelFactor;
      std::vector<char> fresh(edges, 0);
      for (int k = 0; k < edges; ++k) {
        if (problem_.edges[k].odometry || seen[k]) continue;
        const bool in =
            consistent(consensus, k) && consensus.cluster_size[k] >= size / kLevelFactor;
        fresh[k] = in || last;
        seen[k] = fresh[k];
      }
      if (any_flag(fresh)) {
        for (int k = 0; k < edges; ++k)
          if (fresh[k]) estimate.selection.modes[k] = consensus.modes[k];
        bool joined = false;
        if (first) {
          poses_from_paths(problem_, known_, fresh, estimate.selection.modes, estimate.poses);
        } else {
          joined = join_parts(problem_, known_, seen, quantile_, estimate);
          for (int k = 0; k < edges; ++k)
            admitted[k] = admitted[k] || estimate.selection.weights[k] > 0.5;
          fresh = explained(estimate, fresh);
        }
        for (int k = 0; k < edges; ++k) admitted[k] = admitted[k] || fresh[k];
        // Least squares is a good start while nearly all loops are correct. Among later loops may
        // be false ones that agree with each other; then the estimate is a better start.
        if (first || joined || any_flag(fresh))
          estimate = graduated(std::move(estimate), admitted, first);
        first = false;
        if (estimate.failed || control_.cancelled) return estimate;
      }
      if (last) break;
    }
    return estimate;
  }

  const Problem& problem_;
  std::vector<char> known_;  ///< nodes whose pose is given
  Control& control_;
  double quantile_;
  NormalEquations equations_;
};

}  // namespace

Estimate solve_gnc(const Problem& problem, const std::vector<char>& known, Control& control) {
  return GncSolver(problem, known, control).run();
}

}  // namespace gpureg::pose_graph
