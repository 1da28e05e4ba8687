// SPDX-License-Identifier: BSD-3-Clause
#include "cloud.hpp"

#include "fields.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

py::array_t<float> features_of(const Cloud& cloud) {
  const std::vector<float> features = cloud.prepared.features();
  py::array_t<float> out({static_cast<py::ssize_t>(cloud.prepared.size()),
                          static_cast<py::ssize_t>(cloud.prepared.feature_dimension())});
  std::copy(features.begin(), features.end(), out.mutable_data());
  return out;
}

}  // namespace

Rows rows_of(const FloatArray& array, const char* name) {
  const auto refuse = [&](const std::string& what) {
    throw py::type_error(std::string(name) + ": " + what);
  };
  if (array.ndim() != 2) refuse("not a matrix");
  const auto count = static_cast<std::size_t>(array.shape(0));
  const auto columns = static_cast<std::size_t>(array.shape(1));
  if (count == 0) return {nullptr, 0, columns, columns};
  constexpr py::ssize_t size = sizeof(float);
  if (columns > 1 && array.strides(1) != size) refuse("a row's numbers are not side by side");
  if (reinterpret_cast<std::uintptr_t>(array.data()) % alignof(float) != 0) refuse("not aligned");
  if (count == 1) return {array.data(), 1, columns, columns};
  if (array.strides(0) % size != 0 || array.strides(0) < size * static_cast<py::ssize_t>(columns))
    refuse("rows overlap or lie at parts of floats");
  return {array.data(), count, columns, static_cast<std::size_t>(array.strides(0) / size)};
}

void bind_cloud(py::module_& m) {
  py::class_<Cloud>(m, "PreparedCloud",
                    "A fragment ready for alignment, in the memory of the context that made it. "
                    "Immutable; threads may share it.")
      .def("__len__", [](const Cloud& c) { return c.prepared.size(); })
      .def_property_readonly(
          "feature_dimension", [](const Cloud& c) { return c.prepared.feature_dimension(); },
          "33 for FPFH.")
      .def_property_readonly(
          "statistics", [](const Cloud& c) { return c.prepared.statistics(); },
          "Counts and times of the preparation.")
      .def_property_readonly(
          "voxel_size", [](const Cloud& c) { return shortest(c.prepared.voxel_size()); },
          "What it was prepared with.")
      .def_property_readonly(
          "origin", [](const Cloud& c) { return array_of(c.prepared.origin()); },
          "(3,) float64: taken off the coordinates before they became float32.")
      .def_property_readonly(
          "points",
          [](const Cloud& c) { return in_frame(c.prepared.points(), c.prepared.origin()); },
          "(N, 3) copy on the host, metres: float32, or float64 where origin is not zero.")
      .def_property_readonly(
          "normals", [](const Cloud& c) { return array_of(c.prepared.normals()); },
          "(N, 3) float32 copy on the host: unit length, or zeros where unknown.")
      .def_property_readonly("features", &features_of,
                             "(N, feature_dimension) float32 copy on the host.")
      .def_property_readonly(
          "viewpoints",
          [](const Cloud& c) { return in_frame(c.prepared.viewpoints(), c.prepared.origin()); },
          "(V, 3) sensor positions, V >= 1.")
      .def("__repr__", [](const Cloud& c) {
        return "<gpureg.PreparedCloud, " + std::to_string(c.prepared.size()) + " points of " +
               std::to_string(c.prepared.statistics().input_points) + ", voxel size " +
               py::repr(py::float_(shortest(c.prepared.voxel_size()))).cast<std::string>() + ">";
      });
}

}  // namespace gpureg::python
