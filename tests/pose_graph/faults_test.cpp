// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <limits>

#include "gpureg/error.hpp"
#include "graphs.hpp"
#include "support/expect_error.hpp"

namespace gpureg::pose_graph {
namespace {

using namespace test;
using gpureg::test::expect_error;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void expect_refused(const std::function<void(Graph&)>& change,
                    std::initializer_list<std::string> fragments) {
  World world = rounds(6, 2, 1, 1);
  change(world.graph);
  expect_error<InvalidArgument>([&] { optimize(world.graph); }, fragments);
}

TEST(Faults, GraphsNamePlaceAndValue) {
  expect_refused([](Graph& g) { g.nodes[4].id = 2; }, {"nodes[4].id is 2", "nodes[2]"});
  expect_refused([](Graph& g) { g.edges[3].source = 77; }, {"edges[3].source is 77"});
  expect_refused([](Graph& g) { g.edges[3].target = -1; }, {"edges[3].target is -1"});
  expect_refused([](Graph& g) { g.edges[2].target = g.edges[2].source; },
                 {"edges[2]", "node 3 with itself"});
  expect_refused([](Graph& g) { g.nodes[1].fixed = true; }, {"nodes[1] (id 1)", "fixed"});
  expect_refused([](Graph& g) { g.nodes[1].world_from_node = no_pose(); },
                 {"nodes[1].world_from_node(0, 0) is nan"});
  expect_refused([](Graph& g) { g.edges[5].target_from_source.matrix()(1, 3) = kInfinity; },
                 {"edges[5].target_from_source(1, 3) is inf"});
  expect_refused([](Graph& g) { g.edges[5].target_from_source.matrix()(1, 3) = 1e200; },
                 {"edges[5].target_from_source(1, 3) is 1e+200"});
  expect_refused([](Graph& g) { g.edges[5].target_from_source.matrix()(0, 0) = 2; },
                 {"edges[5].target_from_source is not rigid"});
  expect_refused([](Graph& g) { g.edges[5].target_from_source.matrix().col(0) *= -1; },
                 {"edges[5].target_from_source is not rigid", "determinant -1"});
  expect_refused([](Graph& g) { (*g.edges[0].information)(3, 3) = kNan; },
                 {"edges[0].information(3, 3) is nan"});
  expect_refused([](Graph& g) { (*g.edges[0].information)(3, 4) = 100; },
                 {"edges[0].information is not symmetric", "(4, 3)"});
  expect_refused([](Graph& g) { (*g.edges[0].information)(5, 5) = -2; },
                 {"edges[0].information.smallest_eigenvalue is -2"});
  expect_refused([](Graph& g) { g.edges[0].information->setZero(); },
                 {"edges[0].information.maximum is 0"});
  expect_refused([](Graph& g) { g.edges.back().confidence = 1.5; }, {"confidence is 1.5"});
  expect_refused([](Graph& g) { g.edges.back().confidence = kNan; }, {"confidence is nan"});
  expect_refused([](Graph& g) { g.edges[0].alternatives.emplace_back(); },
                 {"edges[0] is odometry", "alternatives"});
  expect_refused(
      [](Graph& g) {
        g.edges.back().alternatives.emplace_back();
        g.edges.back().alternatives[0].confidence = -1;
      },
      {".alternatives[0].confidence is -1"});
  expect_refused([](Graph& g) { g.edges[1].kind = static_cast<EdgeKind>(9); }, {"kind is 9"});
  expect_refused([](Graph& g) { g.gravity.push_back({99}); }, {"gravity[0].node is 99"});
  expect_refused([](Graph& g) { g.gravity.push_back({1, {0, 0, 0}}); },
                 {"gravity[0].up.norm is 0"});
  expect_refused([](Graph& g) { g.gravity.push_back({1, {0, 0, 1}, 0}); },
                 {"gravity[0].sigma_degrees is 0"});
  expect_refused([](Graph& g) { g.priors.push_back({99}); }, {"priors[0].node is 99"});
  expect_refused(
      [](Graph& g) {
        g.priors.push_back({1});
        g.priors[0].information *= -1;
      },
      {"priors[0].information.smallest_eigenvalue is -1"});
}

TEST(Faults, OptionsNameFieldAndValue) {
  const auto expect_bad = [](const std::function<void(Options&)>& change,
                             const std::string& reason) {
    Options options;
    change(options);
    expect_error<InvalidArgument>([&] { options.validate(); }, {reason});
    expect_error<InvalidArgument>([&] { optimize({}, options); }, {reason});
  };
  expect_bad([](Options& o) { o.gnc.inlier_probability = 1; }, "gnc.inlier_probability is 1");
  expect_bad([](Options& o) { o.gnc.inlier_probability = kNan; }, "gnc.inlier_probability is nan");
  expect_bad([](Options& o) { o.gnc.mu_step = 1; }, "gnc.mu_step is 1");
  expect_bad([](Options& o) { o.gnc.max_rounds = 0; }, "gnc.max_rounds is 0");
  expect_bad([](Options& o) { o.line_process.tau = -0.2; }, "line_process.tau is -0.2");
  expect_bad([](Options& o) { o.line_process.odometry_weight = kInfinity; },
             "line_process.odometry_weight is inf");
  expect_bad([](Options& o) { o.line_process.min_weight = 1; }, "line_process.min_weight is 1");
  expect_bad([](Options& o) { o.drift.min_translation = 0; }, "drift.min_translation is 0");
  expect_bad([](Options& o) { o.drift.rotation_per_degree = -1; },
             "drift.rotation_per_degree is -1");
  expect_bad([](Options& o) { o.loop_noise.rotation = 0; }, "loop_noise.rotation is 0");
  expect_bad([](Options& o) { o.solver.max_iterations = -5; }, "solver.max_iterations is -5");
  expect_bad([](Options& o) { o.solver.relative_tolerance = kNan; },
             "solver.relative_tolerance is nan");
  expect_bad([](Options& o) { o.threads = -1; }, "threads is -1");
  expect_bad([](Options& o) { o.threads = 1 << 20; }, "threads is 1048576");
  expect_bad([](Options& o) { o.robust = static_cast<Robust>(7); }, "robust is 7");
  World world = rounds(5, 1, 1, 1);
  Options options;
  options.marginals = {0, 50};
  expect_error<InvalidArgument>([&] { optimize(world.graph, options); }, {"marginals[1] is 50"});
  Options::loopsmart().validate();
}

TEST(Faults, ExtremeNumbersNeverBecomePosesThatAreNotFinite) {
  for (const double scale : {1e-12, 1e-6, 1e6, 1e12}) {
    SCOPED_TRACE(scale);
    World world = rounds(8, 2, 1, 3);
    for (std::size_t k = 0; k < world.graph.edges.size(); k += 3)
      *world.graph.edges[k].information *= scale;
    const Result result = optimize(world.graph);
    for (const auto& pose : result.world_from_node) EXPECT_TRUE(pose.matrix().allFinite());
    EXPECT_NE(result.status, Status::no_nodes);
  }
}

TEST(Faults, InformationThatLeavesDirectionsFreeIsTaken) {
  World world = rounds(10, 2, 1, 4);
  for (Edge& edge : world.graph.edges)
    if (edge.kind == EdgeKind::loop) edge.information->bottomRightCorner<1, 1>().setZero();
  const Result result = optimize(world.graph);
  EXPECT_EQ(result.status, Status::converged) << result.reason;
  EXPECT_LE(worst_error(world, result), 0.3);
}

TEST(Faults, ContradictingFixedNodesAreNoCrash) {
  World world = rounds(10, 1, 1, 5);
  world.graph.nodes[0].world_from_node = pose_of({0, 0, 0}, {0, 0, 0});
  world.graph.nodes[9].world_from_node = pose_of({0, 0, 3.1}, {1e6, 0, 0});
  world.graph.nodes[0].fixed = world.graph.nodes[9].fixed = true;
  const Result result = optimize(world.graph);
  for (const auto& pose : result.world_from_node) EXPECT_TRUE(pose.matrix().allFinite());
}

}  // namespace
}  // namespace gpureg::pose_graph
