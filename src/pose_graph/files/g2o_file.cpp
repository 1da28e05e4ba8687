// SPDX-License-Identifier: BSD-3-Clause
#include <charconv>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "gpureg/pose_graph/files.hpp"
#include "pose_graph/files/written_graph.hpp"

namespace gpureg::pose_graph {
namespace {

using files::TextFile;

/// Quaternions of files have six digits; one whose length is further from 1 is a mistake.
constexpr double kQuaternionTolerance = 1e-2;
constexpr std::size_t kVertexFields = 9;  // tag id x y z qx qy qz qw
constexpr std::size_t kEdgeFields = 31;   // tag i j pose (7) upper triangle (21)

UnalignedIsometry3d read_pose(const TextFile& file, std::size_t first) {
  static const char* const names[] = {"x", "y", "z", "qx", "qy", "qz", "qw"};
  double v[7];
  for (std::size_t k = 0; k < 7; ++k) v[k] = file.number(first + k, names[k]);
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (std::abs(q.norm() - 1) > kQuaternionTolerance)
    file.fail("the quaternion has length " + std::to_string(q.norm()) + ", expected 1");
  UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
  pose.linear() = q.normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(v[0], v[1], v[2]);
  check_pose(pose, [&](const std::string& reason) { file.fail(reason); });
  return pose;
}

/// Position in Edge::information of a position in g2o's.
int swapped(int k) { return (k + 3) % 6; }

/// What an entry of g2o's information becomes per radian: one unit of the quaternion vector is two
/// radians.
double unit_factor(int row, int column, G2oRotation rotation) {
  if (rotation == G2oRotation::angle) return 1;
  return (row >= 3 ? 0.5 : 1.0) * (column >= 3 ? 0.5 : 1.0);
}

UnalignedMatrix6d read_information(const TextFile& file, std::size_t first, G2oRotation rotation) {
  UnalignedMatrix6d out;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column) {
      const double value = unit_factor(row, column, rotation) *
                           file.number(first++, "an entry of the information matrix");
      out(swapped(row), swapped(column)) = out(swapped(column), swapped(row)) = value;
    }
  return out;
}

void require_fields(const TextFile& file, std::size_t count) {
  if (file.fields().size() != count)
    file.fail(std::string(file.fields()[0]) + " has " + std::to_string(file.fields().size() - 1) +
              " values, expected " + std::to_string(count - 1));
}

[[noreturn]] void fail(const std::string& path, std::size_t line, const std::string& reason) {
  throw IoError(path + ":" + std::to_string(line) + ": " + reason);
}

}  // namespace

Graph read_g2o(const std::string& path, G2oRotation rotation) {
  TextFile file(path, '#');
  Graph graph;
  std::unordered_map<std::int64_t, std::size_t> places;
  std::vector<std::pair<std::int64_t, std::size_t>> fixed;
  std::vector<std::size_t> edge_lines;
  while (file.next()) {
    const std::string_view tag = file.fields()[0];
    if (tag == "VERTEX_SE3:QUAT") {
      require_fields(file, kVertexFields);
      Node node;
      node.id = file.index(1, "the id");
      node.world_from_node = read_pose(file, 2);
      if (!places.emplace(node.id, graph.nodes.size()).second)
        file.fail("node " + std::to_string(node.id) + " stands twice");
      graph.nodes.push_back(node);
    } else if (tag == "EDGE_SE3:QUAT") {
      require_fields(file, kEdgeFields);
      Edge edge;
      // g2o measures j in the frame of i.
      edge.target = file.index(1, "the first id");
      edge.source = file.index(2, "the second id");
      if (edge.source == edge.target)
        file.fail("an edge connects node " + std::to_string(edge.source) + " with itself");
      edge.target_from_source = read_pose(file, 3);
      edge.information = read_information(file, 10, rotation);
      edge.kind = std::abs(edge.source - edge.target) == 1 ? EdgeKind::odometry : EdgeKind::loop;
      check_information(*edge.information, [&](const std::string& reason) { file.fail(reason); });
      graph.edges.push_back(edge);
      edge_lines.push_back(file.line());
    } else if (tag == "FIX") {
      if (file.fields().size() < 2) file.fail("FIX has no id");
      for (std::size_t k = 1; k < file.fields().size(); ++k)
        fixed.emplace_back(file.index(k, "the id"), file.line());
    } else {
      file.fail("the tag is " + files::in_quotes(tag) +
                ", expected VERTEX_SE3:QUAT, EDGE_SE3:QUAT or FIX");
    }
  }
  for (const auto& [id, line] : fixed) {
    const auto at = places.find(id);
    if (at == places.end())
      fail(path, line, "FIX of node " + std::to_string(id) + ", which has no VERTEX_SE3:QUAT");
    graph.nodes[at->second].fixed = true;
  }
  for (std::size_t k = 0; k < graph.edges.size(); ++k)
    for (const std::int64_t id : {graph.edges[k].target, graph.edges[k].source})
      if (places.find(id) == places.end())
        fail(path, edge_lines[k],
             "an edge of node " + std::to_string(id) + ", which has no VERTEX_SE3:QUAT");
  return graph;
}

namespace {

void append(std::string& text, double value) {
  char buffer[40];
  // The shortest text that reads back as the same number.
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  text += ' ';
  text.append(buffer, end);
}

void append_pose(std::string& text, const UnalignedIsometry3d& pose) {
  const Eigen::Matrix3d rotation = pose.linear();
  const Eigen::Quaterniond q = Eigen::Quaterniond(rotation).normalized();
  for (int k = 0; k < 3; ++k) append(text, pose.translation()[k]);
  for (int k = 0; k < 4; ++k) append(text, q.coeffs()[k]);
}

}  // namespace

void write_g2o(const std::string& path, const Graph& graph, const Result* result,
               G2oRotation rotation) {
  const WrittenGraph written(graph, result, "g2o");
  std::string text;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const std::int64_t id = graph.nodes[k].id;
    if (id < 0 || id > std::numeric_limits<int>::max())
      throw InvalidArgument("nodes[" + std::to_string(k) + "].id is " + std::to_string(id) +
                            ", expected 0 to 2147483647 in a g2o file");
    text += "VERTEX_SE3:QUAT " + std::to_string(id);
    append_pose(text, written.poses[k]);
    text += '\n';
  }
  for (const Node& node : graph.nodes)
    if (node.fixed) text += "FIX " + std::to_string(node.id) + '\n';
  for (const WrittenEdge& edge : written.edges) {
    text += "EDGE_SE3:QUAT " + std::to_string(edge.target) + ' ' + std::to_string(edge.source);
    append_pose(text, edge.target_from_source);
    for (int row = 0; row < 6; ++row)
      for (int column = row; column < 6; ++column)
        append(text, edge.information(swapped(row), swapped(column)) /
                         unit_factor(row, column, rotation));
    text += '\n';
  }
  files::write_atomically(path, text);
}

}  // namespace gpureg::pose_graph
