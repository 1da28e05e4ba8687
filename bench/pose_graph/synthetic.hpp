// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "gpureg/pose_graph.hpp"

/// Graphs for the benchmarks.
namespace gpureg::pose_graph::bench {

inline UnalignedIsometry3d noise(std::mt19937_64& random, double radians, double metres) {
  std::normal_distribution<double> normal;
  const Eigen::Vector3d w =
      radians * Eigen::Vector3d(normal(random), normal(random), normal(random));
  UnalignedIsometry3d out = UnalignedIsometry3d::Identity();
  out.linear() = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
  out.translation() = metres * Eigen::Vector3d(normal(random), normal(random), normal(random));
  return out;
}

/// A walk through the streets of a city of blocks: a new street is chosen at every crossing, a loop
/// joins a node to others within `reach` of it, until there are so many edges.
inline Graph city(int nodes, int edges, unsigned seed) {
  std::mt19937_64 random(seed);
  constexpr int kBlock = 5;  // nodes from crossing to crossing, one metre apart
  const int size = static_cast<int>(std::sqrt(nodes / 4.0)) * 2;
  std::vector<UnalignedIsometry3d> truth;
  Eigen::Vector3d place(0, 0, 0);
  int heading = 0;
  for (int k = 0; k < nodes; ++k) {
    if (k % kBlock == 0) {
      const int turn = static_cast<int>(random() % 3) - 1;
      heading = (heading + turn + 4) % 4;
      const Eigen::Vector3d ahead =
          place + kBlock * Eigen::Vector3d((heading == 0) - (heading == 2),
                                           (heading == 1) - (heading == 3), 0);
      if (ahead.cwiseAbs().maxCoeff() > size) heading = (heading + 2) % 4;
    }
    UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
    pose.linear() = Eigen::AngleAxisd(heading * 1.5707963267948966, Eigen::Vector3d::UnitZ())
                        .toRotationMatrix();
    pose.translation() = place;
    truth.push_back(pose);
    place += pose.linear().col(0);
  }
  const double radians = 0.01, metres = 0.05;
  Graph graph;
  const auto add = [&](int source, int target) {
    Edge edge;
    edge.source = source;
    edge.target = target;
    edge.target_from_source =
        truth[target].inverse() * truth[source] * noise(random, radians, metres);
    UnalignedMatrix6d information = UnalignedMatrix6d::Identity() / (metres * metres);
    information.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() / (radians * radians);
    edge.information = information;
    edge.kind = source == target + 1 ? EdgeKind::odometry : EdgeKind::loop;
    graph.edges.push_back(edge);
  };
  UnalignedIsometry3d pose = truth[0];
  for (int k = 0; k < nodes; ++k) {
    if (k > 0) {
      add(k, k - 1);
      pose = pose * graph.edges.back().target_from_source;
    }
    Node node;
    node.id = k;
    node.world_from_node = pose;
    graph.nodes.push_back(node);
  }
  std::vector<std::pair<int, int>> close;
  for (int a = 0; a < nodes; ++a)
    for (int b = a + 2; b < nodes; ++b)
      if ((truth[a].translation() - truth[b].translation()).squaredNorm() < 2.1)
        close.emplace_back(b, a);
  std::shuffle(close.begin(), close.end(), random);
  for (const auto& [source, target] : close) {
    if (static_cast<int>(graph.edges.size()) >= edges) break;
    add(source, target);
  }
  return graph;
}

}  // namespace gpureg::pose_graph::bench
