// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/verify.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "loop_closure/accept.hpp"
#include "loop_closure/noise.hpp"
#include "loop_closure/relations.hpp"
#include "math/exponential.hpp"
#include "pose_graph/robust/robust.hpp"

namespace gpureg::loop_closure {
namespace {

/// Loops that the acceptance refuses are left out and the rest optimised again at most so often.
constexpr int kMostRounds = 12;
/// Quantile of the chi-square distribution that bounds the residuals of accepted loops.
constexpr double kResidualProbability = 0.99;
/// A loop's residual exceeds the noise that the accepted loops show together from so many times
/// their upper quartile on. bench/loop_closure: 3 loses more true loops, 4 keeps more false ones.
constexpr double kFence = 3.5;
/// Loops from whose residuals the noise is estimated; fewer are held to the stated noise.
constexpr std::size_t kLeastResiduals = 8;
/// The estimated standard deviation is at least this share of the stated one.
constexpr double kLeastNoise = 1.0 / 3;
/// Largest factor on the covariance of an edge, of no length nearly: its information stays > 0.
constexpr double kMostCorrelated = 1e18;
/// Log odds that no confidence exceeds: 0.999, as of registrations.
constexpr double kCertainLogOdds = 6.9;

/// Degrees of freedom of Student's t distribution of the residuals of loops, by which loops weigh
/// in the last solution: registrations have heavier tails than their covariances (Lange, Little and
/// Taylor 1989, who find 4 to suit most data).
constexpr double kDegreesOfFreedom = 4;
/// Correlation of two loops that share a fragment, where errors inside of fragments are all that
/// their registrations have: each of two fragments has half of the error.
constexpr double kSharedFragment = 0.5;
/// Solutions with these weights; later ones change poses by less than millimetres.
constexpr int kWeightedRounds = 3;

/// @param noise on the standard deviations of modelled odometry.
pose_graph::Graph graph_without_loops(const State& state, const Options& options,
                                      const NoiseScales& noise) {
  pose_graph::Graph graph;
  for (const auto& [id, node] : state.nodes) {
    graph.nodes.push_back({id, node.estimate, false});
    if (options.gravity_sigma > 0 && node.up)
      graph.gravity.push_back({id, *node.up, options.gravity_sigma});
  }
  for (const Odometry& odometry : state.odometry) {
    pose_graph::Edge edge;
    edge.source = odometry.source;
    edge.target = odometry.target;
    edge.target_from_source = odometry.target_from_source;
    edge.information = odometry.information;
    if (odometry.modelled) {
      // Edges of a graph are independent: each takes its share of the errors of one sign.
      const double factor =
          odometry.length > 0
              ? std::clamp(options.drift_correlation * odometry.steps / odometry.length, 1.0,
                           kMostCorrelated)
              : 1;
      if (noise.rotation == noise.translation)
        *edge.information /= factor * noise.rotation * noise.rotation;
      else
        edge.information =
            scaled_information(*edge.information, noise.rotation, noise.translation, 1 / factor);
    }
    edge.kind = pose_graph::EdgeKind::odometry;
    graph.edges.push_back(edge);
  }
  return graph;
}

/// Adds the loop with the modes that may take part. @return which they are.
std::vector<std::uint32_t> add_loop(const LoopRecord& record, const Options& options,
                                    pose_graph::Graph& graph) {
  std::vector<std::uint32_t> modes;
  pose_graph::Edge edge;
  edge.source = record.source;
  edge.target = record.target;
  for (std::uint32_t k = 0; k < record.modes.size(); ++k) {
    const Mode& mode = record.modes[k];
    if (!within_drift(mode, options)) continue;
    modes.push_back(k);
    if (modes.size() == 1) {
      edge.target_from_source = mode.target_from_source;
      edge.information = mode.information;
      edge.confidence = mode.confidence;
    } else {
      edge.alternatives.push_back({mode.target_from_source, mode.information, mode.confidence});
    }
  }
  if (!modes.empty()) graph.edges.push_back(std::move(edge));
  return modes;
}

class Verifier {
 public:
  Verifier(State& state, const Options& options, const std::function<bool()>& should_stop)
      : state_(state),
        options_(options),
        should_stop_(should_stop),
        odometry_(state, false, options),
        excluded_(state.loops.size(), 0),
        fitted_(state.loops.size(), 0),
        joined_(state.loops.size(), 0) {
    if (options.accept_by_graph_alone) return;
    compute_drift_ratios(state, odometry_, options);
    update_relations(state, odometry_, options);
    scale_ = drift_scale(state);
  }

  Verification run() {
    std::vector<Verdict> verdicts;
    pose_graph::Result result;
    for (int round = 0; round < kMostRounds; ++round) {
      result = optimise();
      const Verification so_far{result.status, result.reason};
      if (!so_far.decided()) return so_far;
      bool refused = drop_contradicted();
      verdicts = accept_loops(state_, odometry_, fits_, scale_, options_, joined_);
      for (std::size_t k = 0; k < fits_.size(); ++k) {
        if (!fits_[k]) continue;
        fitted_[k] = 1;
        if (verdicts[k].accepted) continue;
        excluded_[k] = 1;
        refused = true;
      }
      if (!refused && !drop_residuals()) break;
    }
    conclude(verdicts);
    if (options_.optimize) {
      if (!options_.accept_by_graph_alone) result = weighted(std::move(result));
      if (result.status == pose_graph::Status::cancelled) return {result.status, result.reason};
      move(result);
    }
    return {result.status, result.reason};
  }

 private:
  /// Odometry of little certainty bends to loops that contradict each other: the graph alone keeps
  /// them.
  bool drop_contradicted() {
    if (options_.accept_by_graph_alone) return false;
    const std::vector<char> dropped = contradicted(state_, fits_, scale_);
    bool any = false;
    for (std::size_t k = 0; k < dropped.size(); ++k) {
      if (!dropped[k]) continue;
      fits_[k] = fitted_[k] = 0;
      excluded_[k] = any = true;
    }
    return any;
  }

  /// Leaves out accepted loops whose residual in the joint solution exceeds the noise that the
  /// others show: near misses, which odometry bends to. The worst go first, since they move others.
  bool drop_residuals() {
    if (options_.accept_by_graph_alone) return false;
    std::vector<double> errors;
    for (std::size_t k = 0; k < fits_.size(); ++k)
      if (fits_[k]) errors.push_back(squared_errors_[k]);
    if (errors.empty()) return false;
    const double stated = pose_graph::chi_square_quantile(kResidualProbability);
    double bound = stated;
    if (errors.size() >= kLeastResiduals) {
      const auto upper = errors.begin() + static_cast<std::ptrdiff_t>(3 * errors.size() / 4);
      std::nth_element(errors.begin(), upper, errors.end());
      bound = std::clamp(kFence * *upper, portable::square(kLeastNoise) * stated, stated);
    }
    // As in the objective of the graph, confidence is worth squared error.
    const auto excess = [&](std::size_t k) {
      const double p = state_.loops[k].modes[state_.loops[k].mode].confidence;
      const double odds = p < 1 ? portable::log(p / (1 - p)) : kCertainLogOdds;
      return squared_errors_[k] /
             (bound * (1 + 2 * std::clamp(odds, 0.0, kCertainLogOdds) / stated));
    };
    double worst = 1;
    for (std::size_t k = 0; k < fits_.size(); ++k)
      if (fits_[k]) worst = std::max(worst, excess(k));
    if (worst <= 1) return false;
    const double limit = std::max(1.0, 0.5 * worst);
    for (std::size_t k = 0; k < fits_.size(); ++k) {
      if (!fits_[k] || excess(k) <= limit) continue;
      fits_[k] = fitted_[k] = 0;
      excluded_[k] = 1;
    }
    return true;
  }

  pose_graph::Options graph_options() const {
    pose_graph::Options out = options_.graph;
    out.marginals.clear();
    if (should_stop_)
      out.should_stop = [this](const pose_graph::Progress& progress) {
        const auto& theirs = options_.graph.should_stop;
        return should_stop_() || (theirs && theirs(progress));
      };
    return out;
  }

  /// The poses by the accepted loops alone, from those of the last round, with the noise that their
  /// misclosures show. Otherwise the small errors of loops would replace better odometry. As before
  /// where this is not decided.
  pose_graph::Result weighted(pose_graph::Result before) {
    std::vector<const Mode*> modes;
    std::vector<std::pair<FragmentId, FragmentId>> ends;
    for (const LoopRecord& record : state_.loops) {
      if (record.loop.state != LoopState::accepted) continue;
      modes.push_back(&record.modes[record.mode]);
      ends.emplace_back(record.source, record.target);
    }
    if (modes.empty()) return before;
    const NoiseScales noise = estimate_noise(state_, odometry_, kDriftScales[scale_]);
    pose_graph::Graph graph = graph_without_loops(state_, options_, noise);
    const std::size_t first = graph.edges.size();
    for (std::size_t k = 0; k < modes.size(); ++k) {
      pose_graph::Edge edge;
      edge.source = ends[k].first;
      edge.target = ends[k].second;
      edge.target_from_source = modes[k]->target_from_source;
      graph.edges.push_back(edge);
    }
    pose_graph::Options options = graph_options();
    options.robust = pose_graph::Robust::none;
    // The loops of a fragment count as fewer: the design effect of clusters (Kish 1965).
    std::map<FragmentId, int> loops;
    for (const auto& [source, target] : ends) {
      ++loops[source];
      ++loops[target];
    }
    std::vector<double> shares, weights(modes.size(), 1);
    for (const auto& [source, target] : ends)
      shares.push_back(1 / (1 + kSharedFragment * (0.5 * (loops[source] + loops[target]) - 1)));
    for (int round = 0; round < kWeightedRounds; ++round) {
      for (std::size_t k = 0; k < graph.nodes.size(); ++k)
        graph.nodes[k].world_from_node = before.world_from_node[k];
      for (std::size_t k = 0; k < modes.size(); ++k)
        graph.edges[first + k].information =
            scaled_information(modes[k]->information, noise.loop_rotation, noise.loop_translation,
                               shares[k] * weights[k]);
      pose_graph::Result next = pose_graph::optimize(graph, options);
      if (next.status == pose_graph::Status::cancelled) return next;
      if (next.status == pose_graph::Status::failed) return before;
      before.world_from_node = std::move(next.world_from_node);
      for (std::size_t k = 0; k < modes.size(); ++k)
        weights[k] =
            (kDegreesOfFreedom + 6) /
            (kDegreesOfFreedom + next.edges[first + k].squared_error / (shares[k] * weights[k]));
    }
    return before;
  }

  pose_graph::Result optimise() {
    pose_graph::Graph graph =
        graph_without_loops(state_, options_, {kDriftScales[scale_], kDriftScales[scale_]});
    const std::size_t first = graph.edges.size();
    std::vector<std::size_t> loops;
    std::vector<std::vector<std::uint32_t>> modes;
    for (std::size_t k = 0; k < state_.loops.size(); ++k) {
      if (excluded_[k]) continue;
      std::vector<std::uint32_t> used = add_loop(state_.loops[k], options_, graph);
      if (used.empty()) continue;
      loops.push_back(k);
      modes.push_back(std::move(used));
    }
    const pose_graph::Result result = pose_graph::optimize(graph, graph_options());
    fits_.assign(state_.loops.size(), 0);
    squared_errors_.assign(state_.loops.size(), 0);
    if (result.edges.size() != graph.edges.size()) return result;
    for (std::size_t k = 0; k < loops.size(); ++k) {
      const pose_graph::EdgeResult& edge = result.edges[first + k];
      LoopRecord& record = state_.loops[loops[k]];
      record.loop.weight = edge.weight;
      if (edge.state != pose_graph::EdgeState::accepted) continue;
      fits_[loops[k]] = 1;
      squared_errors_[loops[k]] = edge.squared_error;
      choose_mode(record, modes[k][edge.mode]);
    }
    return result;
  }

  void conclude(const std::vector<Verdict>& verdicts) {
    for (std::size_t k = 0; k < state_.loops.size(); ++k) {
      LoopRecord& record = state_.loops[k];
      if (record.modes.empty()) continue;
      Loop& loop = record.loop;
      const bool was_accepted =
          loop.state == LoopState::accepted || loop.state == LoopState::retracted;
      if (fits_[k] && verdicts[k].accepted) {
        // Frames that become one have new overlaps, wherever their poses were.
        merged_ |= loop.state != LoopState::accepted && std::isinf(loop.drift_ratio);
        loop.state = LoopState::accepted;
        loop.reason = verdicts[k].reason;
        continue;
      }
      if (!options_.accept_by_graph_alone) loop.weight = 0;
      const bool possible =
          std::any_of(record.modes.begin(), record.modes.end(),
                      [&](const Mode& mode) { return within_drift(mode, options_); });
      if (!possible) {
        choose_mode(record, 0);
        loop.state = was_accepted ? LoopState::retracted : LoopState::candidate;
        loop.reason = LoopReason::exceeds_drift;
      } else if (fitted_[k]) {
        loop.state = was_accepted ? LoopState::retracted : LoopState::candidate;
        loop.reason = was_accepted ? LoopReason::lost_confirmation : LoopReason::unconfirmed;
      } else {
        loop.state = was_accepted ? LoopState::retracted : LoopState::rejected;
        loop.reason = LoopReason::inconsistent;
      }
    }
  }

  /// Takes over the poses; where they moved far, other pairs overlap than before.
  void move(const pose_graph::Result& result) {
    const double far = 0.5 * options_.proposals.coarse_voxel_size;
    bool look = merged_;
    std::size_t k = 0;
    for (auto& [id, node] : state_.nodes) {
      const UnalignedIsometry3d& pose = result.world_from_node[k++];
      look |= (pose.translation() - node.estimate.translation()).norm() > far;
      node.estimate = rigid(pose);
    }
    state_.poses_changed = true;
    if (look)
      for (auto& [id, node] : state_.nodes) node.look_within = true;
  }

  State& state_;
  const Options& options_;
  const std::function<bool()>& should_stop_;
  Paths odometry_;
  std::vector<char> excluded_, fitted_, fits_;
  std::vector<char> joined_;            ///< see accept_loops()
  std::vector<double> squared_errors_;  ///< of the loops that fit
  std::uint8_t scale_ = 0;              ///< place in kDriftScales
  bool merged_ = false;
};

}  // namespace

Verification verify_loops(State& state, const Options& options,
                          const std::function<bool()>& should_stop) {
  const bool any = std::any_of(state.loops.begin(), state.loops.end(),
                               [](const LoopRecord& record) { return !record.modes.empty(); });
  if (!any && options.gravity_sigma == 0 && state.odometry.size() < state.nodes.size()) {
    state.graph_changed = false;
    return {};
  }
  State next(state);
  next.graph_changed = false;
  Verification out = Verifier(next, options, should_stop).run();
  if (out.decided()) state = std::move(next);
  return out;
}

pose_graph::Graph accepted_graph(const State& state, const Options& options) {
  pose_graph::Graph graph = graph_without_loops(state, options, {});
  for (const LoopRecord& record : state.loops) {
    if (record.loop.state != LoopState::accepted) continue;
    const Mode& mode = record.modes[record.mode];
    pose_graph::Edge edge;
    edge.source = record.source;
    edge.target = record.target;
    edge.target_from_source = mode.target_from_source;
    edge.information = mode.information;
    edge.confidence = mode.confidence;
    graph.edges.push_back(edge);
  }
  return graph;
}

}  // namespace gpureg::loop_closure
