// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>
#include <algorithm>
#include <optional>
#include <utility>

#include "loop_closure/commands.hpp"
#include "pose_graph/validate.hpp"

namespace gpureg::loop_closure {
namespace {

using pose_graph::kLargestInformation;
/// Variance that is added where a covariance has no inverse, as a share of the largest one.
constexpr double kRegularisation = 1e-9;
/// Ten times as much each time: the last is a thousand times the covariance.
constexpr int kMostAttempts = 13;

/// An inverse that pose graphs take. Where rounding leaves the covariance none, the inverse of a
/// larger covariance: no more certainty than there was. Nearly none where it is not finite.
UnalignedMatrix6d inverse_of(const Matrix6d& covariance) {
  Matrix6d regular = covariance;
  double added = std::max(1 / kLargestInformation,
                          kRegularisation * covariance.diagonal().cwiseAbs().maxCoeff());
  for (int attempt = 0; attempt < kMostAttempts; ++attempt, added *= 10) {
    const Eigen::LLT<Matrix6d> factor(regular);
    const Matrix6d inverse = factor.solve(Matrix6d::Identity());
    const Matrix6d information = 0.5 * (inverse + inverse.transpose());
    if (factor.info() == Eigen::Success && information.cwiseAbs().maxCoeff() <= kLargestInformation)
      return UnalignedMatrix6d(information);
    regular = covariance;
    regular.diagonal().array() += added;
  }
  return UnalignedMatrix6d(UnalignedMatrix6d::Identity() / kLargestInformation);
}

UncertainPose uncertain(const UnalignedIsometry3d& pose, const UnalignedMatrix6d& information) {
  return {to_pose(pose), pose_graph::covariance_of(information)};
}

/// Both measurements of one pose together.
UncertainPose fused(const UncertainPose& a, const UncertainPose& b) {
  const Matrix6d weight = inverse_of(a.covariance), other = inverse_of(b.covariance);
  const Matrix6d covariance = inverse_of(weight + other);
  const Vector6d step = covariance * (other * pose_graph::log(a.pose.inverse() * b.pose));
  return {pose_graph::retract(a.pose, step), covariance};
}

/// An edge seen from the removed node.
struct Spoke {
  FragmentId other = 0;
  UncertainPose other_from_node;
  bool modelled = false;
  double length = 0;
  std::uint32_t steps = 0;
  bool implied = false;
};

Spoke spoke_of(FragmentId node, FragmentId source, FragmentId target,
               const UncertainPose& target_from_source) {
  Spoke spoke;
  spoke.other = source == node ? target : source;
  spoke.other_from_node = source == node ? target_from_source : target_from_source.inverse();
  return spoke;
}

class Marginaliser {
 public:
  Marginaliser(State& state, FragmentId id) : state_(state), id_(id) {}

  void run() {
    gather();
    choose_hub();
    if (hub_) {
      move_odometry();
      move_loops();
    }
    forget();
  }

 private:
  bool touches(FragmentId source, FragmentId target) const {
    return source == id_ || target == id_;
  }

  void gather() {
    for (const Odometry& edge : state_.odometry)
      if (touches(edge.source, edge.target)) {
        odometry_.push_back(spoke_of(id_, edge.source, edge.target,
                                     uncertain(edge.target_from_source, edge.information)));
        odometry_.back().modelled = edge.modelled;
        odometry_.back().length = edge.length;
        odometry_.back().steps = edge.steps;
        odometry_.back().implied = edge.implied;
      }
  }

  /// The best-known neighbour; accepted loops where there is no odometry.
  void choose_hub() {
    std::vector<Spoke> spokes = odometry_;
    if (spokes.empty())
      for (const LoopRecord& record : state_.loops)
        if (record.loop.state == LoopState::accepted && touches(record.source, record.target))
          spokes.push_back(spoke_of(id_, record.source, record.target, chosen(record)));
    for (const Spoke& spoke : spokes) {
      const double trace = spoke.other_from_node.inverse().covariance.trace();
      if (!hub_ || trace < hub_trace_) {
        hub_ = spoke;
        hub_trace_ = trace;
      }
    }
    if (!hub_) return;
    // Parallel edges to the hub are one.
    bool first = true;
    for (const Spoke& spoke : odometry_) {
      if (spoke.other != hub_->other) continue;
      hub_->other_from_node =
          first ? spoke.other_from_node : fused(hub_->other_from_node, spoke.other_from_node);
      first = false;
    }
    for (const LoopRecord& record : state_.loops) {
      if (record.loop.state != LoopState::accepted || odometry_.empty() ||
          !touches(record.source, record.target))
        continue;
      const Spoke spoke = spoke_of(id_, record.source, record.target, chosen(record));
      if (spoke.other == hub_->other)
        hub_->other_from_node = fused(hub_->other_from_node, spoke.other_from_node);
    }
  }

  static UncertainPose chosen(const LoopRecord& record) {
    const Mode& mode = record.modes[record.mode];
    return uncertain(mode.target_from_source, mode.information);
  }

  /// target_from_source of an edge whose end at the node moves to the hub.
  UncertainPose moved(FragmentId source, const UncertainPose& target_from_source) const {
    if (source == id_) return target_from_source * hub_->other_from_node.inverse();
    return hub_->other_from_node * target_from_source;
  }

  void move_odometry() {
    for (Odometry& edge : state_.odometry) {
      if (!touches(edge.source, edge.target)) continue;
      const UncertainPose pose =
          moved(edge.source, uncertain(edge.target_from_source, edge.information));
      (edge.source == id_ ? edge.source : edge.target) = hub_->other;
      edge.target_from_source = rigid(to_isometry(pose.pose));
      edge.information = inverse_of(pose.covariance);
      edge.modelled = edge.modelled && hub_->modelled;
      edge.length += hub_->length;
      edge.steps += hub_->steps;
      edge.implied = edge.implied && hub_->implied;
    }
  }

  void move_loops() {
    for (LoopRecord& record : state_.loops) {
      if (!touches(record.source, record.target)) continue;
      for (Mode& mode : record.modes) {
        const UncertainPose pose =
            moved(record.source, uncertain(mode.target_from_source, mode.information));
        mode.target_from_source = rigid(to_isometry(pose.pose));
        mode.information = inverse_of(pose.covariance);
      }
      (record.source == id_ ? record.source : record.target) = hub_->other;
      record.expanded = true;
    }
  }

  /// Edges from a node to itself, rejected loops and whatever still names the fragment.
  void forget() {
    const auto drop = [](auto& list, const auto& superfluous) {
      list.erase(std::remove_if(list.begin(), list.end(), superfluous), list.end());
    };
    const auto gone = [&](const auto& edge) {
      return edge.source == edge.target || touches(edge.source, edge.target);
    };
    drop(state_.odometry, gone);
    drop(state_.loops, [&](const LoopRecord& record) {
      const bool mine = record.loop.source == id_ || record.loop.target == id_;
      const bool alive =
          record.loop.state == LoopState::accepted || record.loop.state == LoopState::candidate;
      return gone(record) || (mine && !alive);
    });
    drop(state_.queue, gone);
    for (auto pair = state_.known.begin(); pair != state_.known.end();)
      pair = touches(pair->first, pair->second) ? state_.known.erase(pair) : std::next(pair);
    state_.relations.clear();
    state_.nodes.erase(id_);
    state_.poses_changed = true;
  }

  State& state_;
  FragmentId id_;
  std::vector<Spoke> odometry_;
  std::optional<Spoke> hub_;
  double hub_trace_ = 0;
};

}  // namespace

void remove_fragment(State& state, FragmentId id) { Marginaliser(state, id).run(); }

}  // namespace gpureg::loop_closure
