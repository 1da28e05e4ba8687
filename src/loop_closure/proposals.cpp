// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/proposals.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "loop_closure/paths.hpp"
#include "math/exponential.hpp"

namespace gpureg::loop_closure {
namespace {

/// Odometry edges from the ends of a candidate to those of a loop that would confirm it.
constexpr int kConfirmingHops = 3;
/// Candidates below are not worth further registrations.
constexpr double kMinExpandedConfidence = 0.25;
/// Fractional part of the golden ratio: its multiples cover [0, 1) evenly, however many there are.
constexpr double kGolden = 0.6180339887498949;

struct Scored {
  double value = 0;
  FragmentId source = 0, target = 0;
};

bool better(const Scored& a, const Scored& b) {
  return std::make_tuple(-a.value, a.source, a.target) <
         std::make_tuple(-b.value, b.source, b.target);
}

bool any_due(const State& state) {
  return std::any_of(state.nodes.begin(), state.nodes.end(), [](const auto& entry) {
    return entry.second.look_within || entry.second.look_between;
  });
}

bool any_to_confirm(const State& state) {
  return std::any_of(state.loops.begin(), state.loops.end(), [](const LoopRecord& record) {
    return record.loop.state == LoopState::candidate && !record.expanded;
  });
}

class Proposer {
 public:
  Proposer(State& state, const Options& options)
      : state_(state),
        all_(options),
        options_(options.proposals),
        noise_(options.noise.translation) {}

  void run() {
    const Paths graph(state_, true, all_);
    drop_superfluous(graph);
    for (auto& [id, node] : state_.nodes) {
      if (node.look_within) within_frame(graph, id, node);
      if (node.look_between) between_frames(graph, id, node);
      node.look_within = node.look_between = false;
    }
    confirm_candidates();
    std::sort(state_.queue.begin(), state_.queue.end(), [](const Proposal& a, const Proposal& b) {
      const auto key = [](const Proposal& p) {
        return std::make_tuple(p.kind, p.order, -p.value, p.source, p.target);
      };
      return key(a) > key(b);  // the next one last
    });
  }

 private:
  void push(const Scored& pair, ProposalKind kind) {
    if (!state_.known.insert(pair_of(pair.source, pair.target)).second) return;
    Proposal proposal;
    proposal.source = pair.source;
    proposal.target = pair.target;
    proposal.kind = kind;
    proposal.value = pair.value;
    state_.queue.push_back(proposal);
  }

  bool known(FragmentId a, FragmentId b) const { return state_.known.count(pair_of(a, b)) > 0; }

  /// Between fragments that are in one frame by now, overlap decides.
  void drop_superfluous(const Paths& graph) {
    std::vector<Proposal> kept;
    for (const Proposal& proposal : state_.queue) {
      const bool together = graph.component(graph.position(proposal.source)) ==
                            graph.component(graph.position(proposal.target));
      if (proposal.kind == ProposalKind::between_frames && together)
        state_.known.erase(pair_of(proposal.source, proposal.target));
      else
        kept.push_back(proposal);
    }
    state_.queue = std::move(kept);
  }

  /// Earlier fragments of the frame by expected gain: overlap times what a registration would add
  /// to what the graph knows.
  void within_frame(const Paths& graph, FragmentId id, Node& node) {
    if (!node.has_cloud || node.within_frame >= options_.per_fragment) return;
    const int here = graph.position(id);
    PathTree tree = graph.tree(here);
    std::vector<Scored> found;
    int position = -1;
    for (const auto& [other, there] : state_.nodes) {
      ++position;
      if (there.order >= node.order || !there.has_cloud || !tree.reaches(position) ||
          known(id, other))
        continue;
      if (node.session == there.session && std::abs(node.time - there.time) < options_.min_time)
        continue;
      const UncertainPose here_from_there = tree.root_from(position);
      const double sigma = sigma_at(here_from_there.covariance, there.coarse().centre);
      if (sigma < options_.min_uncertainty) continue;
      const pose_graph::Pose relative = to_pose(node.estimate).inverse() * to_pose(there.estimate);
      const double overlap =
          expected_overlap(there.coarse(), node.coarse(), relative, sigma, options_.max_dilation);
      if (overlap < options_.min_overlap) continue;
      found.push_back({overlap * portable::log1p(sigma * sigma / (noise_ * noise_)), id, other});
    }
    const std::size_t room = options_.per_fragment - node.within_frame;
    std::sort(found.begin(), found.end(), better);
    if (found.size() > room) found.resize(room);
    for (const Scored& pair : found) push(pair, ProposalKind::within_frame);
    node.within_frame += static_cast<std::uint32_t>(found.size());
  }

  /// Nothing says where the other frames are: fragments evenly spread over them.
  void between_frames(const Paths& graph, FragmentId id, Node& node) {
    if (!node.has_cloud || node.between_frames >= options_.between_frames) return;
    const int component = graph.component(graph.position(id));
    std::vector<FragmentId> others;
    int position = -1;
    for (const auto& [other, there] : state_.nodes) {
      ++position;
      if (there.order < node.order && there.has_cloud && graph.component(position) != component)
        others.push_back(other);
    }
    if (others.empty()) return;
    const auto count = static_cast<double>(others.size());
    for (std::uint32_t k = 0; node.between_frames < options_.between_frames && k < others.size();
         ++k) {
      const double turn = kGolden * static_cast<double>(node.order * options_.between_frames + k);
      const auto at = static_cast<std::size_t>((turn - std::floor(turn)) * count);
      const FragmentId other = others[std::min(at, others.size() - 1)];
      if (known(id, other)) continue;
      push({1, id, other}, ProposalKind::between_frames);
      ++node.between_frames;
    }
  }

  /// Pairs beside a candidate that overlap if it is correct. If it is an alias of one place, they
  /// do not align, or elsewhere.
  void confirm_candidates() {
    if (!any_to_confirm(state_)) return;
    const Paths odometry(state_, false, all_);
    for (LoopRecord& record : state_.loops) {
      const Loop& loop = record.loop;
      if (loop.state != LoopState::candidate || record.expanded || record.modes.empty()) continue;
      record.expanded = true;
      if (loop.confidence < kMinExpandedConfidence || loop.reason == LoopReason::exceeds_drift)
        continue;
      confirm(odometry, record);
    }
  }

  void confirm(const Paths& odometry, const LoopRecord& record) {
    PathTree by_source = odometry.tree(odometry.position(record.source), kConfirmingHops);
    PathTree by_target = odometry.tree(odometry.position(record.target), kConfirmingHops);
    const pose_graph::Pose target_from_source =
        to_pose(record.modes[record.mode].target_from_source);
    std::vector<Scored> found;
    for (int a = 0; a < odometry.size(); ++a) {
      const FragmentId source = odometry.id(a);
      const Node& from = state_.nodes.at(source);
      if (!by_source.reaches(a) || !from.has_cloud || source == record.source ||
          source == record.target)
        continue;
      for (int b = 0; b < odometry.size(); ++b) {
        const FragmentId target = odometry.id(b);
        const Node& to = state_.nodes.at(target);
        if (!by_target.reaches(b) || !to.has_cloud || target == record.source ||
            target == record.target || target == source || known(source, target))
          continue;
        const UncertainPose target_from_b = by_target.root_from(b);
        const UncertainPose source_from_a = by_source.root_from(a);
        const pose_graph::Pose b_from_a =
            target_from_b.pose.inverse() * (target_from_source * source_from_a.pose);
        const double overlap = expected_overlap(from.coarse(), to.coarse(), b_from_a, 0, 0);
        if (overlap >= options_.min_overlap)
          found.push_back({overlap * record.loop.confidence, source, target});
      }
    }
    std::sort(found.begin(), found.end(), better);
    // One pair for each fragment, so that the confirmations are independent of each other.
    std::set<FragmentId> used;
    std::uint32_t count = 0;
    for (const Scored& pair : found) {
      if (count >= options_.confirming_candidate) break;
      if (used.count(pair.source) || used.count(pair.target)) continue;
      used.insert({pair.source, pair.target});
      push(pair, ProposalKind::confirming);
      ++count;
    }
  }

  State& state_;
  const Options& all_;
  const ProposalOptions& options_;
  double noise_;
};

}  // namespace

void refresh_proposals(State& state, const Options& options) {
  if (!any_due(state) && !any_to_confirm(state)) return;
  on_copy(state, [&](State& next) { Proposer(next, options).run(); });
}

std::vector<Proposal> next_proposals(const State& state, std::size_t count) {
  const std::size_t taken = std::min(count, state.queue.size());
  return {state.queue.rbegin(), state.queue.rbegin() + static_cast<std::ptrdiff_t>(taken)};
}

void drop_proposals(State& state, std::size_t count) {
  state.queue.resize(state.queue.size() - std::min(count, state.queue.size()));
}

}  // namespace gpureg::loop_closure
