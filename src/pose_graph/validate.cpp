// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/validate.hpp"
#include "common/rigid.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <unordered_map>

namespace gpureg::pose_graph {
namespace {

/// Asymmetry, and negative eigenvalues, that rounding explains: share of the largest entry.
constexpr double kSymmetryTolerance = 1e-6;
constexpr double kEigenvalueTolerance = 1e-9;

std::string at(const char* list, std::size_t index) {
  return std::string(list) + "[" + std::to_string(index) + "]";
}

using Places = std::unordered_map<std::int64_t, std::size_t>;

void require_known(const Places& places, std::int64_t id, const std::string& name) {
  if (places.find(id) == places.end())
    throw InvalidArgument(name + " is " + std::to_string(id) + ", but no node has this id");
}

void validate_edge(const Edge& edge, const Places& places, const std::string& name) {
  require_known(places, edge.source, name + ".source");
  require_known(places, edge.target, name + ".target");
  if (edge.source == edge.target)
    throw InvalidArgument(name + " connects node " + std::to_string(edge.source) + " with itself");
  if (edge.kind != EdgeKind::odometry && edge.kind != EdgeKind::loop)
    throw InvalidArgument(name + ".kind is " + std::to_string(static_cast<int>(edge.kind)) +
                          ", expected odometry or loop");
  require_pose(edge.target_from_source, name + ".target_from_source");
  if (edge.information) require_information(*edge.information, name + ".information");
  require_confidence(edge.confidence, name + ".confidence");
  if (edge.kind == EdgeKind::odometry && !edge.alternatives.empty())
    throw InvalidArgument(name + " is odometry, which has no alternatives, but it has " +
                          std::to_string(edge.alternatives.size()));
  for (std::size_t k = 0; k < edge.alternatives.size(); ++k) {
    const std::string mode = name + "." + at("alternatives", k);
    require_pose(edge.alternatives[k].target_from_source, mode + ".target_from_source");
    if (edge.alternatives[k].information)
      require_information(*edge.alternatives[k].information, mode + ".information");
    require_confidence(edge.alternatives[k].confidence, mode + ".confidence");
  }
}

}  // namespace

void require_pose(const UnalignedIsometry3d& pose, const std::string& name) {
  const Eigen::Matrix4d m = pose.matrix();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      require(std::isfinite(m(row, column)) && std::abs(m(row, column)) <= kFarthest,
              name + "(" + std::to_string(row) + ", " + std::to_string(column) + ")",
              m(row, column), "a finite number up to 1e12");
  const std::string why = why_not_rigid(m);
  if (!why.empty()) throw InvalidArgument(name + " is not rigid: " + why);
}

void require_information(const UnalignedMatrix6d& information, const std::string& name) {
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      require(std::isfinite(information(row, column)) &&
                  std::abs(information(row, column)) <= kLargestInformation,
              name + "(" + std::to_string(row) + ", " + std::to_string(column) + ")",
              information(row, column), "a finite number up to 1e18");
  const double largest = information.cwiseAbs().maxCoeff();
  require(largest > 0, name + ".maximum", largest, "an information matrix that is not zero");
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < row; ++column)
      if (std::abs(information(row, column) - information(column, row)) >
          kSymmetryTolerance * largest)
        throw InvalidArgument(name + " is not symmetric: (" + std::to_string(row) + ", " +
                              std::to_string(column) + ") is " + shown(information(row, column)) +
                              ", its mirror " + shown(information(column, row)));
  const Eigen::Matrix<double, 6, 6> m = 0.5 * (information + information.transpose());
  // A Cholesky factorisation is ten times as fast as eigenvalues, and nearly all matrices pass.
  const Eigen::Matrix<double, 6, 6> shifted =
      m + kEigenvalueTolerance * largest * Eigen::Matrix<double, 6, 6>::Identity();
  if (shifted.llt().info() == Eigen::Success) return;
  const double smallest =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(m, Eigen::EigenvaluesOnly)
          .eigenvalues()[0];
  require(false, name + ".smallest_eigenvalue", smallest,
          "an information matrix that is positive semi-definite");
}

void require_confidence(double confidence, const std::string& name) {
  require(confidence >= 0 && confidence <= 1, name, confidence, "a probability in [0, 1]");
}

void require(bool good, const std::string& field, double value, const char* expected) {
  if (!good) throw InvalidArgument(field + " is " + shown(value) + ", expected " + expected);
}

void Graph::validate() const {
  Places places;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const Node& node = nodes[k];
    const auto [known, added] = places.emplace(node.id, k);
    if (!added)
      throw InvalidArgument(at("nodes", k) + ".id is " + std::to_string(node.id) + ", which is " +
                            at("nodes", known->second) + "'s, too");
    if (node.world_from_node)
      require_pose(*node.world_from_node, at("nodes", k) + ".world_from_node");
    else if (node.fixed)
      throw InvalidArgument(at("nodes", k) + " (id " + std::to_string(node.id) +
                            ") is fixed but has no world_from_node");
  }
  for (std::size_t k = 0; k < edges.size(); ++k) validate_edge(edges[k], places, at("edges", k));
  for (std::size_t k = 0; k < gravity.size(); ++k) {
    require_known(places, gravity[k].node, at("gravity", k) + ".node");
    const Eigen::Vector3d up = gravity[k].up;
    require(up.allFinite() && up.norm() > 1e-9 && up.norm() <= kFarthest,
            at("gravity", k) + ".up.norm", up.norm(), "a direction: finite and not of length 0");
    require(gravity[k].sigma_degrees > 1e-6 && gravity[k].sigma_degrees <= 180,
            at("gravity", k) + ".sigma_degrees", gravity[k].sigma_degrees,
            "degrees in (1e-6, 180]");
  }
  for (std::size_t k = 0; k < priors.size(); ++k) {
    require_known(places, priors[k].node, at("priors", k) + ".node");
    require_pose(priors[k].world_from_node, at("priors", k) + ".world_from_node");
    require_information(priors[k].information, at("priors", k) + ".information");
  }
}

}  // namespace gpureg::pose_graph
