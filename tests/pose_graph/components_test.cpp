// SPDX-License-Identifier: BSD-3-Clause
#include "graphs.hpp"

namespace gpureg::pose_graph {
namespace {

using namespace test;

TEST(Components, GraphsThatNothingConnectKeepFramesOfTheirOwn) {
  World a = rounds(15, 2, 1, 1), b = rounds(10, 2, 1, 2);
  Graph both = a.graph;
  for (Node node : b.graph.nodes) {
    node.id += 1000;
    both.nodes.push_back(node);
  }
  for (Edge edge : b.graph.edges) {
    edge.source += 1000;
    edge.target += 1000;
    both.edges.push_back(edge);
  }
  const Result result = optimize(both);
  ASSERT_EQ(result.components.size(), 2u);
  EXPECT_EQ(result.components[0].anchor, 0);
  EXPECT_EQ(result.components[0].nodes.size(), 30u);
  EXPECT_EQ(result.components[1].anchor, 1000);
  EXPECT_EQ(result.components[1].nodes.size(), 20u);
  EXPECT_TRUE(result.components[1].own_frame);
  // Each is what it is alone, to the last bit.
  const Result alone = optimize(b.graph);
  for (std::size_t k = 0; k < 20; ++k)
    EXPECT_EQ(result.world_from_node[30 + k].matrix(), alone.world_from_node[k].matrix());
}

TEST(Components, RejectedLoopsDoNotConnect) {
  // Two sets of scans; the single loop between them contradicts nothing, but has no confidence.
  World world = scans(8, 7, 3);
  std::mt19937_64 random(3);
  std::vector<Edge> kept;
  for (const Edge& edge : world.graph.edges)
    if ((edge.source < 4) == (edge.target < 4)) kept.push_back(edge);
  world.graph.edges = kept;
  Edge& bridge = world.add(1, 6, EdgeKind::loop, random);
  EXPECT_EQ(optimize(world.graph).components.size(), 1u);
  world.graph.edges.back().confidence = 0;
  (void)bridge;
  const Result result = optimize(world.graph);
  ASSERT_EQ(result.components.size(), 2u);
  EXPECT_EQ(result.components[1].nodes, (std::vector<std::int64_t>{4, 5, 6, 7}));
  EXPECT_TRUE(result.components[1].own_frame);
}

TEST(Components, AFixedNodeAnchorsItsComponentOnly) {
  Graph graph;
  graph.nodes = {{0}, {1}, {2, pose_of({0, 0, 0}, {5, 0, 0}), true}, {3}};
  for (const int k : {0, 2}) {
    Edge edge;
    edge.source = k + 1;
    edge.target = k;
    edge.kind = EdgeKind::odometry;
    edge.target_from_source = pose_of({0, 0, 0}, {1, 0, 0});
    graph.edges.push_back(edge);
  }
  const Result result = optimize(graph);
  ASSERT_EQ(result.components.size(), 2u);
  EXPECT_TRUE(result.components[0].own_frame);
  EXPECT_FALSE(result.components[1].own_frame);
  EXPECT_NEAR(result.world_from_node[3].translation().x(), 6, 1e-9);
}

}  // namespace
}  // namespace gpureg::pose_graph
