// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/pose_graph.hpp"

#include <pybind11/stl.h>

#include <algorithm>

#include "bindings.hpp"
#include "gpureg/error.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

using namespace pose_graph;
using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

UnalignedIsometry3d pose_of(py::handle value, const char* name) {
  UnalignedIsometry3d pose;
  pose.matrix() = matrix_of<Eigen::Matrix4d>(value.cast<DoubleArray>(), name);
  return pose;
}

std::optional<UnalignedMatrix6d> information_of(py::handle value, const char* name) {
  if (value.is_none()) return std::nullopt;
  return UnalignedMatrix6d(matrix_of<Eigen::Matrix<double, 6, 6>>(value.cast<DoubleArray>(), name));
}

EdgeKind kind_of(const std::string& text) {
  if (text == "odometry") return EdgeKind::odometry;
  if (text == "loop") return EdgeKind::loop;
  throw InvalidArgument("kind is '" + text + "', expected 'odometry' or 'loop'");
}

Robust robust_of(const std::string& text) {
  if (text == "none") return Robust::none;
  if (text == "gnc") return Robust::gnc;
  if (text == "line_process") return Robust::line_process;
  throw InvalidArgument("robust is '" + text + "', expected 'none', 'gnc' or 'line_process'");
}

py::array_t<double> poses_array(const std::vector<UnalignedIsometry3d>& poses) {
  py::array_t<double> out({static_cast<py::ssize_t>(poses.size()), py::ssize_t(4), py::ssize_t(4)});
  double* next = out.mutable_data();
  for (const UnalignedIsometry3d& pose : poses)
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) *next++ = pose.matrix()(row, column);
  return out;
}

template <typename T, typename Get>
py::array_t<T> edge_array(const Result& result, const Get& get) {
  py::array_t<T> out(static_cast<py::ssize_t>(result.edges.size()));
  std::transform(result.edges.begin(), result.edges.end(), out.mutable_data(), get);
  return out;
}

void bind_graph(py::module_& m) {
  py::class_<Graph>(m, "PoseGraph", "A pose graph.")
      .def(py::init<>())
      .def_property_readonly("node_count", [](const Graph& g) { return g.nodes.size(); })
      .def_property_readonly("edge_count", [](const Graph& g) { return g.edges.size(); })
      .def(
          "add_node",
          [](Graph& g, std::int64_t id, const py::object& pose, bool fixed) {
            Node node;
            node.id = id;
            if (!pose.is_none()) node.world_from_node = pose_of(pose, "world_from_node");
            node.fixed = fixed;
            g.nodes.push_back(node);
          },
          py::arg("id"), py::arg("world_from_node"), py::arg("fixed"))
      .def(
          "add_edge",
          [](Graph& g, std::int64_t source, std::int64_t target, const DoubleArray& pose,
             const py::object& information, const std::string& kind, double confidence) {
            Edge edge;
            edge.source = source;
            edge.target = target;
            edge.target_from_source = pose_of(pose, "target_from_source");
            edge.information = information_of(information, "information");
            edge.kind = kind_of(kind);
            edge.confidence = confidence;
            g.edges.push_back(edge);
            return g.edges.size() - 1;
          },
          py::arg("source"), py::arg("target"), py::arg("target_from_source"),
          py::arg("information"), py::arg("kind"), py::arg("confidence"))
      .def(
          "add_mode",
          [](Graph& g, std::size_t edge, const DoubleArray& pose, const py::object& information,
             double confidence) {
            if (edge >= g.edges.size())
              throw InvalidArgument("edge is " + std::to_string(edge) + ", but the graph has " +
                                    std::to_string(g.edges.size()) + " edges");
            EdgeMode mode;
            mode.target_from_source = pose_of(pose, "target_from_source");
            mode.information = information_of(information, "information");
            mode.confidence = confidence;
            g.edges[edge].alternatives.push_back(mode);
          },
          py::arg("edge"), py::arg("target_from_source"), py::arg("information"),
          py::arg("confidence"))
      .def(
          "add_gravity",
          [](Graph& g, std::int64_t node, const DoubleArray& up, double sigma_degrees) {
            g.gravity.push_back({node, matrix_of<Eigen::Vector3d>(up, "up"), sigma_degrees});
          },
          py::arg("node"), py::arg("up"), py::arg("sigma_degrees"))
      .def(
          "add_prior",
          [](Graph& g, std::int64_t node, const DoubleArray& pose, const DoubleArray& information) {
            g.priors.push_back({node, pose_of(pose, "world_from_node"),
                                *information_of(information, "information")});
          },
          py::arg("node"), py::arg("world_from_node"), py::arg("information"))
      .def("validate", &Graph::validate)
      .def("__repr__", [](const Graph& g) {
        return "<gpureg.pose_graph.PoseGraph of " + std::to_string(g.nodes.size()) + " nodes and " +
               std::to_string(g.edges.size()) + " edges>";
      });
}

void bind_pose_graph_result(py::module_& m) {
  py::class_<Result>(m, "PoseGraphResult", "Poses and edge states of an optimised graph.")
      .def_property_readonly("status", [](const Result& r) { return to_string(r.status); })
      .def_readonly("reason", &Result::reason)
      .def_property_readonly("converged", &Result::converged)
      .def_property_readonly("world_from_node",
                             [](const Result& r) { return poses_array(r.world_from_node); })
      .def_property_readonly("accepted",
                             [](const Result& r) {
                               return edge_array<bool>(r, [](const EdgeResult& e) {
                                 return e.state == EdgeState::accepted;
                               });
                             })
      .def_property_readonly("weights",
                             [](const Result& r) {
                               return edge_array<double>(
                                   r, [](const EdgeResult& e) { return e.weight; });
                             })
      .def_property_readonly("modes",
                             [](const Result& r) {
                               return edge_array<std::int64_t>(
                                   r, [](const EdgeResult& e) { return std::int64_t(e.mode); });
                             })
      .def_property_readonly("squared_errors",
                             [](const Result& r) {
                               return edge_array<double>(
                                   r, [](const EdgeResult& e) { return e.squared_error; });
                             })
      .def_property_readonly("components",
                             [](const Result& r) {
                               std::vector<std::vector<std::int64_t>> out;
                               for (const Component& c : r.components) out.push_back(c.nodes);
                               return out;
                             })
      .def_readonly("iterations", &Result::iterations)
      .def_readonly("initial_cost", &Result::initial_cost)
      .def_readonly("final_cost", &Result::final_cost)
      .def("__repr__", [](const Result& r) {
        return std::string("<gpureg.pose_graph.PoseGraphResult ") + to_string(r.status) + ">";
      });
}

}  // namespace

void bind_pose_graph(py::module_& m) {
  bind_graph(m);
  bind_pose_graph_result(m);
  m.def(
      "optimize_pose_graph",
      [](const Graph graph, const std::string& robust, bool loopsmart, int threads) {
        Options options = loopsmart ? Options::loopsmart() : Options{};
        if (!loopsmart) options.robust = robust_of(robust);
        options.threads = threads;
        const py::gil_scoped_release release;
        return optimize(graph, options);
      },
      py::arg("graph"), py::arg("robust"), py::arg("loopsmart"), py::arg("threads"));
  const auto rotation = [](bool radians) {
    return radians ? G2oRotation::angle : G2oRotation::quaternion_vector;
  };
  m.def(
      "read_g2o",
      [rotation](const std::string& path, bool radians) {
        return read_g2o(path, rotation(radians));
      },
      py::arg("path"), py::arg("radians"));
  m.def(
      "write_g2o",
      [rotation](const std::string& path, const Graph& graph, const Result* result, bool radians) {
        write_g2o(path, graph, result, rotation(radians));
      },
      py::arg("path"), py::arg("graph"), py::arg("result").none(true), py::arg("radians"));
  m.def("read_open3d_pose_graph", &read_open3d, py::arg("path"));
  m.def("write_open3d_pose_graph", &write_open3d, py::arg("path"), py::arg("graph"),
        py::arg("result").none(true));
}

}  // namespace gpureg::python
