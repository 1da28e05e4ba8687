// SPDX-License-Identifier: BSD-3-Clause
#include "cloud.hpp"
#include "gpureg/registration.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

/// One cloud as the face hands it over: (points, normals, features, viewpoints, origin); the last
/// four may be None. Views into the arrays, which the caller's tuple keeps alive.
struct Input {
  PointCloudView view;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();

  explicit Input(const py::tuple& parts) {
    if (parts.size() != 5) throw py::type_error("a cloud is a tuple of five");
    const Rows points = rows_of(parts[0].cast<FloatArray>(), "points");
    view.points = points.data;
    view.size = points.count;
    view.point_stride = points.stride;
    if (!parts[1].is_none()) {
      const Rows normals = rows_of(parts[1].cast<FloatArray>(), "normals");
      view.normals = normals.data;
      view.normal_stride = normals.stride;
    }
    if (!parts[2].is_none()) {
      const auto array = parts[2].cast<FloatArray>();
      const Rows features = rows_of(array, "features");
      view.features = features.data;
      view.feature_stride = features.stride;
      // An empty cloud has no pointer to features, and needs none.
      view.feature_dimension = features.data ? static_cast<std::size_t>(array.shape(1)) : 0;
      if (!features.data) view.feature_stride = 0;
    }
    if (!parts[3].is_none()) {
      const Rows viewpoints = rows_of(parts[3].cast<FloatArray>(), "viewpoints");
      if (viewpoints.count > 0 && viewpoints.stride != 3)
        throw py::type_error("viewpoints: rows are not side by side");
      view.viewpoints = viewpoints.data;
      view.viewpoint_count = viewpoints.count;
    }
    if (!parts[4].is_none())
      origin = matrix_of<Eigen::Vector3d>(parts[4].cast<py::array_t<double>>(), "origin");
  }
};

std::vector<Cloud> prepare_clouds(const Context& context, const py::list& clouds,
                                  const PrepareOptions& options) {
  std::vector<Input> inputs;
  std::vector<PointCloudView> views;
  for (const py::handle cloud : clouds) {
    inputs.emplace_back(cloud.cast<py::tuple>());
    views.push_back(inputs.back().view);
  }
  const py::gil_scoped_release release;
  std::vector<PreparedCloud> prepared = prepare_batch(context, views, options);
  std::vector<Cloud> out;
  out.reserve(prepared.size());
  for (std::size_t k = 0; k < prepared.size(); ++k)
    out.push_back({std::move(prepared[k]), inputs[k].origin});
  return out;
}

}  // namespace

void bind_prepare(py::module_& m) {
  m.def(
      "prepare_batch",
      [](const Context& context, const py::list& clouds, const PrepareOptions& options) {
        std::vector<Cloud> prepared = prepare_clouds(context, clouds, options);
        py::list out;
        for (Cloud& cloud : prepared) out.append(py::cast(std::move(cloud)));
        return out;
      },
      py::arg("context"), py::arg("clouds"), py::arg("options"));
}

}  // namespace gpureg::python
