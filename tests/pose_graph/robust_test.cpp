// SPDX-License-Identifier: BSD-3-Clause
#include <ctime>

#include "graphs.hpp"

namespace gpureg::pose_graph {
namespace {

using namespace test;

/// A loop that claims that two nodes coincide, displaced.
void add_false(World& world, int source, int target, const UnalignedIsometry3d& claim) {
  Edge edge;
  edge.source = source;
  edge.target = target;
  edge.target_from_source = claim;
  edge.information = information_of(world.radians, world.metres);
  world.graph.edges.push_back(edge);
}

/// No false loop (from the edge `true_edges` on) is accepted, and of the true ones only those are
/// rejected whose error is beyond the 99 % quantile: about one in a hundred.
void expect_told_apart(const World& world, const Result& result, std::size_t true_edges) {
  std::size_t lost = 0, wrong = 0, loops = 0;
  for (std::size_t k = 0; k < world.graph.edges.size(); ++k) {
    if (world.graph.edges[k].kind == EdgeKind::odometry) continue;
    const bool accepted = result.edges[k].state == EdgeState::accepted;
    loops += k < true_edges;
    wrong += k >= true_edges && accepted;
    if (k < true_edges && !accepted) {
      ++lost;
      EXPECT_GT(result.edges[k].squared_error, 15) << k;
    }
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_LE(lost, 3 + loops / 50);
}

TEST(Gnc, RejectsRandomLoops) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    World world = rounds(40, 3, 2, seed);
    const std::size_t true_edges = world.graph.edges.size();
    std::mt19937_64 random(seed);
    for (int k = 0; k < 120; ++k)
      add_false(world, static_cast<int>(60 + random() % 60), static_cast<int>(random() % 50),
                random_pose(random, 1, 2));
    const Result result = optimize(world.graph);
    EXPECT_EQ(result.status, Status::converged) << result.reason;
    expect_told_apart(world, result, true_edges);
    // A few loops less than least squares with all true ones has.
    EXPECT_LE(worst_difference(world, true_edges, result), 0.05);
  }
}

TEST(Gnc, RejectsLoopsThatAgreeWithEachOther) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    World world = rounds(40, 3, 1, seed);
    const std::size_t true_edges = world.graph.edges.size();
    std::mt19937_64 random(seed);
    // Twelve places that look like another one, each for six nodes in a row.
    for (int group = 0; group < 12; ++group) {
      const int a = static_cast<int>(60 + random() % 50), b = static_cast<int>(random() % 50);
      const UnalignedIsometry3d twin =
          world.truth[b] * random_pose(random, 0.5, 0.5) * world.truth[a].inverse();
      for (int k = 0; k < 6; ++k)
        add_false(world, a + k, b + k, world.truth[b + k].inverse() * twin * world.truth[a + k]);
    }
    const Result result = optimize(world.graph);
    expect_told_apart(world, result, true_edges);
    // A few loops less than least squares with all true ones has.
    EXPECT_LE(worst_difference(world, true_edges, result), 0.05);
  }
}

TEST(Gnc, LongDriftDoesNotLoseATrueLoop) {
  // A single round of 400 m with one loop at its end: the drift is a hundred times the loop's
  // sigma, and the odometry's covariance explains it.
  World world = rounds(400, 1, 1, 11);
  std::mt19937_64 random(12);
  world.add(399, 0, EdgeKind::loop, random);
  const Result result = optimize(world.graph);
  EXPECT_EQ(result.edges.back().state, EdgeState::accepted);
  EXPECT_EQ(result.edges.back().weight, 1);
}

TEST(Gnc, ConfidenceDecidesBetweenTwoLoopsThatContradictEachOther) {
  World world = rounds(30, 1, 1, 7);
  std::mt19937_64 random(7);
  // Both are explained by the drift; they cannot both be correct.
  Edge& first = world.add(29, 0, EdgeKind::loop, random);
  first.target_from_source = first.target_from_source * pose_of({0, 0, 0}, {0.12, 0, 0});
  Edge& second = world.add(29, 0, EdgeKind::loop, random);
  second.target_from_source = second.target_from_source * pose_of({0, 0, 0}, {-0.12, 0, 0});
  const std::size_t a = world.graph.edges.size() - 2, b = a + 1;
  for (const bool first_better : {true, false}) {
    world.graph.edges[a].confidence = first_better ? 0.95 : 0.05;
    world.graph.edges[b].confidence = first_better ? 0.05 : 0.95;
    const Result result = optimize(world.graph);
    EXPECT_EQ(result.edges[a].state == EdgeState::accepted, first_better);
    EXPECT_EQ(result.edges[b].state == EdgeState::accepted, !first_better);
  }
}

TEST(Gnc, ALoopOfNoConfidenceIsNeverAccepted) {
  World world = rounds(20, 2, 1, 8);
  for (Edge& edge : world.graph.edges)
    if (edge.kind == EdgeKind::loop) edge.confidence = 0;
  const Result result = optimize(world.graph);
  EXPECT_EQ(result.accepted_loops(world.graph), 0u);
  EXPECT_EQ(result.components.size(), 1u);
}

TEST(Gnc, ScansWithoutOdometryAreJoined) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    World world = scans(25, 5, seed);
    const std::size_t true_edges = world.graph.edges.size();
    std::mt19937_64 random(seed);
    for (Edge& edge : world.graph.edges) edge.confidence = 0.8;
    for (std::size_t k = 0; k < true_edges; ++k) {
      const int a = static_cast<int>(random() % 25), b = static_cast<int>(random() % 25);
      if (a == b) continue;
      add_false(world, a, b, random_pose(random, 1, 2));
      world.graph.edges.back().confidence = 0.4;
    }
    const Result result = optimize(world.graph);
    expect_told_apart(world, result, true_edges);
    EXPECT_EQ(result.components.size(), 1u);
    EXPECT_LE(worst_difference(world, true_edges, result), 0.05);
  }
}

TEST(Gnc, ALoopThatNothingChecksIsTakenByItsConfidence) {
  // Ten scans that check each other, and one that hangs on a single loop.
  World world = scans(10, 4, 3);
  world.truth.push_back(pose_of({0, 0, 0}, {9, 0, 0}));
  world.graph.nodes.push_back({10});
  std::mt19937_64 random(3);
  world.add(10, 3, EdgeKind::loop, random);
  for (const double confidence : {0.5, 0.45}) {
    world.graph.edges.back().confidence = confidence;
    const Result result = optimize(world.graph);
    const bool taken = confidence >= 0.5;
    EXPECT_EQ(result.edges.back().state == EdgeState::accepted, taken);
    EXPECT_EQ(result.components.size(), taken ? 1u : 2u);
  }
}

TEST(Gnc, PlaceholdersForPosesDoNoHarm) {
  World world = scans(20, 5, 5);
  const std::size_t true_edges = world.graph.edges.size();
  for (Node& node : world.graph.nodes) node.world_from_node = UnalignedIsometry3d::Identity();
  const Result result = optimize(world.graph);
  EXPECT_EQ(result.status, Status::converged) << result.reason;
  // Every loop contradicts the placeholders; half a squared error of six degrees of freedom is
  // left.
  EXPECT_GT(result.initial_cost, 3 * result.final_cost);
  for (Node& node : world.graph.nodes) node.world_from_node.reset();
  EXPECT_LE(worst_difference(world, true_edges, result), 0.05);
}

TEST(Gnc, CopiesOfOneLoopTakeLinearTime) {
  World world = rounds(20, 2, 20, 3);
  const Edge loop = world.graph.edges.back();
  for (int k = 1; k < 8000; ++k) world.graph.edges.push_back(loop);
  const std::clock_t begin = std::clock();
  const Result result = optimize(world.graph);
  // A second of processor time. Comparing each copy with all others takes 82 s and 1 GB.
  EXPECT_LT(std::clock() - begin, 20 * CLOCKS_PER_SEC);
  EXPECT_TRUE(result.converged()) << result.reason;
  EXPECT_EQ(result.accepted_loops(world.graph), 8000u);
}

TEST(Gnc, EveryEdgeHasAWeightAndASquaredError) {
  const World world = rounds(20, 2, 1, 9);
  const Result result = optimize(world.graph);
  for (std::size_t k = 0; k < world.graph.edges.size(); ++k) {
    EXPECT_GE(result.edges[k].weight, 0);
    EXPECT_LE(result.edges[k].weight, 1);
    EXPECT_GE(result.edges[k].squared_error, 0);
    if (world.graph.edges[k].kind == EdgeKind::odometry) {
      EXPECT_EQ(result.edges[k].weight, 1);
      EXPECT_EQ(result.edges[k].state, EdgeState::accepted);
    }
  }
}

// ---------------------------------------------------------------------------------------------
// The line process in one dimension: a chain of `kSteps` odometry edges and one loop over all of
// it. For a misclosure d, odometry of information kappa weighted by lambda, and l = 1, each edge
// takes its share and the loop keeps d / (1 + kSteps / lambda).

constexpr int kSteps = 20;
constexpr double kKappa = 1000;

Result line(double misclosure, const Options& options) {
  Graph graph;
  UnalignedMatrix6d information = UnalignedMatrix6d::Identity();
  information *= kKappa;
  for (int k = 0; k <= kSteps; ++k) {
    graph.nodes.push_back({k});
    if (k == 0) continue;
    Edge edge;
    edge.source = k;
    edge.target = k - 1;
    edge.kind = EdgeKind::odometry;
    edge.target_from_source = pose_of({0, 0, 0}, {1, 0, 0});
    edge.information = information;
    graph.edges.push_back(edge);
  }
  Edge loop;
  loop.source = kSteps;
  loop.target = 0;
  loop.target_from_source = pose_of({0, 0, 0}, {kSteps + misclosure, 0, 0});
  loop.information = information;
  graph.edges.push_back(loop);
  return optimize(graph, options);
}

TEST(LineProcess, TauIsTheDistanceOfAQuarterWhereMuIsSquared) {
  Options options = Options::loopsmart();
  options.line_process.tau_not_squared = false;
  // lambda = 1000: the chain of 20 hardly gives way, so nearly all of the misclosure is left.
  EXPECT_EQ(line(0.19, options).edges.back().state, EdgeState::accepted);
  EXPECT_EQ(line(0.22, options).edges.back().state, EdgeState::rejected);
}

TEST(LineProcess, AsPrintedInThePaperTheGateIsTheSquareRootOfTau) {
  const Options options = Options::loopsmart();
  EXPECT_EQ(line(0.43, options).edges.back().state, EdgeState::accepted);
  EXPECT_EQ(line(0.47, options).edges.back().state, EdgeState::rejected);
}

TEST(LineProcess, WeightIsThatOfGemanAndMcClure) {
  Options options = Options::loopsmart();
  const Result result = line(0.3, options);
  const double mu = 0.2 * kKappa;
  // The weight is computed before the last minimisation, which accepts the loop in full.
  EXPECT_NEAR(result.edges.back().weight,
              std::pow(mu / (mu + result.edges.back().squared_error), 2), 0.01);
}

TEST(LineProcess, ALightOdometryTakesADriftThatTheDefaultPresetRejects) {
  Options options = Options::loopsmart();
  options.line_process.odometry_weight = 1;
  EXPECT_EQ(line(1.0, options).edges.back().state, EdgeState::accepted);
  EXPECT_EQ(line(1.0, Options::loopsmart()).edges.back().state, EdgeState::rejected);
}

}  // namespace
}  // namespace gpureg::pose_graph
