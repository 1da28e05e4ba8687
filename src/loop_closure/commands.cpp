// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/commands.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace gpureg::loop_closure {
namespace {

/// Loops mean something else now.
void compare_again(State& state) {
  state.graph_changed = true;
  for (LoopRecord& record : state.loops) record.gated = false;
  state.relations.clear();
}

void connect(State& state, const Odometry& odometry) {
  Node& source = state.nodes.at(odometry.source);
  Node& target = state.nodes.at(odometry.target);
  if (source.placed && target.placed) {
    compare_again(state);  // two parts of the map, or a second path
  } else if (target.placed || (!source.placed && target.order < source.order)) {
    source.estimate = rigid(target.estimate * odometry.target_from_source);
  } else {
    target.estimate = rigid(source.estimate * odometry.target_from_source.inverse());
  }
  source.placed = target.placed = true;
  state.odometry.push_back(odometry);
  state.known.insert(pair_of(odometry.source, odometry.target));
}

void forget_implied(State& state, std::int64_t session) {
  const auto implied = [&](const Odometry& edge) {
    return edge.implied && state.nodes.at(edge.source).session == session;
  };
  const auto kept = std::remove_if(state.odometry.begin(), state.odometry.end(), implied);
  if (kept == state.odometry.end()) return;
  state.odometry.erase(kept, state.odometry.end());
  for (auto& [id, node] : state.nodes) node.placed = node.placed && node.session != session;
  for (const Odometry& edge : state.odometry)
    state.nodes.at(edge.source).placed = state.nodes.at(edge.target).placed = true;
  compare_again(state);
}

}  // namespace

void add_fragment(State& state, const Fragment& fragment, const Options& options) {
  Node node;
  node.session = fragment.session;
  node.time = fragment.time;
  node.cloud = fragment.cloud;
  node.has_cloud = fragment.cloud.valid();
  node.up = fragment.up;
  node.given = fragment.world_from_fragment;
  node.estimate = node.given.value_or(UnalignedIsometry3d::Identity());
  node.order = state.arrivals++;
  if (node.has_cloud) {
    node.fingerprint = fingerprint_of(node.cloud);
    node.observed =
        std::make_shared<const Coarse>(coarse_of(node.cloud, options.proposals.coarse_voxel_size));
  }
  state.nodes.emplace(fragment.id, std::move(node));
  state.poses_changed = true;
}

void add_odometry(State& state, const Odometry& odometry) {
  const std::int64_t session = state.nodes.at(odometry.source).session;
  if (session == state.nodes.at(odometry.target).session && state.connected.insert(session).second)
    forget_implied(state, session);
  connect(state, odometry);
}

void imply_odometry(State& state, const Options& options) {
  std::map<std::int64_t, std::map<std::uint64_t, FragmentId>> arrived;  // by session and order
  for (const auto& [id, node] : state.nodes)
    if (node.given && state.connected.count(node.session) == 0)
      arrived[node.session][node.order] = id;
  for (const auto& [session, ids] : arrived)
    for (auto at = ids.begin(); at != ids.end(); ++at) {
      const Node& node = state.nodes.at(at->second);
      if (at == ids.begin() || !node.look_back) continue;
      const FragmentId before = std::prev(at)->second;
      Odometry edge =
          modelled_odometry(at->second, before,
                            rigid(state.nodes.at(before).given->inverse() * *node.given), options);
      edge.implied = true;
      connect(state, edge);
    }
  for (auto& [id, node] : state.nodes) node.look_back = false;
}

void add_covisible(State& state, FragmentId id, const std::vector<FragmentId>& others) {
  for (const FragmentId other : others)
    if (other != id) state.known.insert(pair_of(id, other));
}

void add_proposal(State& state, Proposal proposal) {
  proposal.order = state.arrivals++;
  state.known.insert(pair_of(proposal.source, proposal.target));
  state.queue.push_back(std::move(proposal));
  // The queue ends with its first element: behind other proposals of the host, before all others.
  const auto behind = std::find_if(state.queue.begin(), state.queue.end() - 1,
                                   [](const Proposal& p) { return p.kind == ProposalKind::host; });
  std::rotate(behind, state.queue.end() - 1, state.queue.end());
}

void add_record(State& state, LoopRecord record) {
  state.known.insert(pair_of(record.source, record.target));
  state.graph_changed |= !record.modes.empty();
  record.number = state.arrivals++;
  state.loops.push_back(std::move(record));
}

void set_estimates(State& state, const std::vector<FragmentPose>& poses) {
  for (const FragmentPose& pose : poses) {
    Node& node = state.nodes.at(pose.id);
    node.estimate = pose.world_from_fragment;
    node.look_within = true;
  }
}

}  // namespace gpureg::loop_closure
