// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/accept.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "pose_graph/robust/robust.hpp"

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
             const std::vector<char>& joined, std::uint8_t scale, const Options& options)
      : state_(state),
        odometry_(odometry),
        agrees_(fits),
        scale_(scale),
        options_(options.acceptance) {
    for (std::size_t k = 0; k < state.loops.size(); ++k)
      if (!record(k).modes.empty()) order_.push_back(k);
    std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return mode(a).confidence > mode(b).confidence;
    });
    for (const std::size_t k : order_)
      if (joined[k] && !fits[k] && agrees_with_any(k, fits)) agrees_[k] = 1;
    find_alternatives();
  }

  /// @param frames_joined other loops have shown where the frames of the loop lie: it is held to
  /// the bound
  ///   of loops within one frame.
  Verdict verdict(std::size_t k, bool frames_joined) const {
    const Mode& own = mode(k);
    const bool connected = std::isfinite(own.drift_ratio);
    if (connected && own.confidence >= options_.alone && own.drift_ratio <= 1)
      return {true, LoopReason::confident};
    if (own.confidence < options_.confirmed) return {false, LoopReason::unconfirmed};
    const bool within = connected || frames_joined;
    const Support support = support_of(k, !within);
    if (support.confirming == 0) return {false, LoopReason::unconfirmed};
    const double correct = 1 / support.wrong - 1;
    const double against = connected ? 0 : alternative_odds(k);
    const double together = correct / (1 + correct + against);
    const bool enough = together >= (within ? options_.together : options_.between_frames);
    return {enough, enough ? LoopReason::confirmed : LoopReason::unconfirmed};
  }

  /// The frames that odometry gives the ends of a loop.
  std::pair<int, int> frames(std::size_t k) const {
    return std::minmax(odometry_.component(odometry_.position(record(k).source)),
                       odometry_.component(odometry_.position(record(k).target)));
  }

 private:
  const LoopRecord& record(std::size_t k) const { return state_.loops[k]; }
  const Mode& mode(std::size_t k) const { return record(k).modes[record(k).mode]; }

  /// A loop and the independent ones that agree with it.
  struct Support {
    double wrong = 1;  ///< probability that all of them are
    std::size_t confirming = 0;
    bool with_graph = false;  ///< a loop that fits the graph agrees with it
  };

  /// Keys of the modes that confirm the one of a loop.
  std::set<std::uint64_t> agreeing_with(std::size_t k) const {
    std::set<std::uint64_t> agreeing;
    const auto relations = state_.relations.find(record(k).key(record(k).mode));
    if (relations == state_.relations.end()) return agreeing;
    for (const Relation& relation : relations->second)
      if (relation.confirms && relation.agrees_from <= scale_) agreeing.insert(relation.other);
    return agreeing;
  }

  bool agrees_with_any(std::size_t k, const std::vector<char>& fits) const {
    const std::set<std::uint64_t> agreeing = agreeing_with(k);
    return std::any_of(order_.begin(), order_.end(), [&](std::size_t other) {
      return fits[other] && agreeing.count(record(other).key(record(other).mode)) > 0;
    });
  }

  /// Whether one of two fragments of one frame saw little that the other did not.
  bool at_one_place(FragmentId a, FragmentId b) const {
    const auto [found, fresh] = at_one_place_.try_emplace(pair_of(a, b), false);
    if (fresh) {
      const Node &first = state_.nodes.at(a), &second = state_.nodes.at(b);
      const auto second_from_first =
          to_pose(UnalignedIsometry3d(second.estimate.inverse() * first.estimate));
      found->second = expected_overlap(first.coarse(), second.coarse(), second_from_first, 0, 0) >
                      options_.same_place_overlap;
    }
    return found->second;
  }

  /// Whether two loops between the same frames compare the same place with the same place.
  bool at_one_place(std::size_t k, std::size_t other) const {
    const LoopRecord &own = record(k), &theirs = record(other);
    const auto frame = [&](FragmentId id) { return odometry_.component(odometry_.position(id)); };
    const bool straight = frame(own.source) == frame(theirs.source);
    return at_one_place(own.source, straight ? theirs.source : theirs.target) &&
           at_one_place(own.target, straight ? theirs.target : theirs.source);
  }

  /// Confirming loops are on the same side as the loop: they fit the graph, or do not.
  /// @param elsewhere loops of the same place confirm nothing: what looks alike there does so from
  /// everywhere.
  Support support_of(std::size_t k, bool elsewhere = false) const {
    Support out;
    out.wrong = 1 - mode(k).confidence;
    const std::set<std::uint64_t> agreeing = agreeing_with(k);
    const LoopRecord& own = record(k);
    std::set<FragmentId> used{own.loop.source, own.loop.target};
    for (const std::size_t other : order_) {
      if (other == k || agreeing.count(record(other).key(record(other).mode)) == 0) continue;
      out.with_graph |= agrees_[other] != 0;
      const Loop& loop = record(other).loop;
      if (agrees_[other] != agrees_[k] || out.confirming == kMostConfirming ||
          used.count(loop.source) || used.count(loop.target) ||
          (elsewhere && at_one_place(k, other)))
        continue;
      used.insert({loop.source, loop.target});
      out.wrong *= std::max(kLeastWrong, 1 - mode(other).confidence);
      ++out.confirming;
    }
    return out;
  }

  /// Loops that do not fit the graph may say where else one frame lies in the other. Near misses,
  /// which agree with loops that fit, do not.
  void find_alternatives() {
    for (const std::size_t k : order_) {
      if (agrees_[k]) continue;
      const auto between = frames(k);
      if (between.first == between.second) continue;
      const Support support = support_of(k);
      if (support.with_graph) continue;
      const double wrong =
          support.confirming > 0 ? support.wrong : std::max(kLeastWrong, support.wrong);
      double& odds = alternatives_[between];
      odds = std::max(odds, 1 / wrong - 1);
    }
  }

  /// Odds of the most likely alternative between the frames of a loop.
  double alternative_odds(std::size_t k) const {
    const auto at = alternatives_.find(frames(k));
    return at == alternatives_.end() ? 0 : at->second;
  }

  const State& state_;
  const Paths& odometry_;
  std::vector<char> agrees_;  ///< fits the graph, or did with loops that do
  std::uint8_t scale_;
  const AcceptanceOptions& options_;
  std::vector<std::size_t> order_;  ///< of the loops with poses, the most confident first
  std::map<std::pair<int, int>, double> alternatives_;  ///< odds, by frames
  mutable std::map<FragmentPair, bool> at_one_place_;   ///< of the pairs asked for so far
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
    for (Mode& mode : record.modes) {
      mode.drift_ratio =
          std::sqrt(squared_distance(uncertain(mode), tree.root_from(source)) / quantile);
      // Covariances too different in size to be added.
      if (!std::isfinite(mode.drift_ratio)) mode.drift_ratio = std::numeric_limits<double>::max();
    }
  }
}

bool within_drift(const Mode& mode, const Options& options) {
  return options.accept_by_graph_alone || std::isinf(mode.drift_ratio) ||
         mode.drift_ratio <= options.acceptance.max_drift_ratio;
}

std::vector<Verdict> accept_loops(const State& state, const Paths& odometry,
                                  const std::vector<char>& fits, std::uint8_t scale,
                                  const Options& options, std::vector<char>& joined) {
  std::vector<Verdict> verdicts(state.loops.size());
  if (options.accept_by_graph_alone) {
    for (std::size_t k = 0; k < fits.size(); ++k)
      if (fits[k]) verdicts[k] = {true, LoopReason::by_graph};
    return verdicts;
  }
  const Acceptance acceptance(state, odometry, fits, joined, scale, options);
  std::set<std::pair<int, int>> connected;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (!fits[k]) continue;
    const auto frames = acceptance.frames(k);
    if (connected.count(frames)) continue;  // judged below
    verdicts[k] = acceptance.verdict(k, false);
    if (verdicts[k].accepted && frames.first != frames.second) connected.insert(frames);
  }
  // All of these fit one graph. Refusing those that are a little less certain would also take the
  // certain ones what confirms them.
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (!fits[k] || verdicts[k].accepted || connected.count(acceptance.frames(k)) == 0) continue;
    verdicts[k] = acceptance.verdict(k, true);
    joined[k] = !verdicts[k].accepted;
  }
  return verdicts;
}

}  // namespace gpureg::loop_closure
