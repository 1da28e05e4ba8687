// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "cloud.hpp"
#include "fields.hpp"
#include "gpureg/files.hpp"
#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "matrix.hpp"
#include "scans.hpp"

namespace gpureg::python {
namespace {

using DoubleRows = py::array_t<double, py::array::c_style | py::array::forcecast>;
using FaceRows = py::array_t<std::uint32_t, py::array::c_style | py::array::forcecast>;

std::vector<Eigen::Vector3f> vectors_of(const py::object& array, const char* name) {
  std::vector<Eigen::Vector3f> out;
  if (array.is_none()) return out;
  const Rows rows = rows_of(array.cast<FloatArray>(), name);
  for (std::size_t k = 0; k < rows.count; ++k) out.emplace_back(rows.data + k * rows.stride);
  return out;
}

/// A path may hold bytes that are no text.
py::str path_of(const std::string& path) {
  return py::reinterpret_steal<py::str>(
      PyUnicode_DecodeFSDefaultAndSize(path.data(), static_cast<py::ssize_t>(path.size())));
}

void warn(const std::string& path, const std::string& what) {
  if (!what.empty() && PyErr_WarnEx(PyExc_UserWarning, (path + ": " + what).c_str(), 2) != 0)
    throw py::error_already_set();
}

}  // namespace

void bind_files(py::module_& m) {
  using release = py::call_guard<py::gil_scoped_release>;
  py::class_<PointCloud>(m, "PointCloud", "A cloud as a file holds it.")
      .def(py::init([](const py::object& points, const py::object& normals,
                       const py::object& viewpoints) {
             // The package converts the arguments, and names those that it refuses.
             const py::tuple parts = py::module_::import("gpureg._arrays")
                                         .attr("stored_cloud")(points, normals, viewpoints);
             PointCloud cloud{vectors_of(parts[0], "points"), vectors_of(parts[1], "normals"),
                              vectors_of(parts[2], "viewpoints"), false};
             if (!parts[3].is_none())
               cloud.origin =
                   matrix_of<Eigen::Vector3d>(parts[3].cast<py::array_t<double>>(), "origin");
             return cloud;
           }),
           py::arg("points"), py::arg("normals") = py::none(), py::arg("viewpoints") = py::none())
      .def("__len__", [](const PointCloud& c) { return c.points.size(); })
      .def(
          "__array__",
          [](const py::object& self, const py::object& dtype, const py::object& copy) {
            return py::module_::import("gpureg._arrays").attr("points_as_array")(self, dtype, copy);
          },
          py::arg("dtype") = py::none(), py::arg("copy") = py::none(), "The points.")
      .def_property_readonly(
          "points", [](const PointCloud& c) { return in_frame(c.points, c.origin); },
          "(N, 3) copy, metres: float32, or float64 where float32 is too coarse, as for a map.")
      .def_property_readonly(
          "normals", [](const PointCloud& c) { return array_of(c.normals); },
          "(N, 3) float32 copy, or (0, 3) where not known.")
      .def_property_readonly(
          "viewpoints", [](const PointCloud& c) { return in_frame(c.viewpoints, c.origin); },
          "(V, 3) copy: sensor positions in the cloud's frame, of the type of the points.")
      .def_readonly("model", &PointCloud::model, "Sampled from a mesh, with normals outwards.")
      .def("__repr__", [](const PointCloud& c) {
        return "<gpureg.PointCloud, " + std::to_string(c.points.size()) + " points>";
      });
  py::class_<io::StoredScan>(m, "StoredScan", "A scan of a file that holds several.")
      .def_readonly("name", &io::StoredScan::name, "May be empty.")
      .def_readonly("points", &io::StoredScan::points,
                    "That the file announces; of PTX rows without a return are among them.")
      .def_property_readonly(
          "file_from_scan",
          [](const io::StoredScan& scan) -> py::object {
            if (!scan.file_from_scan) return py::none();
            return array_of(*scan.file_from_scan);
          },
          "(4, 4) pose of the scan in the frame of its file, metres; None where there is none.")
      .def("__repr__", [](const io::StoredScan& scan) {
        return "<gpureg.StoredScan " + py::repr(py::str(scan.name)).cast<std::string>() + ", " +
               std::to_string(scan.points) + " points>";
      });
  m.def(
      "read_point_cloud",
      [](const std::string& path, std::size_t part) {
        PointCloud cloud;
        std::string note;
        {
          const py::gil_scoped_release unlocked;
          cloud = io::read_point_cloud(path, part, &note);
        }
        warn(path, note);
        warn(path, io::coarse_coordinates(cloud));
        return cloud;
      },
      py::arg("path"), py::arg("part") = 0);
  m.def(
      "scans_in",
      [](const std::string& path) {
        const py::gil_scoped_release unlocked;
        return io::scans_in(path);
      },
      py::arg("path"));
  m.def(
      "scan_path",
      [](const std::string& path) {
        const io::ScanPath scan = io::scan_path(path);
        return std::make_pair(scan.file, scan.part);
      },
      py::arg("path"));
  m.def("is_mesh", &io::is_mesh, py::arg("path"), release());
  m.def(
      "sample_mesh_file",
      [](const std::string& path, double spacing) {
        const io::SurfaceMesh mesh = io::read_mesh(path);
        return std::make_pair(io::sample_mesh(mesh, spacing), mesh.notes());
      },
      py::arg("path"), py::arg("spacing"), release());
  m.def(
      "sample_mesh",
      [](const DoubleRows& vertices, const FaceRows& faces, double spacing) {
        // The package checks the shapes.
        std::vector<Eigen::Vector3d> points;
        for (py::ssize_t k = 0; k < vertices.shape(0); ++k)
          points.emplace_back(vertices.at(k, 0), vertices.at(k, 1), vertices.at(k, 2));
        std::vector<std::array<std::uint32_t, 3>> triangles;
        for (py::ssize_t k = 0; k < faces.shape(0); ++k)
          triangles.push_back({faces.at(k, 0), faces.at(k, 1), faces.at(k, 2)});
        const py::gil_scoped_release unlocked;
        const io::SurfaceMesh mesh = io::make_mesh(std::move(points), std::move(triangles));
        return std::make_pair(io::sample_mesh(mesh, spacing), mesh.notes());
      },
      py::arg("vertices"), py::arg("faces"), py::arg("spacing"));
  m.def("write_point_cloud", &io::write_point_cloud, py::arg("path"), py::arg("cloud"), release());
  m.def(
      "list_scans",
      [](const std::string& path, bool recursive) {
        std::vector<std::string> notes;
        std::vector<io::ScanFile> scans;
        {
          const py::gil_scoped_release unlocked;
          scans = io::list_scans(path, recursive, &notes);
        }
        py::list out;
        for (const io::ScanFile& scan : scans)
          out.append(py::make_tuple(scan.number, path_of(scan.path), scan.name));
        return py::make_tuple(out, notes);
      },
      py::arg("path"), py::arg("recursive"));
  m.def("names_scans", &io::names_scans, py::arg("path"), release());
  m.def(
      "folder_of_scans", [](const std::string& path) { return path_of(io::folder_of_scans(path)); },
      py::arg("path"));
  m.def(
      "find_scan",
      [](const std::vector<int>& numbers, const std::vector<std::string>& names,
         const std::string& word) { return io::find_scan(scans_of(numbers, names), word); },
      py::arg("numbers"), py::arg("names"), py::arg("word"));
  m.def(
      "read_cameras",
      [](const std::string& path, const std::vector<int>& numbers,
         const std::vector<std::string>& names) {
        py::dict out;
        for (const auto& [number, positions] : io::read_cameras(path, scans_of(numbers, names))) {
          Eigen::Matrix<double, Eigen::Dynamic, 3> rows(positions.size(), 3);
          for (std::size_t k = 0; k < positions.size(); ++k)
            rows.row(static_cast<Eigen::Index>(k)) = positions[k].transpose();
          out[py::int_(number)] = array_of(rows);
        }
        return out;
      },
      py::arg("path"), py::arg("numbers"), py::arg("names"));
  m.def(
      "write_text",
      [](const std::string& path, const std::string& content) {
        files::write_atomically(path, content);
      },
      py::arg("path"), py::arg("content"), release());
}

}  // namespace gpureg::python
