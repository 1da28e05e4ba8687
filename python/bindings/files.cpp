// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>

#include "fields.hpp"
#include "gpureg/io.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

using Float3Array = py::array_t<float, py::array::c_style | py::array::forcecast>;

std::vector<Eigen::Vector3f> vectors_of(const std::optional<Float3Array>& array, const char* name) {
  std::vector<Eigen::Vector3f> out;
  if (!array) return out;
  if (array->ndim() != 2 || array->shape(1) != 3)
    throw py::value_error(std::string(name) + ": expected shape (N, 3), got " +
                          py::str(array->attr("shape")).cast<std::string>());
  for (py::ssize_t k = 0; k < array->shape(0); ++k)
    out.emplace_back(array->data()[3 * k], array->data()[3 * k + 1], array->data()[3 * k + 2]);
  return out;
}

}  // namespace

void bind_files(py::module_& m) {
  using release = py::call_guard<py::gil_scoped_release>;
  py::class_<PointCloud>(m, "PointCloud", "A cloud as a file holds it.")
      .def(py::init([](const Float3Array& points, const std::optional<Float3Array>& normals,
                       const std::optional<Float3Array>& viewpoints) {
             return PointCloud{vectors_of(points, "points"), vectors_of(normals, "normals"),
                               vectors_of(viewpoints, "viewpoints")};
           }),
           py::arg("points"), py::arg("normals") = py::none(), py::arg("viewpoints") = py::none())
      .def("__len__", [](const PointCloud& c) { return c.points.size(); })
      .def_property_readonly(
          "points", [](const PointCloud& c) { return array_of(c.points); },
          "(N, 3) float32 copy, metres.")
      .def_property_readonly(
          "normals", [](const PointCloud& c) { return array_of(c.normals); },
          "(N, 3) float32 copy, or (0, 3) where not known.")
      .def_property_readonly(
          "viewpoints", [](const PointCloud& c) { return array_of(c.viewpoints); },
          "(V, 3) float32 copy: sensor positions in the cloud's frame.")
      .def("__repr__", [](const PointCloud& c) {
        return "<gpureg.PointCloud, " + std::to_string(c.points.size()) + " points>";
      });
  m.def("read_point_cloud", &io::read_point_cloud, py::arg("path"), release());
  m.def("write_point_cloud", &io::write_point_cloud, py::arg("path"), py::arg("cloud"), release());
  m.def("list_fragments", &io::list_fragments, py::arg("folder"), release());
  m.def(
      "read_cameras",
      [](const std::string& path) {
        py::dict out;
        for (const auto& [number, positions] : io::read_cameras(path))
          out[py::int_(number)] = array_of(positions);
        return out;
      },
      py::arg("path"));
  m.def("read_pairs", &io::read_pairs, py::arg("path"), release());
}

}  // namespace gpureg::python
