// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/accept.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "pose_graph/robust.hpp"

namespace gpureg::loop_closure {
namespace {

/// Registrations of neighbouring fragments fail together: a confirming loop is never less likely to
/// be wrong than this.
constexpr double kLeastWrong = 0.2;
/// Loops that confirm one loop; more add nothing.
constexpr std::size_t kMostConfirming = 4;
constexpr double kNever = std::numeric_limits<double>::infinity();

class Acceptance {
 public:
  Acceptance(const State& state, const Paths& odometry, const std::vector<char>& fits,
             std::uint8_t scale, const Options& options)
      : state_(state),
        odometry_(odometry),
        fits_(fits),
        scale_(scale),
        options_(options.acceptance) {
    for (std::size_t k = 0; k < state.loops.size(); ++k)
      if (fits[k]) order_.push_back(k);
    std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return mode(a).confidence > mode(b).confidence;
    });
    count_rejections();
  }

  Verdict verdict(std::size_t k) {
    const Mode& own = mode(k);
    const bool connected = std::isfinite(own.drift_ratio);
    if (connected && own.confidence >= options_.alone && own.drift_ratio <= 1)
      return {true, LoopReason::confident};
    if (own.confidence < options_.confirmed) return {false, LoopReason::unconfirmed};
    const double wrong = wrong_together(k);
    if (wrong >= 1) return {false, LoopReason::unconfirmed};
    const double correct = 1 / wrong - 1;
    const double against = connected ? 0 : rejected_odds(k);
    const double together = correct / (1 + correct + against);
    const bool enough = together >= (connected ? options_.together : options_.between_frames);
    return {enough, enough ? LoopReason::confirmed : LoopReason::unconfirmed};
  }

 private:
  const LoopRecord& record(std::size_t k) const { return state_.loops[k]; }
  const Mode& mode(std::size_t k) const { return record(k).modes[record(k).mode]; }

  std::pair<int, int> frames(std::size_t k) const {
    return std::minmax(odometry_.component(odometry_.position(record(k).source)),
                       odometry_.component(odometry_.position(record(k).target)));
  }

  /// Odds that one of the loops that the graph rejects between two frames is correct.
  void count_rejections() {
    for (std::size_t k = 0; k < state_.loops.size(); ++k) {
      if (fits_[k] || record(k).modes.empty()) continue;
      const auto between = frames(k);
      if (between.first == between.second) continue;
      auto [wrong, first] = rejected_wrong_.try_emplace(between, 1.0);
      wrong->second *= std::max(kLeastWrong, 1 - record(k).modes.front().confidence);
    }
  }

  double rejected_odds(std::size_t k) const {
    const auto at = rejected_wrong_.find(frames(k));
    return at == rejected_wrong_.end() ? 0 : 1 / at->second - 1;
  }

  /// Probability that the loop and all that confirm it are wrong; 1: nothing confirms it.
  double wrong_together(std::size_t k) {
    const LoopRecord& own = record(k);
    const auto relations = state_.relations.find(own.key(own.mode));
    if (relations == state_.relations.end()) return 1;
    std::set<std::uint64_t> agreeing;
    for (const Relation& relation : relations->second)
      if (relation.agrees_from <= scale_) agreeing.insert(relation.other);
    std::set<FragmentId> used{own.loop.source, own.loop.target};
    double wrong = 1 - mode(k).confidence;
    std::size_t count = 0;
    for (const std::size_t other : order_) {
      const Loop& loop = record(other).loop;
      if (other == k || used.count(loop.source) || used.count(loop.target)) continue;
      if (agreeing.count(record(other).key(record(other).mode)) == 0) continue;
      used.insert({loop.source, loop.target});
      wrong *= std::max(kLeastWrong, 1 - mode(other).confidence);
      if (++count == kMostConfirming) break;
    }
    return count == 0 ? 1 : wrong;
  }

  const State& state_;
  const Paths& odometry_;
  const std::vector<char>& fits_;
  std::uint8_t scale_;
  const AcceptanceOptions& options_;
  std::vector<std::size_t> order_;  ///< of the loops that fit, the most confident first
  std::map<std::pair<int, int>, double> rejected_wrong_;
};

}  // namespace

UncertainPose uncertain(const Mode& mode) {
  return {to_pose(mode.target_from_source), pose_graph::covariance_of(mode.information)};
}

double squared_distance(const UncertainPose& a, const UncertainPose& b) {
  const Vector6d e = pose_graph::log(a.pose.inverse() * b.pose);
  const Matrix6d covariance = a.covariance + b.covariance;
  return e.dot(covariance.llt().solve(e));
}

void compute_drift_ratios(State& state, const Paths& odometry, const Options& options) {
  const double quantile = pose_graph::chi_square_quantile(options.acceptance.drift_probability);
  for (LoopRecord& record : state.loops) {
    if (record.gated || record.modes.empty()) continue;
    record.gated = true;
    const int source = odometry.position(record.source);
    const int target = odometry.position(record.target);
    const bool connected = odometry.component(source) == odometry.component(target);
    if (!connected) {
      for (Mode& mode : record.modes) mode.drift_ratio = kNever;
      continue;
    }
    PathTree tree = odometry.tree(target);
    for (Mode& mode : record.modes)
      mode.drift_ratio =
          std::sqrt(squared_distance(uncertain(mode), tree.root_from(source)) / quantile);
  }
}

bool within_drift(const Mode& mode, const Options& options) {
  return options.accept_by_graph_alone || std::isinf(mode.drift_ratio) ||
         mode.drift_ratio <= options.acceptance.max_drift_ratio;
}

std::vector<Verdict> accept_loops(const State& state, const Paths& odometry,
                                  const std::vector<char>& fits, std::uint8_t scale,
                                  const Options& options) {
  std::vector<Verdict> verdicts(state.loops.size());
  if (options.accept_by_graph_alone) {
    for (std::size_t k = 0; k < fits.size(); ++k)
      if (fits[k]) verdicts[k] = {true, LoopReason::by_graph};
    return verdicts;
  }
  Acceptance acceptance(state, odometry, fits, scale, options);
  for (std::size_t k = 0; k < fits.size(); ++k)
    if (fits[k]) verdicts[k] = acceptance.verdict(k);
  return verdicts;
}

}  // namespace gpureg::loop_closure
