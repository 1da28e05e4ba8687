// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>

#include "gpureg/error.hpp"
#include "json/json.hpp"

/// Members of JSON objects, checked. All throw InvalidArgument that names the member and its value.
namespace gpureg::cli {

/// The value at a JSON pointer, strings without quotes; empty if there is none. Throws nothing.
std::string text_of(const Json& json, const char* pointer);

const Json& member(const Json& object, const char* name);

std::string text_member(const Json& object, const char* name);

/// The number of a fragment, from 0.
int fragment_member(const Json& object, const char* name);

/// A finite number.
double finite_number(const Json& value, const char* name);

/// A number; NaN and infinity are null in JSON.
double number_or_nan(const Json& value, const char* name);

/// A square matrix, row by row.
template <int Size>
Eigen::Matrix<double, Size, Size> square_matrix(const Json& array, const char* name) {
  if (!array.is_array() || array.size() != Size * Size)
    throw InvalidArgument(std::string("\"") + name + "\" is not an array of " +
                          std::to_string(Size * Size) + " numbers");
  Eigen::Matrix<double, Size, Size> matrix;
  for (int k = 0; k < Size * Size; ++k)
    matrix(k / Size, k % Size) = finite_number(array[static_cast<std::size_t>(k)], name);
  return matrix;
}

/// A pose, row by row.
Eigen::Matrix4d rigid_motion(const Json& array, const char* name);

}  // namespace gpureg::cli
