// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <future>
#include <iterator>

#include "cloud.hpp"
#include "gpureg/cuda_interop.hpp"
#include "gpureg/registration.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

/// One cloud as the package hands it over: (points, normals, features, viewpoints, origin,
/// streams); all but the points may be None, and viewpoints False: unknown, not to be inferred.
/// Points, normals and features are float32 arrays, or,
/// where there are streams, (address, rows, columns, stride, owner) of device memory; the streams
/// are those that wrote points, normals and features. The caller's tuple keeps alive what the views
/// point at.
struct Input {
  PointCloudView view;
  bool on_device = false;
  CudaStream streams[3] = {};

  explicit Input(const py::tuple& parts) {
    if (parts.size() != 6) throw py::type_error("a cloud is a tuple of six");
    if (!parts[5].is_none()) {
      on_device = true;
      const auto given = parts[5].cast<std::array<std::uintptr_t, 3>>();
      for (std::size_t k = 0; k < given.size(); ++k)
        streams[k] = reinterpret_cast<CudaStream>(given[k]);
    }
    const Rows points = rows(parts[0], "points");
    view.points = points.data;
    view.size = points.count;
    view.point_stride = points.stride;
    if (!parts[1].is_none()) {
      const Rows normals = rows(parts[1], "normals");
      view.normals = normals.data;
      view.normal_stride = normals.stride;
    }
    if (!parts[2].is_none()) {
      const Rows features = rows(parts[2], "features");
      view.features = features.data;
      // An empty cloud has no pointer to features, and needs none.
      view.feature_stride = features.data ? features.stride : 0;
      view.feature_dimension = features.data ? features.columns : 0;
    }
    if (parts[3].ptr() == Py_False) {
      view.infer_viewpoint = false;
    } else if (parts[3].ptr() == Py_True) {
      view.model = true;
    } else if (!parts[3].is_none()) {
      const Rows viewpoints = rows_of(parts[3].cast<FloatArray>(), "viewpoints");
      if (viewpoints.count > 0 && viewpoints.stride != 3)
        throw py::type_error("viewpoints: rows are not side by side");
      view.viewpoints = viewpoints.data;
      view.viewpoint_count = viewpoints.count;
    }
    if (!parts[4].is_none()) {
      const auto origin =
          matrix_of<Eigen::Vector3d>(parts[4].cast<py::array_t<double>>(), "origin");
      for (int k = 0; k < 3; ++k) view.origin[k] = origin[k];
    }
  }

  Rows rows(const py::object& part, const char* name) const {
    if (!on_device) return rows_of(part.cast<FloatArray>(), name);
    const auto parts = part.cast<py::tuple>();
    const auto count = parts[1].cast<std::size_t>();
    return {count ? reinterpret_cast<const float*>(parts[0].cast<std::uintptr_t>()) : nullptr,
            count, parts[2].cast<std::size_t>(), parts[3].cast<std::size_t>()};
  }

  DevicePointCloudView device_view() const {
    DevicePointCloudView v;
    v.points = view.points;
    v.size = view.size;
    v.point_stride = view.point_stride;
    v.normals = view.normals;
    v.normal_stride = view.normal_stride;
    v.features = view.features;
    v.feature_dimension = view.feature_dimension;
    v.feature_stride = view.feature_stride;
    v.viewpoints = view.viewpoints;
    v.viewpoint_count = view.viewpoint_count;
    v.infer_viewpoint = view.infer_viewpoint;
    v.model = view.model;
    std::copy(std::begin(view.origin), std::end(view.origin), v.origin);
    v.normal_stream = streams[1];
    v.feature_stream = streams[2];
    return v;
  }
};

/// Clouds of the host whose viewpoints cannot be what they were seen from: says so, as nothing else
/// would.
void warn_of_viewpoints(const std::vector<Input>& inputs, const std::vector<std::string>& names) {
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    if (inputs[k].on_device) continue;
    const double share = inputs[k].view.share_facing_away();
    if (share <= PointCloudView::kMaxFacingAway) continue;
    char percent[16];
    std::snprintf(percent, sizeof(percent), "%.1f %%", 100 * share);
    const std::string text = (names.empty() ? "" : names[k] + ": ") + "viewpoints: " + percent +
                             " of the normals show all of them their back: are they in the frame "
                             "of the cloud, and do the normals point to where it was seen from?";
    if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 2) != 0) throw py::error_already_set();
  }
}

/// Raw points and clouds on a device that are copied at a time: copies of all clouds of a long list
/// would take as much memory as the clouds.
constexpr std::size_t kDevicePoints = std::size_t(1) << 25, kDeviceClouds = 256;

/// Prepares clouds that are on a device.
std::vector<PreparedCloud> prepare_on_device(const Context& context,
                                             const std::vector<const Input*>& inputs,
                                             const PrepareOptions& options,
                                             const std::vector<std::string>& names) {
  std::vector<PreparedCloud> out;
  for (std::size_t begin = 0, end; begin < inputs.size(); begin = end) {
    std::vector<DevicePointCloudView> views;
    std::vector<CudaStream> streams;
    std::vector<std::string> some_names;
    std::size_t points = 0;
    for (end = begin; end < inputs.size() && end - begin < kDeviceClouds &&
                      (end == begin || points + inputs[end]->view.size <= kDevicePoints);
         ++end) {
      points += inputs[end]->view.size;
      views.push_back(inputs[end]->device_view());
      streams.push_back(inputs[end]->streams[0]);
      if (!names.empty()) some_names.push_back(names[end]);
    }
    for (PreparedCloud& cloud :
         prepare_batch_async(context, views, options, streams, some_names).get())
      out.push_back(std::move(cloud));
  }
  return out;
}

/// Clouds on a device in batches, those of the host as one batch.
std::vector<Cloud> prepare_clouds(const Context& context, const std::vector<Input>& inputs,
                                  const PrepareOptions& options,
                                  const std::vector<std::string>& names) {
  std::vector<PointCloudView> views;
  std::vector<const Input*> device_inputs;
  std::vector<std::string> view_names, device_names;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    if (inputs[k].on_device)
      device_inputs.push_back(&inputs[k]);
    else
      views.push_back(inputs[k].view);
    if (!names.empty()) (inputs[k].on_device ? device_names : view_names).push_back(names[k]);
  }
  std::vector<PreparedCloud> on_device =
                                 prepare_on_device(context, device_inputs, options, device_names),
                             hosted = prepare_batch(context, views, options, view_names);
  std::vector<Cloud> out;
  std::size_t next[2] = {0, 0};
  for (const Input& input : inputs)
    out.push_back({std::move(input.on_device ? on_device[next[1]++] : hosted[next[0]++])});
  return out;
}

}  // namespace

void bind_prepare(py::module_& m) {
  m.def(
      "prepare_batch",
      [](const Context& context, const py::sequence& clouds, const PrepareOptions& options,
         const std::vector<std::string>& names) {
        std::vector<Input> inputs;
        for (const py::handle cloud : clouds) inputs.emplace_back(cloud.cast<py::tuple>());
        if (!names.empty() && names.size() != inputs.size())
          throw py::value_error("names: expected one for each cloud");
        if (options.depth_maps > 0) warn_of_viewpoints(inputs, names);
        std::vector<Cloud> prepared;
        {
          const py::gil_scoped_release release;
          prepared = prepare_clouds(context, inputs, options, names);
        }
        py::list out;
        for (Cloud& cloud : prepared) out.append(py::cast(std::move(cloud)));
        return out;
      },
      py::arg("context"), py::arg("clouds"), py::arg("options"),
      py::arg("names") = std::vector<std::string>());
}

}  // namespace gpureg::python
