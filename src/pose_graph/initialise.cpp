// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/initialise.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <tuple>

#include "math/exponential.hpp"

namespace gpureg::pose_graph {
namespace {

/// A mode of small confidence is no better than this many sure ones in a row.
double doubt(const ModeTerm& mode) { return portable::exp(-0.5 * mode.prior); }

/// Variance of a mode in squared metres and squared radians, for comparing paths. An inverse of the
/// diagonal: it exists where the matrix has no inverse.
double variance(const ModeTerm& mode) {
  return mode.information.diagonal().cwiseMax(1e-12).cwiseInverse().sum();
}

/// Directions whose cosine is this close to -1 leave the axis of the turn open.
constexpr double kOpposite = 1e-12;

/// The smallest rotation that turns one direction into another. Eigen's
/// Quaternion::FromTwoVectors without the singular value decomposition, whose only use there is an
/// axis for opposite directions.
Eigen::Matrix3d smallest_turn(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const double cosine = b.dot(a);
  Eigen::Quaterniond turn;
  if (cosine < -1 + kOpposite) {
    const double half = 0.5 * (1 + std::max(cosine, -1.0));  // squared cosine of half the angle
    turn.w() = std::sqrt(half);
    turn.vec() = a.unitOrthogonal() * std::sqrt(1 - half);
  } else {
    const double scale = std::sqrt((1 + cosine) * 2);
    turn.vec() = a.cross(b) * (1 / scale);
    turn.w() = scale * 0.5;
  }
  return turn.toRotationMatrix();
}

}  // namespace

void poses_from_paths(const Problem& problem, const std::vector<char>& known,
                      const std::vector<char>& trusted, const std::vector<int>& modes,
                      std::vector<Pose>& poses) {
  const int nodes = problem.node_count();
  std::vector<std::vector<int>> incident(nodes);
  for (int k = 0; k < problem.edge_count(); ++k) {
    incident[problem.edges[k].source].push_back(k);
    incident[problem.edges[k].target].push_back(k);
  }
  constexpr double never = std::numeric_limits<double>::infinity();
  // Doubt of the untrusted edges on the path, then variance, then the position: a total order.
  using Key = std::tuple<double, double, int>;
  std::vector<Key> best(nodes, Key{never, never, 0});
  std::vector<char> done(nodes, 0);
  std::priority_queue<Key, std::vector<Key>, std::greater<Key>> queue;
  for (int node = 0; node < nodes; ++node)
    if (known[node]) queue.push(best[node] = {0, 0, node});
  while (!queue.empty()) {
    const auto [doubts, sum, node] = queue.top();
    queue.pop();
    if (done[node]) continue;
    done[node] = 1;
    for (const int k : incident[node]) {
      const EdgeTerm& edge = problem.edges[k];
      const bool forward = edge.source == node;
      const int other = forward ? edge.target : edge.source;
      if (done[other]) continue;
      const ModeTerm& mode = problem.modes[edge.first_mode + modes[k]];
      const bool sure = edge.odometry || trusted[k];
      const Key key{doubts + (sure ? 0 : doubt(mode)), sum + variance(mode), other};
      if (key >= best[other]) continue;
      best[other] = key;
      poses[other] = poses[node] * (forward ? mode.inverse : mode.target_from_source);
      queue.push(key);
    }
  }
}

void align_with_gravity(const Problem& problem, int anchor, std::vector<Pose>& poses) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const GravityTerm& term : problem.gravity)
    up += term.weight * (poses[term.node].rotation * term.up);
  if (problem.gravity.empty() || up.norm() < 1e-12) return;
  const Eigen::Matrix3d turn = smallest_turn(up, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d centre = poses[anchor].translation;
  for (Pose& pose : poses) {
    pose.rotation = turn * pose.rotation;
    pose.translation = centre + turn * (pose.translation - centre);
  }
}

void align_with_prior(const Problem& problem, std::vector<Pose>& poses) {
  if (problem.priors.empty()) return;
  const PriorTerm& prior = problem.priors.front();
  const Pose moved = prior.inverse.inverse() * poses[prior.node].inverse();
  for (Pose& pose : poses) pose = moved * pose;
}

}  // namespace gpureg::pose_graph
