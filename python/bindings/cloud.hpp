// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/numpy.h>

#include <Eigen/Core>

#include "bindings.hpp"
#include "gpureg/point_cloud.hpp"
#include "gpureg/prepared_cloud.hpp"
#include "gpureg/result.hpp"

namespace gpureg::python {

/// A PreparedCloud and the point of the caller's frame that its own frame has as origin. Not zero
/// only for float64 coordinates too large for float (a map's), which the package moves before it
/// casts.
struct Cloud {
  PreparedCloud prepared;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};

using FloatArray = py::array_t<float, 0>;

/// Rows of an array in place, its distance between rows in floats. Raises TypeError for an array
/// whose rows are not whole floats side by side: the package copies those.
struct Rows {
  const float* data;
  std::size_t count, columns, stride;
};
Rows rows_of(const FloatArray& array, const char* name);

/// What the clouds' origins mean for a result between them: into the caller's frames.
void move_to_origins(RegistrationResult& result, const Cloud& source, const Cloud& target);

}  // namespace gpureg::python
