// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <iterator>

#include "cloud.hpp"
#include "gpureg/cuda_interop.hpp"
#include "matrix.hpp"

namespace gpureg::python {

/// One cloud as the package hands it over: (points, normals, features, viewpoints, origin,
/// streams); all but the points may be None, and viewpoints False: unknown, not to be inferred;
/// True: a model. Points, normals and features are float32 arrays, or, where there are streams,
/// (address, rows, columns, stride, owner) of device memory; the streams are those that wrote
/// points, normals and features. The caller's tuple keeps alive what the views point at.
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

}  // namespace gpureg::python
