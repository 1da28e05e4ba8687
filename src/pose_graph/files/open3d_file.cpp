// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/LU>
#include <charconv>
#include <cmath>

#include "common/rigid.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "gpureg/pose_graph/files.hpp"
#include "pose_graph/files/json.hpp"
#include "pose_graph/files/written_graph.hpp"

namespace gpureg::pose_graph {
namespace {

using json::Document;
using json::Value;

/// Open3D writes matrices column by column.
UnalignedIsometry3d read_pose(const Document& document, const Value& object, const char* name) {
  const std::vector<double> v = document.numbers(object, name, 16);
  UnalignedIsometry3d pose;
  pose.matrix() = Eigen::Map<const Eigen::Matrix4d>(v.data());
  const std::string why = why_not_rigid(pose.matrix());
  if (!why.empty())
    document.fail(object.line,
                  std::string(name) + " of the object that begins here is no rigid motion: " + why);
  pose.matrix().row(3) << 0, 0, 0, 1;
  check_pose(pose, [&](const std::string& reason) {
    document.fail(object.line, "of the object that begins here, " + reason);
  });
  return pose;
}

std::int64_t read_id(const Document& document, const Value& edge, const char* name,
                     std::size_t nodes) {
  const double id = document.number(edge, name);
  if (id != std::floor(id) || id < 0 || id >= static_cast<double>(nodes)) {
    char text[40];
    const auto end = std::to_chars(text, text + sizeof text, id).ptr;
    document.fail(document.line(edge, name), std::string(name) + " is " + std::string(text, end) +
                                                 ", but the file has " + std::to_string(nodes) +
                                                 " nodes");
  }
  return static_cast<std::int64_t>(id);
}

Edge read_edge(const Document& document, const Value& value, std::size_t nodes) {
  Edge edge;
  edge.source = read_id(document, value, "source_node_id", nodes);
  edge.target = read_id(document, value, "target_node_id", nodes);
  if (edge.source == edge.target)
    document.fail(value.line, "the edge that begins here connects node " +
                                  std::to_string(edge.source) + " with itself");
  edge.target_from_source = read_pose(document, value, "transformation");
  const std::vector<double> v = document.numbers(value, "information", 36);
  edge.information = Eigen::Map<const Eigen::Matrix<double, 6, 6>>(v.data());
  check_information(*edge.information, [&](const std::string& reason) {
    document.fail(value.line, "of the edge that begins here, " + reason);
  });
  const bool uncertain = document.boolean(value, "uncertain");
  edge.kind = uncertain ? EdgeKind::loop : EdgeKind::odometry;
  const double confidence = document.number(value, "confidence");
  if (!(confidence >= 0 && confidence <= 1))
    document.fail(document.line(value, "confidence"),
                  "confidence is " + std::to_string(confidence) + ", expected a number in [0, 1]");
  // Open3D writes 1 where it has never estimated the confidence: that says nothing.
  if (uncertain && confidence < 1) edge.confidence = confidence;
  return edge;
}

template <typename Matrix>
void append_matrix(std::string& text, const char* name, const Matrix& matrix) {
  text += std::string("\"") + name + "\": [";
  for (Eigen::Index k = 0; k < matrix.size(); ++k) {
    char buffer[40];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, matrix.data()[k]).ptr;
    if (k > 0) text += ", ";
    text.append(buffer, end);
  }
  text += ']';
}

constexpr const char* kVersion = "\"version_major\": 1, \"version_minor\": 0";

}  // namespace

Graph read_open3d(const std::string& path) {
  const Document document(path);
  const Value& root = document.root();
  const std::string& name = document.text(root, "class_name");
  if (name != "PoseGraph")
    document.fail(document.line(root, "class_name"),
                  "class_name is '" + name.substr(0, 40) + "', expected 'PoseGraph'");
  Graph graph;
  for (const Value& value : document.array(root, "nodes")) {
    Node node;
    node.id = static_cast<std::int64_t>(graph.nodes.size());
    node.world_from_node = read_pose(document, value, "pose");
    graph.nodes.push_back(node);
  }
  for (const Value& value : document.array(root, "edges"))
    graph.edges.push_back(read_edge(document, value, graph.nodes.size()));
  return graph;
}

void write_open3d(const std::string& path, const Graph& graph, const Result* result) {
  const WrittenGraph written(graph, result, "Open3D");
  for (std::size_t k = 0; k < graph.nodes.size(); ++k)
    if (graph.nodes[k].id != static_cast<std::int64_t>(k))
      throw InvalidArgument("nodes[" + std::to_string(k) + "].id is " +
                            std::to_string(graph.nodes[k].id) + ", expected " + std::to_string(k) +
                            ": Open3D refers to nodes by position");
  std::string text = "{\n\"class_name\": \"PoseGraph\",\n\"edges\": [";
  for (std::size_t k = 0; k < written.edges.size(); ++k) {
    const WrittenEdge& edge = written.edges[k];
    text += k ? ",\n" : "\n";
    char confidence[40];
    const auto end =
        std::to_chars(confidence, confidence + sizeof confidence, edge.loop ? edge.confidence : 1.0)
            .ptr;
    text += "{\"class_name\": \"PoseGraphEdge\", \"confidence\": " + std::string(confidence, end) +
            ", ";
    append_matrix(text, "information", edge.information);
    text += ", \"source_node_id\": " + std::to_string(edge.source) +
            ", \"target_node_id\": " + std::to_string(edge.target) + ", ";
    append_matrix(text, "transformation", edge.target_from_source.matrix());
    text +=
        std::string(", \"uncertain\": ") + (edge.loop ? "true" : "false") + ", " + kVersion + "}";
  }
  text += "\n],\n\"nodes\": [";
  for (std::size_t k = 0; k < written.poses.size(); ++k) {
    text += k ? ",\n" : "\n";
    text += "{\"class_name\": \"PoseGraphNode\", ";
    append_matrix(text, "pose", written.poses[k].matrix());
    text += std::string(", ") + kVersion + "}";
  }
  text += std::string("\n],\n") + kVersion + "\n}\n";
  files::write_atomically(path, text);
}

}  // namespace gpureg::pose_graph
