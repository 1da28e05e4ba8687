// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstring>
#include <map>

#include "graphs.hpp"

namespace gpureg::pose_graph {
namespace {

using namespace test;

World noisy() {
  World world = rounds(150, 4, 1, 1);
  std::mt19937_64 random(1);
  for (int k = 0; k < 150; ++k) {
    Edge& edge = world.add(static_cast<int>(300 + random() % 300), static_cast<int>(random() % 250),
                           EdgeKind::loop, random);
    edge.target_from_source = random_pose(random, 1, 2);
  }
  return world;
}

bool same_bytes(const UnalignedIsometry3d& a, const UnalignedIsometry3d& b) {
  return std::memcmp(a.data(), b.data(), 16 * sizeof(double)) == 0;
}

TEST(Determinism, ThreadsDoNotChangeAByte) {
  const World world = noisy();
  Options options;
  options.threads = 1;
  const Result one = optimize(world.graph, options);
  for (const int threads : {1, 2, 3, 8}) {
    options.threads = threads;
    const Result other = optimize(world.graph, options);
    for (std::size_t k = 0; k < one.world_from_node.size(); ++k)
      ASSERT_TRUE(same_bytes(one.world_from_node[k], other.world_from_node[k])) << threads;
    EXPECT_EQ(one.final_cost, other.final_cost);
    EXPECT_EQ(one.iterations, other.iterations);
  }
}

TEST(Determinism, TheOrderOfNodesAndEdgesDoesNotChangeAByte) {
  const World world = noisy();
  const Result first = optimize(world.graph);
  std::map<std::int64_t, UnalignedIsometry3d> poses;
  for (std::size_t k = 0; k < world.graph.nodes.size(); ++k)
    poses[world.graph.nodes[k].id] = first.world_from_node[k];
  std::mt19937_64 random(2);
  for (int round = 0; round < 3; ++round) {
    Graph shuffled = world.graph;
    std::shuffle(shuffled.nodes.begin(), shuffled.nodes.end(), random);
    std::shuffle(shuffled.edges.begin(), shuffled.edges.end(), random);
    const Result other = optimize(shuffled);
    for (std::size_t k = 0; k < shuffled.nodes.size(); ++k)
      ASSERT_TRUE(same_bytes(poses[shuffled.nodes[k].id], other.world_from_node[k]));
    EXPECT_EQ(first.final_cost, other.final_cost);
    EXPECT_EQ(first.accepted_loops(world.graph), other.accepted_loops(shuffled));
  }
}

}  // namespace
}  // namespace gpureg::pose_graph
