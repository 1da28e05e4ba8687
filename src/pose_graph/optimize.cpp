// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/pose_graph/optimize.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "common/host_threads.hpp"
#include "gpureg/error.hpp"
#include "pose_graph/components.hpp"
#include "pose_graph/initialise.hpp"
#include "pose_graph/parallel.hpp"
#include "pose_graph/problem.hpp"
#include "pose_graph/robust/robust.hpp"

namespace gpureg::pose_graph {
namespace {

/// Information that ties a component without fixed node or prior to where it stands. Its residual
/// is 0 at the optimum whatever the number is.
constexpr double kGaugeInformation = 1;
/// Keeps the matrix invertible where a node hangs on rejected edges only: its covariance is then
/// large, not an error.
constexpr double kMarginalDamping = 1e-12;

bool any(const std::vector<char>& flags) {
  return std::find(flags.begin(), flags.end(), 1) != flags.end();
}

bool any_free(const Problem& problem) {
  return std::find(problem.held.begin(), problem.held.end(), 0) != problem.held.end();
}

Estimate solve_plain(const Problem& problem, const std::vector<char>& known, Control& control) {
  Estimate out;
  out.poses = problem.poses;
  out.selection = all_edges(problem);
  poses_from_paths(problem, known, std::vector<char>(problem.edges.size(), 0), out.selection.modes,
                   out.poses);
  out.initial_cost = weighted_cost(problem, out.poses, out.selection, control.threads);
  const SolverOptions& solver = control.options.solver;
  NormalEquations equations(problem, control.threads);
  const MinimisationResult result =
      minimise(problem, equations, out.selection, solver.max_iterations, solver.relative_tolerance,
               control, out.poses);
  out.cost = result.cost;
  out.converged = result.converged;
  out.failed = result.failed;
  return out;
}

Estimate solve(const Problem& problem, const std::vector<char>& known, Control& control) {
  if (!any_free(problem)) {
    Estimate given;
    given.poses = problem.poses;
    given.selection = all_edges(problem);
    given.converged = true;
    return given;
  }
  control.damping = std::numeric_limits<double>::infinity();
  switch (control.options.robust) {
    case Robust::gnc:
      return solve_gnc(problem, known, control);
    case Robust::line_process:
      return solve_line_process(problem, known, control);
    case Robust::none:
      break;
  }
  return solve_plain(problem, known, control);
}

/// Takes away the freedom to move a component as a whole. Returns the nodes whose pose is known.
std::vector<char> fix_gauge(Problem& problem) {
  std::vector<char> known = problem.has_pose;
  if (any(problem.held)) return known;
  const bool placed = any(known);
  if (!placed) known[0] = 1;
  const std::vector<char> none(problem.edges.size(), 0);
  if (problem.priors.empty() && problem.gravity.empty()) {
    // Hold the smallest node: with a pose where it has one, in the origin otherwise.
    if (!problem.has_pose[0])
      poses_from_paths(problem, known, none, all_edges(problem).modes, problem.poses);
    known[0] = problem.held[0] = 1;
    return known;
  }
  poses_from_paths(problem, known, none, all_edges(problem).modes, problem.poses);
  std::fill(known.begin(), known.end(), 1);
  if (!problem.priors.empty()) {
    if (!placed) align_with_prior(problem, problem.poses);
    return known;
  }
  // Gravity alone: the position and the turn about the vertical of the smallest node stay.
  align_with_gravity(problem, 0, problem.poses);
  const Eigen::Vector3d up = problem.poses[0].rotation.transpose() * Eigen::Vector3d::UnitZ();
  PriorTerm gauge{0, problem.poses[0].inverse(), Matrix6d::Zero()};
  gauge.information.topLeftCorner<3, 3>() = kGaugeInformation * up * up.transpose();
  gauge.information.bottomRightCorner<3, 3>().diagonal().setConstant(kGaugeInformation);
  problem.priors.push_back(gauge);
  return known;
}

UnalignedIsometry3d to_isometry(const Pose& pose) {
  UnalignedIsometry3d out;
  out.setIdentity();
  out.linear() = pose.rotation;
  out.translation() = pose.translation;
  return out;
}

/// Writes what one component's estimate says into the result.
void report(const Problem& part, const Estimate& estimate, const Options& options, Result& result) {
  const double reject_below =
      options.robust == Robust::line_process ? options.line_process.min_weight : 0.5;
  for (int node = 0; node < part.node_count(); ++node)
    result.world_from_node[part.original[node]] = to_isometry(estimate.poses[node]);
  for (int k = 0; k < part.edge_count(); ++k) {
    const EdgeTerm& edge = part.edges[k];
    EdgeResult& out = result.edges[edge.original];
    out.mode = static_cast<std::uint32_t>(estimate.selection.modes[k]);
    out.weight = edge.odometry ? 1 : std::clamp(estimate.selection.weights[k], 0.0, 1.0);
    out.state = out.weight >= reject_below ? EdgeState::accepted : EdgeState::rejected;
    out.squared_error = squared_error(estimate.poses[edge.source], estimate.poses[edge.target],
                                      part.modes[edge.first_mode + estimate.selection.modes[k]]);
  }
}

/// The components that odometry and accepted loops make.
std::vector<Component> final_components(const Problem& problem, const Result& result) {
  const std::vector<int> number = components_of(problem, [&](int k) {
    return result.edges[problem.edges[k].original].state == EdgeState::accepted;
  });
  std::vector<Component> out;
  for (int node = 0; node < problem.node_count(); ++node) {
    if (number[node] == static_cast<int>(out.size())) {
      out.emplace_back();
      out.back().anchor = problem.ids[node];
    }
    Component& component = out[number[node]];
    component.nodes.push_back(problem.ids[node]);
    if (problem.held[node] && component.own_frame) {
      component.own_frame = false;
      component.anchor = problem.ids[node];
    }
  }
  for (const PriorTerm& prior : problem.priors) out[number[prior.node]].own_frame = false;
  return out;
}

void compute_marginals(const Problem& part, const Estimate& estimate, const Options& options,
                       int threads, Result& result) {
  std::unique_ptr<NormalEquations> equations;
  for (std::size_t k = 0; k < options.marginals.size(); ++k) {
    const auto at = std::lower_bound(part.ids.begin(), part.ids.end(), options.marginals[k]);
    if (at == part.ids.end() || *at != options.marginals[k]) continue;
    const int node = static_cast<int>(at - part.ids.begin());
    if (part.held[node]) continue;  // stays zero
    if (!equations) {
      equations = std::make_unique<NormalEquations>(part, threads);
      equations->linearise(estimate.poses, estimate.selection);
      std::vector<Vector6d> step;
      if (!equations->solve(kMarginalDamping, step)) return;
    }
    result.marginals[k].covariance = equations->marginal(node);
  }
}

void require_known_marginals(const Problem& problem, const Options& options) {
  for (std::size_t k = 0; k < options.marginals.size(); ++k)
    if (!std::binary_search(problem.ids.begin(), problem.ids.end(), options.marginals[k]))
      throw InvalidArgument("marginals[" + std::to_string(k) + "] is " +
                            std::to_string(options.marginals[k]) + ", but no node has this id");
}

void conclude(const std::string& where, bool failed, bool converged, Result& result) {
  if (failed && result.status != Status::failed) {
    result.status = Status::failed;
    result.reason = "the linear system of the component of " + where + " cannot be solved";
  } else if (!converged && result.status == Status::converged) {
    result.status = Status::max_iterations;
    result.reason = "the component of " + where + " is not at a minimum after max_iterations";
  }
}

}  // namespace

const char* to_string(Status status) {
  switch (status) {
    case Status::converged:
      return "converged";
    case Status::max_iterations:
      return "max_iterations";
    case Status::cancelled:
      return "cancelled";
    case Status::no_nodes:
      return "no_nodes";
    case Status::failed:
      return "failed";
  }
  return "unknown";
}

std::size_t Result::accepted_loops(const Graph& graph) const {
  std::size_t count = 0;
  for (std::size_t k = 0; k < edges.size() && k < graph.edges.size(); ++k)
    count += graph.edges[k].kind == EdgeKind::loop && edges[k].state == EdgeState::accepted;
  return count;
}

Result optimize(const Graph& graph, const Options& options) {
  options.validate();
  graph.validate();
  Result result;
  if (graph.nodes.empty()) {
    result.reason = "the graph has no nodes";
    return result;
  }
  const Problem problem = compile(graph, options);
  require_known_marginals(problem, options);
  result.status = Status::converged;
  result.world_from_node.resize(graph.nodes.size());
  result.edges.resize(graph.edges.size());
  for (const std::int64_t id : options.marginals) {
    result.marginals.emplace_back();
    result.marginals.back().node = id;
  }
  Control control{options, thread_count(options.threads)};
  for (Problem& part : split(problem)) {
    const std::vector<char> known = fix_gauge(part);
    const Estimate estimate = solve(part, known, control);
    result.initial_cost += estimate.initial_cost;
    result.final_cost += estimate.cost;
    conclude("node " + std::to_string(part.ids[0]), estimate.failed, estimate.converged, result);
    report(part, estimate, options, result);
    compute_marginals(part, estimate, options, control.threads, result);
  }
  if (control.cancelled) {
    result.status = Status::cancelled;
    result.reason = "should_stop ended the optimisation";
  }
  result.iterations = control.iterations;
  result.components = final_components(problem, result);
  return result;
}

}  // namespace gpureg::pose_graph
