// SPDX-License-Identifier: BSD-3-Clause
#include "graphs.hpp"

namespace gpureg::pose_graph {
namespace {

using namespace test;

TEST(Optimize, APerfectLoopCostsNothing) {
  World world = rounds(12, 2, 1, 1);
  for (Edge& edge : world.graph.edges)
    edge.target_from_source = world.truth[edge.target].inverse() * world.truth[edge.source];
  const Result result = optimize(world.graph);
  EXPECT_EQ(result.status, Status::converged) << result.reason;
  EXPECT_LE(result.final_cost, 1e-9);
  // Sums of 24 rotations in double precision.
  EXPECT_LE(worst_error(world, result), 1e-9);
  EXPECT_EQ(result.accepted_loops(world.graph), 12u);
}

TEST(Optimize, SharesTheErrorOfATwoEdgePath) {
  // One coordinate, sigma 1 and 2: the estimate is the mean weighted by 1 and 1/4.
  Graph graph;
  graph.nodes = {{7, UnalignedIsometry3d::Identity(), true}, {9}};
  Edge edge;
  edge.source = 9;
  edge.target = 7;
  edge.kind = EdgeKind::odometry;
  edge.target_from_source = pose_of({0, 0, 0}, {1, 0, 0});
  edge.information = information_of(1, 1);
  graph.edges.push_back(edge);
  edge.target_from_source = pose_of({0, 0, 0}, {2, 0, 0});
  edge.information = information_of(1, 2);
  graph.edges.push_back(edge);
  const Result result = optimize(graph);
  ASSERT_TRUE(result.converged()) << result.reason;
  EXPECT_NEAR(result.world_from_node[1].translation().x(), 1.2, 1e-9);
  // 0.2^2 / 1 + 0.8^2 / 4, halved.
  EXPECT_NEAR(result.final_cost, 0.5 * (0.04 + 0.16), 1e-9);
}

TEST(Optimize, TheGaugeIsTheSmallestIdOrTheFixedNodes) {
  World world = rounds(12, 2, 3, 2);
  const UnalignedIsometry3d place = pose_of({0.3, -0.4, 0.5}, {10, 20, 30});
  for (std::size_t k = 0; k < world.truth.size(); ++k)
    world.graph.nodes[k].world_from_node = place * world.truth[k];
  Result result = optimize(world.graph);
  EXPECT_TRUE(result.world_from_node[0].isApprox(place * world.truth[0], 1e-12));
  EXPECT_TRUE(result.components[0].own_frame);
  world.graph.nodes[5].fixed = true;
  result = optimize(world.graph);
  EXPECT_TRUE(result.world_from_node[5].isApprox(place * world.truth[5], 1e-12));
  EXPECT_FALSE(result.components[0].own_frame);
  EXPECT_EQ(result.components[0].anchor, 5);
  EXPECT_LE(worst_error(world, result), 0.2);
}

TEST(Optimize, MovingTheWorldMovesTheResult) {
  World world = rounds(15, 2, 2, 3);
  for (std::size_t k = 0; k < world.truth.size(); ++k)
    world.graph.nodes[k].world_from_node = world.truth[k];
  const Result here = optimize(world.graph);
  const UnalignedIsometry3d place = pose_of({1, 2, -0.5}, {-4, 5, 100});
  for (Node& node : world.graph.nodes) node.world_from_node = place * *node.world_from_node;
  const Result there = optimize(world.graph);
  for (std::size_t k = 0; k < world.truth.size(); ++k)
    // Both stop when the cost falls by less than 1e-7 of itself.
    EXPECT_LE(((place * here.world_from_node[k]).matrix() - there.world_from_node[k].matrix())
                  .cwiseAbs()
                  .maxCoeff(),
              1e-5);
}

TEST(Optimize, PriorsPlaceAGraphInTheWorld) {
  World world = rounds(12, 1, 1, 4);
  const UnalignedIsometry3d place = pose_of({0.1, 0.2, 2}, {100, -50, 7});
  for (const int node : {0, 4, 9})
    world.graph.priors.push_back({node, place * world.truth[node], information_of(1e-4, 1e-4)});
  const Result result = optimize(world.graph);
  ASSERT_TRUE(result.converged()) << result.reason;
  EXPECT_FALSE(result.components[0].own_frame);
  for (const int node : {0, 4, 9})
    EXPECT_LE(
        (result.world_from_node[node].translation() - (place * world.truth[node]).translation())
            .norm(),
        1e-3);
}

TEST(Optimize, GravityRemovesRollAndPitchDrift) {
  World world = rounds(30, 1, 1, 5);
  world.radians = 0.02;
  std::mt19937_64 random(5);
  world.graph.edges.clear();
  for (int k = 1; k < 30; ++k) world.add(k, k - 1, EdgeKind::odometry, random);
  const auto tilt = [&](const Result& result) {
    double worst = 0;
    for (std::size_t k = 0; k < world.truth.size(); ++k) {
      const Eigen::Vector3d up = world.truth[k].linear().transpose() * Eigen::Vector3d::UnitZ();
      worst = std::max(worst,
                       (result.world_from_node[k].linear() * up - Eigen::Vector3d::UnitZ()).norm());
    }
    return worst;
  };
  const double before = tilt(optimize(world.graph));
  for (int k = 0; k < 30; ++k) {
    const Eigen::Vector3d up = world.truth[k].linear().transpose() * Eigen::Vector3d::UnitZ();
    world.graph.gravity.push_back({k, up, 0.1});
  }
  const Result result = optimize(world.graph);
  ASSERT_TRUE(result.converged()) << result.reason;
  EXPECT_GT(before, 0.03);
  // Three sigma of a direction of 0.1 degrees.
  EXPECT_LE(tilt(result), 3 * 0.1 * 3.1416 / 180);
}

TEST(Optimize, GravityTurnsAGraphThatIsUpsideDown) {
  // Exactly opposite directions leave the axis of the turn open.
  Graph graph;
  graph.nodes = {{0, UnalignedIsometry3d::Identity()}, {1, pose_of({0, 0, 0}, {1, 0, 0})}};
  graph.edges.resize(1);
  graph.edges[0].source = 1;
  graph.edges[0].target_from_source = pose_of({0, 0, 0}, {1, 0, 0});
  graph.edges[0].kind = EdgeKind::odometry;
  for (int k = 0; k < 2; ++k) graph.gravity.push_back({k, {0, 0, -1}, 1});
  const Result result = optimize(graph);
  ASSERT_TRUE(result.converged()) << result.reason;
  for (const UnalignedIsometry3d& pose : result.world_from_node) {
    // The square root of the precision of double: half a turn from its sine.
    EXPECT_NEAR(pose.linear()(2, 2), -1, 1e-7);
    EXPECT_NEAR(pose.linear().determinant(), 1, 1e-12);
  }
  EXPECT_NEAR(
      (result.world_from_node[1].translation() - result.world_from_node[0].translation()).norm(), 1,
      1e-7);
}

TEST(Optimize, OdometryWithoutInformationDriftsByTheMetre) {
  // Two odometry edges of 1 m and 9 m between fixed ends that are 11 m apart: by default the sigma
  // is 2 % of the length, so the missing metre is shared 1 : 81.
  Graph graph;
  graph.nodes = {
      {0, UnalignedIsometry3d::Identity(), true}, {1}, {2, pose_of({0, 0, 0}, {11, 0, 0}), true}};
  graph.edges.resize(2);
  graph.edges[0].source = 1;
  graph.edges[0].target = 0;
  graph.edges[0].target_from_source = pose_of({0, 0, 0}, {1, 0, 0});
  graph.edges[1].source = 2;
  graph.edges[1].target = 1;
  graph.edges[1].target_from_source = pose_of({0, 0, 0}, {9, 0, 0});
  for (Edge& edge : graph.edges) edge.kind = EdgeKind::odometry;
  const Result result = optimize(graph);
  ASSERT_TRUE(result.converged());
  EXPECT_NEAR(result.world_from_node[1].translation().x(), 1 + 1.0 / 82, 1e-6);
}

TEST(Optimize, MarginalCovarianceOfAChainGrowsWithItsLength) {
  Graph graph;
  graph.nodes = {{0}, {1}, {2}};
  for (int k = 0; k < 2; ++k) {
    Edge edge;
    edge.source = k + 1;
    edge.target = k;
    edge.kind = EdgeKind::odometry;
    edge.information = information_of(0.001, 0.1);
    graph.edges.push_back(edge);
  }
  Options options;
  options.marginals = {2, 0, 1};
  const Result result = optimize(graph, options);
  ASSERT_EQ(result.marginals.size(), 3u);
  // No lever arm: the poses coincide, so variances add up.
  EXPECT_NEAR(result.marginals[0].covariance(4, 4), 0.02, 1e-9);
  EXPECT_EQ(result.marginals[1].covariance, (UnalignedMatrix6d::Zero()));
  EXPECT_NEAR(result.marginals[2].covariance(0, 0), 1e-6, 1e-12);
}

TEST(Optimize, CanBeStopped) {
  const World world = rounds(20, 2, 1, 6);
  Options options;
  int calls = 0;
  options.should_stop = [&](const Progress& progress) {
    EXPECT_GE(progress.cost, 0);
    return ++calls == 2;
  };
  const Result result = optimize(world.graph, options);
  EXPECT_EQ(result.status, Status::cancelled);
  EXPECT_EQ(result.world_from_node.size(), world.truth.size());
  EXPECT_TRUE(result.world_from_node.back().matrix().allFinite());
}

TEST(Optimize, SaysThatIterationsRanOut) {
  World world = rounds(20, 2, 1, 6);
  Options options;
  options.robust = Robust::none;
  options.solver.max_iterations = 1;
  options.solver.relative_tolerance = 0;
  const Result result = optimize(world.graph, options);
  EXPECT_EQ(result.status, Status::max_iterations);
  EXPECT_NE(result.reason.find("max_iterations"), std::string::npos);
}

TEST(Optimize, GraphsWithoutNodesOrEdgesAreAStatus) {
  EXPECT_EQ(optimize({}).status, Status::no_nodes);
  Graph graph;
  graph.nodes = {{3}, {1, pose_of({0, 0, 1}, {1, 2, 3})}};
  const Result result = optimize(graph);
  EXPECT_EQ(result.status, Status::converged);
  ASSERT_EQ(result.components.size(), 2u);
  EXPECT_EQ(result.components[0].anchor, 1);
  EXPECT_TRUE(result.world_from_node[1].isApprox(*graph.nodes[1].world_from_node));
}

}  // namespace
}  // namespace gpureg::pose_graph
