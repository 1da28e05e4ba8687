// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/numpy.h>

#include <Eigen/Core>

#include "bindings.hpp"
#include "gpureg/point_cloud.hpp"
#include "gpureg/prepared_cloud.hpp"
#include "gpureg/result.hpp"

namespace gpureg::python {

/// What Python calls a PreparedCloud.
struct Cloud {
  PreparedCloud prepared;
};

using FloatArray = py::array_t<float, 0>;

/// Rows of an array in place, its distance between rows in floats. Raises TypeError for an array
/// whose rows are not whole floats side by side: the package copies those.
struct Rows {
  const float* data;
  std::size_t count, columns, stride;
};
Rows rows_of(const FloatArray& array, const char* name);

}  // namespace gpureg::python
