// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <utility>

#include "gpureg/pose_graph.hpp"

/// Graphs with known answers.
namespace gpureg::pose_graph::test {

inline UnalignedIsometry3d pose_of(const Eigen::Vector3d& rotation,
                                   const Eigen::Vector3d& translation) {
  UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
  const double angle = rotation.norm();
  if (angle > 0)
    pose.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d(rotation / angle)).toRotationMatrix();
  pose.translation() = translation;
  return pose;
}

inline Eigen::Vector3d normal3(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return {x, y, z};
}

inline UnalignedIsometry3d random_pose(std::mt19937_64& random, double radians = 1,
                                       double metres = 1) {
  const Eigen::Vector3d rotation = radians * normal3(random);
  return pose_of(rotation, metres * normal3(random));
}

inline UnalignedMatrix6d information_of(double radians, double metres) {
  UnalignedMatrix6d out = UnalignedMatrix6d::Zero();
  out.topLeftCorner<3, 3>().diagonal().setConstant(1 / (radians * radians));
  out.bottomRightCorner<3, 3>().diagonal().setConstant(1 / (metres * metres));
  return out;
}

/// A graph and the true poses of its nodes.
struct World {
  Graph graph;
  std::vector<UnalignedIsometry3d> truth;
  double radians = 0.005, metres = 0.01;  ///< sigma of the edges

  Edge& add(int source, int target, EdgeKind kind, std::mt19937_64& random) {
    Edge edge;
    edge.source = source;
    edge.target = target;
    edge.kind = kind;
    edge.target_from_source =
        truth[target].inverse() * truth[source] * random_pose(random, radians, metres);
    edge.information = information_of(radians, metres);
    graph.edges.push_back(edge);
    return graph.edges.back();
  }
};

/// A walk of several rounds on a circle, a metre from node to node: odometry, and loops between
/// rounds at every `loop_every`-th node.
inline World rounds(int per_round, int round_count, int loop_every, unsigned seed) {
  std::mt19937_64 random(seed);
  World world;
  const double pi = 3.14159265358979323846, radius = per_round / (2 * pi);
  for (int k = 0; k < per_round * round_count; ++k) {
    const double angle = 2 * pi * k / per_round;
    world.truth.push_back(pose_of(
        {0, 0, angle}, {radius * std::cos(angle), radius * std::sin(angle), 0.1 * std::sin(k)}));
  }
  for (int k = 0; k < static_cast<int>(world.truth.size()); ++k) {
    Node node;
    node.id = k;
    world.graph.nodes.push_back(node);
    if (k > 0) world.add(k, k - 1, EdgeKind::odometry, random);
  }
  for (int k = per_round; k < static_cast<int>(world.truth.size()); k += loop_every)
    world.add(k, k - per_round, EdgeKind::loop, random);
  return world;
}

/// Scans of one place, no odometry: loops between each scan and its nearest ones.
inline World scans(int count, int nearest, unsigned seed) {
  std::mt19937_64 random(seed);
  World world;
  for (int k = 0; k < count; ++k) {
    world.truth.push_back(random_pose(random, 1, 3));
    Node node;
    node.id = k;
    world.graph.nodes.push_back(node);
  }
  std::set<std::pair<int, int>> pairs;
  for (int a = 0; a < count; ++a) {
    std::vector<std::pair<double, int>> others;
    for (int b = 0; b < count; ++b)
      if (b != a)
        others.push_back({(world.truth[a].translation() - world.truth[b].translation()).norm(), b});
    std::sort(others.begin(), others.end());
    for (int k = 0; k < nearest && k < static_cast<int>(others.size()); ++k)
      pairs.insert(std::minmax(a, others[k].second));
  }
  for (const auto& [a, b] : pairs) world.add(a, b, EdgeKind::loop, random);
  return world;
}

/// The largest distance of a node from its true position, both relative to node 0.
inline double worst_error(const World& world, const Result& result) {
  double worst = 0;
  const UnalignedIsometry3d moved = world.truth[0] * result.world_from_node[0].inverse();
  for (std::size_t k = 0; k < world.truth.size(); ++k)
    worst = std::max(
        worst,
        ((moved * result.world_from_node[k]).translation() - world.truth[k].translation()).norm());
  return worst;
}

/// The largest distance of a node from where least squares puts it without any false loop.
inline double worst_difference(const World& world, std::size_t true_edges, const Result& result) {
  Graph clean = world.graph;
  clean.edges.resize(true_edges);
  for (Edge& edge : clean.edges) edge.alternatives.clear();
  Options options;
  options.robust = Robust::none;
  const Result best = optimize(clean, options);
  double worst = 0;
  for (std::size_t k = 0; k < world.truth.size(); ++k)
    worst = std::max(
        worst,
        (best.world_from_node[k].translation() - result.world_from_node[k].translation()).norm());
  return worst;
}

}  // namespace gpureg::pose_graph::test
