// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/paths.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <queue>
#include <utility>

namespace gpureg::loop_closure {
namespace {

/// Metres at which rotations count in the cost of an edge: most of a map is farther away.
constexpr double kLever = 3;
/// Edges of a larger cost say nothing: sums of any number of smaller ones are finite.
constexpr double kMostCost = 1e200;

double cost_of(const Matrix6d& covariance) {
  return kLever * kLever * covariance.topLeftCorner<3, 3>().trace() +
         covariance.bottomRightCorner<3, 3>().trace();
}

}  // namespace

RotationShare rotation_share(const Matrix6d& covariance) {
  const Eigen::Matrix3d cross = covariance.bottomLeftCorner<3, 3>();
  const Eigen::LLT<Eigen::Matrix3d> rotation(covariance.topLeftCorner<3, 3>());
  RotationShare out;
  out.rotation = covariance;
  out.rotation.bottomRightCorner<3, 3>() = cross * rotation.solve(cross.transpose());
  out.translation = covariance - out.rotation;
  return out;
}

PathParts PathTree::parts(int node) const {
  std::vector<int> nodes;  // from the node to the root
  for (int at = node; steps_[index(at)].parent >= 0; at = steps_[index(at)].parent)
    nodes.push_back(at);
  PathParts out{{}, Matrix6d::Zero(), Matrix6d::Zero(), Matrix6d::Zero()};
  for (auto k = nodes.rbegin(); k != nodes.rend(); ++k) {
    const Step& step = steps_[index(*k)];
    const Matrix6d moved = pose_graph::adjoint(step.edge->pose.inverse());
    for (Matrix6d* part : {&out.rotation, &out.translation, &out.fixed})
      *part = moved * *part * moved.transpose();
    out.pose = out.pose * step.edge->pose;
    if (step.steps > steps_[index(step.parent)].steps) {
      const RotationShare share = rotation_share(step.edge->covariance);
      out.rotation += share.rotation;
      out.translation += share.translation;
    } else {
      out.fixed += step.edge->covariance;
    }
  }
  const Step& step = steps_[index(node)];
  const double factor = correlation_factor(step.length, step.steps, correlation_);
  out.rotation *= factor;
  out.translation *= factor;
  return out;
}

UncertainPose PathTree::root_from(int node) {
  std::vector<int> missing;
  int at = node;
  for (; known_.count(at) == 0; at = steps_[index(at)].parent) missing.push_back(at);
  for (auto k = missing.rbegin(); k != missing.rend(); ++k) {
    const Step& step = steps_[index(*k)];
    known_[*k] = known_.at(step.parent) * *step.edge;
  }
  UncertainPose out = known_.at(node);
  const Step& step = steps_[index(node)];
  out.covariance *= correlation_factor(step.length, step.steps, correlation_);
  return out;
}

Paths::Paths(const State& state, bool with_loops, const Options& options)
    : correlation_(options.drift_correlation) {
  ids_.reserve(state.nodes.size());
  for (const auto& [id, node] : state.nodes) ids_.push_back(id);
  links_.resize(ids_.size());
  for (const Odometry& edge : state.odometry)
    connect(edge.source, edge.target,
            {to_pose(edge.target_from_source), pose_graph::covariance_of(edge.information)},
            edge.modelled ? edge.length : 0, edge.modelled ? edge.steps : 0);
  if (with_loops)
    for (const LoopRecord& record : state.loops) {
      if (record.loop.state != LoopState::accepted) continue;
      // The mode that was accepted is the one that was reported.
      const Mode& mode = record.modes[record.mode];
      connect(record.source, record.target,
              {to_pose(mode.target_from_source), pose_graph::covariance_of(mode.information)}, 0,
              0);
    }
  component_.assign(ids_.size(), -1);
  for (int root = 0; root < size(); ++root) {
    if (component_[static_cast<std::size_t>(root)] >= 0) continue;
    std::vector<int> stack{root};
    component_[static_cast<std::size_t>(root)] = root;
    while (!stack.empty()) {
      const int node = stack.back();
      stack.pop_back();
      for (const Link& link : links_[static_cast<std::size_t>(node)])
        if (component_[static_cast<std::size_t>(link.to)] < 0) {
          component_[static_cast<std::size_t>(link.to)] = root;
          stack.push_back(link.to);
        }
    }
  }
}

int Paths::position(FragmentId id) const {
  return static_cast<int>(std::lower_bound(ids_.begin(), ids_.end(), id) - ids_.begin());
}

void Paths::connect(FragmentId source, FragmentId target, const UncertainPose& target_from_source,
                    double length, double steps) {
  const int s = position(source), t = position(target);
  const UncertainPose source_from_target = target_from_source.inverse();
  const double cost =
      std::max(cost_of(target_from_source.covariance), cost_of(source_from_target.covariance));
  if (!(cost >= 0 && cost <= kMostCost)) return;
  links_[static_cast<std::size_t>(t)].push_back({s, cost, length, steps, target_from_source});
  links_[static_cast<std::size_t>(s)].push_back({t, cost, length, steps, source_from_target});
}

PathTree Paths::tree(int root, int max_hops) const {
  PathTree tree;
  tree.correlation_ = correlation_;
  tree.steps_.resize(ids_.size());
  tree.steps_[PathTree::index(root)].cost = 0;
  tree.known_[root] = UncertainPose{};
  using Entry = std::pair<double, int>;  // Dijkstra 1959; ties go to the smaller position
  std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> queue;
  queue.emplace(0.0, root);
  while (!queue.empty()) {
    const auto [cost, node] = queue.top();
    queue.pop();
    const PathTree::Step& here = tree.steps_[PathTree::index(node)];
    if (cost > here.cost || here.hops >= max_hops) continue;
    const int hops = here.hops + 1;
    for (const Link& link : links_[PathTree::index(node)]) {
      PathTree::Step& there = tree.steps_[PathTree::index(link.to)];
      const double reached = cost + link.cost;
      if (reached >= there.cost) continue;
      there.cost = reached;
      there.hops = hops;
      there.parent = node;
      there.length = here.length + link.length;
      there.steps = here.steps + link.steps;
      there.edge = &link.here_from_there;
      queue.emplace(reached, link.to);
    }
  }
  return tree;
}

}  // namespace gpureg::loop_closure
