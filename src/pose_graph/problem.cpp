// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/problem.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "math/trigonometry.hpp"
#include "pose_graph/components.hpp"

namespace gpureg::pose_graph {
namespace {

/// Confidences of exactly 0 or 1 count as this far from them, so that their log odds are finite; no
/// registration knows its error rate better.
constexpr double kLeastDoubt = 1e-6;

Pose to_pose(const UnalignedIsometry3d& t) {
  // Files carry six digits: make the rotation orthonormal.
  const Eigen::Matrix3d rotation = t.linear();
  return {Eigen::Quaterniond(rotation).normalized().toRotationMatrix(), t.translation()};
}

double log_odds(double confidence) {
  const double p = std::clamp(confidence, kLeastDoubt, 1 - kLeastDoubt);
  return portable::log(p / (1 - p));
}

Matrix6d diagonal_information(double rotation_degrees, double translation) {
  Vector6d d;
  d.head<3>().setConstant(1 / portable::square(rotation_degrees * portable::kRadiansPerDegree));
  d.tail<3>().setConstant(1 / portable::square(translation));
  return d.asDiagonal();
}

ModeTerm mode_term(const UnalignedIsometry3d& pose,
                   const std::optional<UnalignedMatrix6d>& information, double confidence,
                   EdgeKind kind, const Options& options) {
  ModeTerm term;
  term.target_from_source = to_pose(pose);
  term.inverse = term.target_from_source.inverse();
  if (information)
    term.information = 0.5 * (*information + information->transpose());
  else if (kind == EdgeKind::odometry)
    term.information = odometry_information(term.target_from_source, options.drift);
  else
    term.information =
        diagonal_information(options.loop_noise.rotation, options.loop_noise.translation);
  term.prior = kind == EdgeKind::odometry ? 0 : 2 * log_odds(confidence);
  return term;
}

bool lexicographic_less(const ModeTerm& a, const ModeTerm& b) {
  const auto numbers = [](const ModeTerm& m) {
    std::vector<double> v(m.target_from_source.rotation.data(),
                          m.target_from_source.rotation.data() + 9);
    v.insert(v.end(), m.target_from_source.translation.data(),
             m.target_from_source.translation.data() + 3);
    v.insert(v.end(), m.information.data(), m.information.data() + 36);
    v.push_back(m.prior);
    return v;
  };
  return numbers(a) < numbers(b);
}

/// The order of the edges must not depend on the caller's.
void sort_edges(Problem& problem) {
  const auto key = [](const EdgeTerm& e) {
    return std::make_tuple(std::min(e.source, e.target), std::max(e.source, e.target), e.source,
                           !e.odometry, e.modes);
  };
  std::stable_sort(
      problem.edges.begin(), problem.edges.end(), [&](const EdgeTerm& a, const EdgeTerm& b) {
        if (key(a) != key(b)) return key(a) < key(b);
        for (int k = 0; k < a.modes; ++k) {
          const ModeTerm &m = problem.modes[a.first_mode + k], &n = problem.modes[b.first_mode + k];
          if (lexicographic_less(m, n)) return true;
          if (lexicographic_less(n, m)) return false;
        }
        return false;
      });
}

}  // namespace

Matrix6d odometry_information(const Pose& motion, const DriftOptions& drift) {
  const double metres = motion.translation.norm();
  const double degrees = log_rotation(motion.rotation).norm() / portable::kRadiansPerDegree;
  return diagonal_information(
      std::max(drift.min_rotation,
               drift.rotation_per_metre * metres + drift.rotation_per_degree * degrees),
      std::max(drift.min_translation, drift.translation_per_metre * metres));
}

Selection all_edges(const Problem& problem) {
  return {std::vector<double>(problem.edges.size(), 1.0),
          std::vector<int>(problem.edges.size(), 0)};
}

Vector6d residual(const Pose& source, const Pose& target, const ModeTerm& mode) {
  return log(mode.inverse * (target.inverse() * source));
}

double squared_error(const Pose& source, const Pose& target, const ModeTerm& mode) {
  const Vector6d e = residual(source, target, mode);
  return e.dot(mode.information * e);
}

Problem compile(const Graph& graph, const Options& options) {
  Problem out;
  const int nodes = static_cast<int>(graph.nodes.size());
  out.original.resize(nodes);
  std::iota(out.original.begin(), out.original.end(), 0);
  std::sort(out.original.begin(), out.original.end(),
            [&](int a, int b) { return graph.nodes[a].id < graph.nodes[b].id; });
  for (const int place : out.original) {
    const Node& node = graph.nodes[place];
    out.ids.push_back(node.id);
    const bool known = node.world_from_node && (options.use_initial_poses || node.fixed);
    out.has_pose.push_back(known);
    out.poses.push_back(known ? to_pose(*node.world_from_node) : Pose{});
    out.held.push_back(node.fixed);
  }
  const auto position = [&](std::int64_t id) {
    return static_cast<int>(std::lower_bound(out.ids.begin(), out.ids.end(), id) - out.ids.begin());
  };
  for (std::size_t k = 0; k < graph.edges.size(); ++k) {
    const Edge& edge = graph.edges[k];
    EdgeTerm term;
    term.source = position(edge.source);
    term.target = position(edge.target);
    term.odometry = edge.kind == EdgeKind::odometry;
    term.first_mode = static_cast<int>(out.modes.size());
    term.modes = 1 + static_cast<int>(edge.alternatives.size());
    term.original = static_cast<int>(k);
    out.edges.push_back(term);
    out.modes.push_back(
        mode_term(edge.target_from_source, edge.information, edge.confidence, edge.kind, options));
    for (const EdgeMode& mode : edge.alternatives)
      out.modes.push_back(mode_term(mode.target_from_source, mode.information, mode.confidence,
                                    edge.kind, options));
  }
  sort_edges(out);
  for (const GravityFactor& factor : graph.gravity) {
    const Eigen::Vector3d up = factor.up;
    out.gravity.push_back(
        {position(factor.node), up.normalized(),
         1 / portable::square(factor.sigma_degrees * portable::kRadiansPerDegree)});
  }
  for (const PoseFactor& factor : graph.priors)
    out.priors.push_back({position(factor.node), to_pose(factor.world_from_node).inverse(),
                          0.5 * (factor.information + factor.information.transpose())});
  const auto by_node = [](const auto& a, const auto& b) { return a.node < b.node; };
  std::stable_sort(out.gravity.begin(), out.gravity.end(), by_node);
  std::stable_sort(out.priors.begin(), out.priors.end(), by_node);
  return out;
}

std::vector<Problem> split(const Problem& problem) {
  const std::vector<int> component = components_of(problem, [](int) { return true; });
  const int count =
      component.empty() ? 0 : 1 + *std::max_element(component.begin(), component.end());
  std::vector<Problem> parts(count);
  std::vector<int> local(problem.ids.size());
  for (int node = 0; node < problem.node_count(); ++node) {
    Problem& part = parts[component[node]];
    local[node] = part.node_count();
    part.ids.push_back(problem.ids[node]);
    part.original.push_back(problem.original[node]);
    part.poses.push_back(problem.poses[node]);
    part.has_pose.push_back(problem.has_pose[node]);
    part.held.push_back(problem.held[node]);
  }
  for (const EdgeTerm& edge : problem.edges) {
    Problem& part = parts[component[edge.source]];
    EdgeTerm copy = edge;
    copy.source = local[edge.source];
    copy.target = local[edge.target];
    copy.first_mode = static_cast<int>(part.modes.size());
    part.edges.push_back(copy);
    for (int k = 0; k < edge.modes; ++k) part.modes.push_back(problem.modes[edge.first_mode + k]);
  }
  for (GravityTerm term : problem.gravity) {
    Problem& part = parts[component[term.node]];
    term.node = local[term.node];
    part.gravity.push_back(term);
  }
  for (PriorTerm term : problem.priors) {
    Problem& part = parts[component[term.node]];
    term.node = local[term.node];
    part.priors.push_back(term);
  }
  return parts;
}

}  // namespace gpureg::pose_graph
