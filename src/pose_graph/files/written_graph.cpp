// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/files/written_graph.hpp"

#include "gpureg/error.hpp"

namespace gpureg::pose_graph {
namespace {

[[noreturn]] void refuse(const std::string& what, const char* format) {
  throw InvalidArgument(what + ", which a file of " + format + " cannot say");
}

std::string entry(const char* list, std::size_t index) {
  return std::string(list) + "[" + std::to_string(index) + "]";
}

WrittenEdge written_edge(const Edge& edge, std::uint32_t mode, const std::string& name,
                         const char* format) {
  WrittenEdge out;
  out.source = edge.source;
  out.target = edge.target;
  out.loop = edge.kind == EdgeKind::loop;
  out.confidence = mode == 0 ? edge.confidence : edge.alternatives[mode - 1].confidence;
  const auto& information = mode == 0 ? edge.information : edge.alternatives[mode - 1].information;
  if (!information) refuse(name + " has no information", format);
  out.information = *information;
  out.target_from_source =
      mode == 0 ? edge.target_from_source : edge.alternatives[mode - 1].target_from_source;
  return out;
}

}  // namespace

WrittenGraph::WrittenGraph(const Graph& graph, const Result* result, const char* format) {
  graph.validate();
  if (!graph.gravity.empty()) refuse("gravity has a factor", format);
  if (!graph.priors.empty()) refuse("priors has a factor", format);
  if (result && (result->world_from_node.size() != graph.nodes.size() ||
                 result->edges.size() != graph.edges.size()))
    throw InvalidArgument("result has " + std::to_string(result->world_from_node.size()) +
                          " poses and " + std::to_string(result->edges.size()) +
                          " edges, expected the graph's " + std::to_string(graph.nodes.size()) +
                          " and " + std::to_string(graph.edges.size()));
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    if (result) {
      poses.push_back(result->world_from_node[k]);
    } else {
      if (!graph.nodes[k].world_from_node)
        refuse(entry("nodes", k) + " has no world_from_node", format);
      poses.push_back(*graph.nodes[k].world_from_node);
    }
  }
  for (std::size_t k = 0; k < graph.edges.size(); ++k) {
    const Edge& edge = graph.edges[k];
    if (result && result->edges[k].state == EdgeState::rejected) continue;
    const std::uint32_t mode = result ? result->edges[k].mode : 0;
    if (mode > edge.alternatives.size())
      throw InvalidArgument("result." + entry("edges", k) + ".mode is " + std::to_string(mode) +
                            ", but the edge has " + std::to_string(edge.alternatives.size()) +
                            " alternatives");
    edges.push_back(written_edge(edge, mode, entry("edges", k), format));
  }
}

namespace {

/// Calls fail(reason) if the graph is not valid; the reason leaves out where in the graph.
void check(const Graph& graph, const std::string& where,
           const std::function<void(const std::string&)>& fail) {
  try {
    graph.validate();
  } catch (const InvalidArgument& error) {
    const std::string message = error.what();
    fail(message.compare(0, where.size(), where) == 0 ? message.substr(where.size()) : message);
  }
}

}  // namespace

void check_pose(const UnalignedIsometry3d& pose,
                const std::function<void(const std::string&)>& fail) {
  Graph graph;
  graph.nodes.resize(1);
  graph.nodes[0].world_from_node = pose;
  check(graph, "nodes[0].", fail);
}

void check_information(const UnalignedMatrix6d& information,
                       const std::function<void(const std::string&)>& fail) {
  Graph graph;
  graph.nodes.resize(2);
  graph.nodes[1].id = 1;
  graph.edges.resize(1);
  graph.edges[0].source = 1;
  graph.edges[0].information = information;
  check(graph, "edges[0].", fail);
}

}  // namespace gpureg::pose_graph
