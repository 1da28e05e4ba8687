// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace gpureg {

/// A model, a cloud with normals alone, and one that is said to have no known viewpoint are in no
/// frame of a sensor.
template <typename Known>
bool has_sensor_frame(const Known& cloud) {
  return !cloud.model && (cloud.viewpoints || (cloud.infer_viewpoint && !cloud.normals));
}

}  // namespace gpureg
