// SPDX-License-Identifier: BSD-3-Clause
#include "graphs.hpp"

namespace gpureg::pose_graph {
namespace {

using namespace test;

/// Makes the correct pose an alternative behind a wrong one that the registration preferred.
void hide(Edge& edge, const UnalignedIsometry3d& wrong) {
  EdgeMode correct;
  correct.target_from_source = edge.target_from_source;
  correct.information = edge.information;
  correct.confidence = 0.3;
  edge.target_from_source = wrong;
  edge.confidence = 0.6;
  edge.alternatives.push_back(correct);
}

TEST(Modes, TheModeThatFitsTheGraphIsChosen) {
  World world = rounds(30, 2, 2, 1);
  std::mt19937_64 random(1);
  std::vector<std::size_t> hidden;
  for (std::size_t k = 0; k < world.graph.edges.size(); ++k)
    if (world.graph.edges[k].kind == EdgeKind::loop && hidden.size() < 6) {
      hide(world.graph.edges[k], random_pose(random, 1, 2));
      hidden.push_back(k);
    }
  const Result result = optimize(world.graph);
  for (const std::size_t k : hidden) {
    EXPECT_EQ(result.edges[k].mode, 1u);
    EXPECT_TRUE(result.edges[k].state == EdgeState::accepted || result.edges[k].squared_error > 14);
  }
  EXPECT_LE(worst_error(world, result), 0.3);
}

TEST(Modes, ScansWithWrongModesThatAgreeWithEachOther) {
  // Five scans of one room are registered to the room's twin: all their first modes to the other
  // scans are wrong by the same motion. Their second modes are correct.
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    World world = scans(20, 7, seed);
    const UnalignedIsometry3d twin = pose_of({0, 0, 1.5}, {2, -1, 0});
    std::vector<std::size_t> hidden;
    for (std::size_t k = 0; k < world.graph.edges.size(); ++k) {
      Edge& edge = world.graph.edges[k];
      edge.confidence = 0.7;
      if (edge.source >= 5 || edge.target < 5) continue;
      if (edge.target % 3 != 0) continue;
      hide(edge, world.truth[edge.target].inverse() * twin * world.truth[edge.source]);
      hidden.push_back(k);
    }
    ASSERT_FALSE(hidden.empty());
    const Result result = optimize(world.graph);
    for (const std::size_t k : hidden) EXPECT_EQ(result.edges[k].mode, 1u) << k;
    EXPECT_LE(worst_error(world, result), 0.1);
  }
}

TEST(Modes, NoneIsAcceptedWhereAllAreWrong) {
  World world = rounds(30, 2, 1, 3);
  std::mt19937_64 random(3);
  Edge& edge = world.graph.edges.back();
  edge.target_from_source = random_pose(random, 1, 2);
  for (int k = 0; k < 4; ++k) {
    EdgeMode mode;
    mode.target_from_source = random_pose(random, 1, 2);
    edge.alternatives.push_back(mode);
  }
  const Result result = optimize(world.graph);
  EXPECT_EQ(result.edges.back().state, EdgeState::rejected);
}

}  // namespace
}  // namespace gpureg::pose_graph
