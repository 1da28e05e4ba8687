// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/types.hpp"

namespace gpureg {

/// Converts a view of host or device memory for the engines. Throws as View::validate() does.
template <typename View>
RawCloud raw_cloud(const View& view) {
  view.validate();
  RawCloud raw{};
  raw.points = view.points;
  raw.size = view.size;
  raw.point_stride = view.point_stride;
  raw.normals = view.normals;
  raw.normal_stride = view.normal_stride;
  raw.features = view.features;
  raw.feature_dimension = view.feature_dimension;
  raw.feature_stride = view.feature_stride ? view.feature_stride : view.feature_dimension;
  raw.viewpoints = view.viewpoints;
  raw.viewpoint_count = view.viewpoint_count;
  return raw;
}

}  // namespace gpureg
