// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/prepared_state.hpp"

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

/// The origin of a cloud's frame, relative to its rows.
struct FrameOrigin {
  float row[3];
};

/// Without viewpoints and normals a cloud counts as seen from the origin of its frame. storage must
/// outlive raw.
inline void view_from_frame_origin(const double (&origin)[3], FrameOrigin& storage, RawCloud& raw) {
  const bool at_rows = origin[0] == 0 && origin[1] == 0 && origin[2] == 0;
  if (at_rows || raw.viewpoint_count > 0 || raw.normals) return;
  for (int k = 0; k < 3; ++k) storage.row[k] = static_cast<float>(-origin[k]);
  raw.viewpoints = storage.row;
  raw.viewpoint_count = 1;
}

inline void set_frame_offset(const double (&origin)[3], PreparedState& state) {
  for (int k = 0; k < 3; ++k) state.frame_offset[k] = origin[k];
}

}  // namespace gpureg
