// SPDX-License-Identifier: BSD-3-Clause
#include <ctime>

#include "gpureg/error.hpp"
#include "graphs.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::pose_graph {
namespace {

using namespace test;
using gpureg::test::content_of;
using gpureg::test::expect_error;
using gpureg::test::TemporaryFolder;

const std::string kVertices =
    "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 2 3 0 0 0.70710678 0.70710678\n";
const std::string kUpper = " 1 0 0 0 0 0 2 0 0 0 0 3 0 0 0 4 0 0 5 0 6\n";
const std::string kEdge = "EDGE_SE3:QUAT 0 1 1 2 3 0 0 0.70710678 0.70710678" + kUpper;

Graph with_poses(World world) {
  for (std::size_t k = 0; k < world.truth.size(); ++k)
    world.graph.nodes[k].world_from_node = world.truth[k];
  return world.graph;
}

Eigen::Matrix<double, 6, 1> diagonal_of(const Edge& edge) { return edge.information->diagonal(); }

void expect_same(const Graph& a, const Graph& b) {
  ASSERT_EQ(a.nodes.size(), b.nodes.size());
  ASSERT_EQ(a.edges.size(), b.edges.size());
  // A rotation goes through a unit quaternion and back.
  constexpr double rounding = 1e-14;
  for (std::size_t k = 0; k < a.nodes.size(); ++k) {
    EXPECT_EQ(a.nodes[k].id, b.nodes[k].id);
    EXPECT_EQ(a.nodes[k].fixed, b.nodes[k].fixed);
    EXPECT_TRUE(a.nodes[k].world_from_node->isApprox(*b.nodes[k].world_from_node, rounding));
  }
  for (std::size_t k = 0; k < a.edges.size(); ++k) {
    EXPECT_EQ(a.edges[k].source, b.edges[k].source);
    EXPECT_EQ(a.edges[k].target, b.edges[k].target);
    EXPECT_EQ(a.edges[k].kind, b.edges[k].kind);
    EXPECT_TRUE(a.edges[k].target_from_source.isApprox(b.edges[k].target_from_source, rounding));
    EXPECT_EQ(*a.edges[k].information, *b.edges[k].information);
  }
}

TEST(G2oFile, RoundTrip) {
  const TemporaryFolder folder;
  Graph graph = with_poses(rounds(15, 2, 2, 1));
  graph.nodes[3].fixed = graph.nodes[7].fixed = true;
  for (const G2oRotation rotation : {G2oRotation::quaternion_vector, G2oRotation::angle}) {
    write_g2o(folder / "a.g2o", graph, nullptr, rotation);
    expect_same(graph, read_g2o(folder / "a.g2o", rotation));
  }
}

TEST(G2oFile, ReadsThePublishedLayout) {
  const TemporaryFolder folder;
  const std::string path = folder.write("a.g2o", "# a comment\n" + kVertices + "FIX 1\n" + kEdge);
  const Graph graph = read_g2o(path);
  ASSERT_EQ(graph.edges.size(), 1u);
  EXPECT_FALSE(graph.nodes[0].fixed);
  EXPECT_TRUE(graph.nodes[1].fixed);
  const Edge& edge = graph.edges[0];
  EXPECT_EQ(edge.target, 0);
  EXPECT_EQ(edge.source, 1);
  EXPECT_EQ(edge.kind, EdgeKind::odometry);
  // Half an angle per unit: a quarter of 4, 5, 6 on the rotation, which comes first.
  Eigen::Matrix<double, 6, 1> diagonal;
  diagonal << 1, 1.25, 1.5, 1, 2, 3;
  EXPECT_EQ(diagonal_of(edge), diagonal);
  const Graph angle = read_g2o(path, G2oRotation::angle);
  diagonal << 4, 5, 6, 1, 2, 3;
  EXPECT_EQ(diagonal_of(angle.edges[0]), diagonal);
  // The edge measures node 1 in the frame of node 0, as the vertices have it: it costs nothing.
  EXPECT_LE(optimize(graph).final_cost, 1e-12);
}

TEST(G2oFile, AResultWritesItsPosesAndLeavesRejectedLoopsOut) {
  World world = rounds(15, 2, 1, 2);
  Edge wrong = world.graph.edges.back();
  wrong.target_from_source = pose_of({1, 0, 0}, {1, 1, 1});
  world.graph.edges.push_back(wrong);
  const Result result = optimize(world.graph);
  const TemporaryFolder folder;
  write_g2o(folder / "a.g2o", world.graph, &result);
  const Graph read = read_g2o(folder / "a.g2o");
  EXPECT_EQ(read.edges.size(), 29 + result.accepted_loops(world.graph));
  EXPECT_TRUE(read.nodes[9].world_from_node->isApprox(result.world_from_node[9], 1e-14));
}

TEST(G2oFile, NamesFileAndLineOfMistakes) {
  const TemporaryFolder folder;
  const auto expect_bad = [&](const std::string& text, const std::string& line,
                              const std::string& reason) {
    SCOPED_TRACE(text);
    const std::string path = folder.write("bad.g2o", text);
    expect_error<IoError>([&] { read_g2o(path); }, {path + ":" + line + ":", reason});
  };
  expect_bad(kVertices + "EDGE_SE2 0 1 0 0 0\n", "3", "'EDGE_SE2'");
  expect_bad(kVertices + "VERTEX_SE3:QUAT 1 0 0 0 0 0 0 1\n", "3", "node 1 stands twice");
  expect_bad(kVertices + "FIX 5\n" + kEdge, "3", "node 5");
  expect_bad(kVertices + "FIX\n", "3", "no id");
  expect_bad("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n" + kEdge, "2", "node 1");
  expect_bad("VERTEX_SE3:QUAT 0 0 0 0 0 0 1\n", "1", "7 values, expected 8");
  expect_bad("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 0.5\n", "1", "length 0.5");
  expect_bad("VERTEX_SE3:QUAT 0 nan 0 0 0 0 0 1\n", "1", "x is 'nan'");
  expect_bad("VERTEX_SE3:QUAT -1 0 0 0 0 0 0 1\n", "1", "the id is '-1'");
  expect_bad(kVertices + "EDGE_SE3:QUAT 1 1 1 2 3 0 0 0 1" + kUpper, "3", "with itself");
  expect_bad(
      kVertices + "EDGE_SE3:QUAT 0 1 1 2 3 0 0 0 1 -1 0 0 0 0 0 2 0 0 0 0 3 0 0 0 4 0 0 5 0 6\n",
      "3", "smallest_eigenvalue is -1");
  expect_bad(kVertices + kEdge.substr(0, kEdge.size() / 2), "3", "expected 30");
  expect_error<IoError>([&] { read_g2o(folder / "none.g2o"); }, {"none.g2o"});
}

TEST(G2oFile, RefusesWhatItCannotSay) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.g2o";
  Graph graph = with_poses(rounds(5, 1, 1, 1));
  const auto expect_refused = [&](const Graph& g, const std::string& reason) {
    expect_error<InvalidArgument>([&] { write_g2o(path, g); }, {reason});
  };
  Graph changed = graph;
  changed.nodes[2].world_from_node.reset();
  expect_refused(changed, "nodes[2]");
  changed = graph;
  changed.edges[1].information.reset();
  expect_refused(changed, "edges[1] has no information");
  changed = graph;
  changed.gravity.push_back({0});
  expect_refused(changed, "gravity");
  changed = graph;
  changed.priors.push_back({0});
  expect_refused(changed, "priors");
  changed = graph;
  changed.nodes[0].id = -4;
  changed.edges[0].target = -4;
  expect_refused(changed, "nodes[0].id is -4");
  const Result none;
  expect_error<InvalidArgument>([&] { write_g2o(path, graph, &none); }, {"result has 0 poses"});
  expect_error<IoError>([&] { write_g2o(folder / "no/such/a.g2o", graph); }, {"no/such"});
}

/// As open3d.io.write_pose_graph of Open3D 0.20 writes it.
const std::string kOpen3d =
    "{\n\"class_name\" : \"PoseGraph\",\n\"edges\" : \n[\n{\n\"class_name\" : \"PoseGraphEdge\",\n"
    "\"confidence\" : 0.7,\n\"information\" : \n[\n1.0,0,0,0,0,0, 0,2.0,0,0,0,0, 0,0,3.0,0,0,0,\n"
    "0,0,0,4.0,0,0, 0,0,0,0,5.0,0, 0,0,0,0,0,6.0\n],\n\"source_node_id\" : 1,\n"
    "\"target_node_id\" : 0,\n\"transformation\" : "
    "\n[\n1.0,0,0,0,0,1.0,0,0,0,0,1.0,0,1.0,2.0,3.0,1.0\n"
    "],\n\"uncertain\" : true,\n\"version_major\" : 1,\n\"version_minor\" : 0\n}\n],\n\"nodes\" : "
    "\n[\n"
    "{\"class_name\" : \"PoseGraphNode\",\"pose\" : [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"
    "\"version_major\" : 1,\"version_minor\" : 0},\n"
    "{\"class_name\" : \"PoseGraphNode\",\"pose\" : [1,0,0,0,0,1,0,0,0,0,1,0,1,2,3,1],"
    "\"version_major\" : 1,\"version_minor\" : 0}\n],\n\"version_major\" : 1,\n\"version_minor\" : "
    "0\n}\n";

TEST(Open3dFile, ReadsWhatOpen3dWrites) {
  const TemporaryFolder folder;
  const Graph graph = read_open3d(folder.write("a.json", kOpen3d));
  ASSERT_EQ(graph.nodes.size(), 2u);
  ASSERT_EQ(graph.edges.size(), 1u);
  EXPECT_EQ(graph.edges[0].source, 1);
  EXPECT_EQ(graph.edges[0].target, 0);
  EXPECT_EQ(graph.edges[0].kind, EdgeKind::loop);
  EXPECT_EQ(graph.edges[0].confidence, 0.7);
  EXPECT_EQ(graph.edges[0].target_from_source.translation(), Eigen::Vector3d(1, 2, 3));
  Eigen::Matrix<double, 6, 1> diagonal;
  diagonal << 1, 2, 3, 4, 5, 6;
  EXPECT_EQ(diagonal_of(graph.edges[0]), diagonal);
  EXPECT_LE(optimize(graph).final_cost, 1e-12);
}

TEST(Open3dFile, RoundTrip) {
  const TemporaryFolder folder;
  Graph graph = with_poses(rounds(15, 2, 2, 1));
  graph.edges.back().confidence = 0.25;
  write_open3d(folder / "a.json", graph);
  const Graph read = read_open3d(folder / "a.json");
  expect_same(graph, read);
  EXPECT_EQ(read.edges.back().confidence, 0.25);
  write_open3d(folder / "b.json", read);
  EXPECT_EQ(content_of(folder / "a.json"), content_of(folder / "b.json"));
}

TEST(Open3dFile, NamesFileAndLineOfMistakes) {
  const TemporaryFolder folder;
  const auto expect_bad = [&](const std::string& from, const std::string& to,
                              const std::string& line, const std::string& reason) {
    SCOPED_TRACE(to);
    std::string text = kOpen3d;
    const std::size_t place = text.find(from);
    ASSERT_NE(place, std::string::npos);
    text.replace(place, from.size(), to);
    const std::string path = folder.write("bad.json", text);
    expect_error<IoError>([&] { read_open3d(path); }, {path + ":" + line + ":", reason});
  };
  expect_bad("\"PoseGraph\"", "\"Other\"", "2", "'Other'");
  expect_bad("\"edges\"", "\"edge\"", "1", "no edges");
  expect_bad("0.7", "1.7", "7", "confidence is 1.7");
  expect_bad("0.7", "NaN", "7", "'NaN'");
  expect_bad("0.7", "\"a\"", "7", "confidence is a string");
  expect_bad("1.0,0,0,0,0,0, 0,2.0", "-1.0,0,0,0,0,0, 0,2.0", "5", "smallest_eigenvalue");
  expect_bad("\"source_node_id\" : 1", "\"source_node_id\" : 2", "13", "source_node_id is 2");
  expect_bad("\"source_node_id\" : 1", "\"source_node_id\" : 0.5", "13", "source_node_id is 0.5");
  expect_bad("\"source_node_id\" : 1", "\"source_node_id\" : 0", "5", "with itself");
  expect_bad("1.0,2.0,3.0,1.0", "1.0,2.0,3.0", "16", "15 numbers");
  expect_bad("1.0,2.0,3.0,1.0", "1.0,2.0,3.0,2.0", "5", "transformation");
  expect_bad("[1,0,0,0,0,1,0,0,0,0,1", "[2,0,0,0,0,1,0,0,0,0,1", "26", "pose");
  const std::string cut = folder.write("cut.json", kOpen3d.substr(0, kOpen3d.find("\"nodes\"")));
  expect_error<IoError>([&] { read_open3d(cut); }, {cut, "ends"});
  const std::string deep = folder.write("deep.json", std::string(100000, '['));
  expect_error<IoError>([&] { read_open3d(deep); }, {deep + ":1", "deep"});
  const std::string empty = folder.write("empty.json", "");
  expect_error<IoError>([&] { read_open3d(empty); }, {empty, "ends"});
  expect_bad("\"uncertain\"", "\"confidence\"", "19", "'confidence' stands twice");
}

TEST(Open3dFile, ManyMembersTakeLinearTime) {
  const TemporaryFolder folder;
  std::string members;
  for (int k = 0; k < 80000; ++k) members += "\"name" + std::to_string(k) + "\": 0, ";
  std::string text = kOpen3d;
  text.insert(1, members);
  const std::clock_t begin = std::clock();
  EXPECT_EQ(read_open3d(folder.write("a.json", text)).nodes.size(), 2u);
  // A tenth of a second of processor time. Comparing each name with all before it takes 17 s.
  EXPECT_LT(std::clock() - begin, 5 * CLOCKS_PER_SEC);
}

}  // namespace
}  // namespace gpureg::pose_graph
