// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/numpy.h>

#include <Eigen/Core>
#include <vector>

#include "bindings.hpp"
#include "gpureg/result.hpp"

namespace gpureg::python {

/// A new C-ordered float64 array with the numbers of an Eigen matrix; vectors become
/// one-dimensional.
template <typename Derived>
py::array_t<double> array_of(const Eigen::MatrixBase<Derived>& matrix) {
  constexpr bool vector = Derived::ColsAtCompileTime == 1;
  std::vector<py::ssize_t> shape{matrix.rows()};
  if (!vector) shape.push_back(matrix.cols());
  py::array_t<double> out(shape);
  double* next = out.mutable_data();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) *next++ = matrix(row, column);
  return out;
}

/// Takes only what has exactly that shape. Raises InvalidArgument.
template <typename Matrix>
Matrix matrix_of(const py::array_t<double, py::array::c_style | py::array::forcecast>& array,
                 const char* name) {
  constexpr int rows = Matrix::RowsAtCompileTime, columns = Matrix::ColsAtCompileTime;
  const bool fits = columns == 1
                        ? array.ndim() == 1 && array.shape(0) == rows
                        : array.ndim() == 2 && array.shape(0) == rows && array.shape(1) == columns;
  if (!fits)
    throw py::value_error(std::string(name) + ": expected shape (" + std::to_string(rows) +
                          (columns == 1 ? ",)" : ", " + std::to_string(columns) + ")") + ", got " +
                          py::str(array.attr("shape")).cast<std::string>());
  Matrix out;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      out(row, column) = array.data()[row * columns + column];
  return out;
}

/// Rows of three floats as a new (N, 3) float32 array.
inline py::array_t<float> array_of(const std::vector<Eigen::Vector3f>& rows) {
  py::array_t<float> out({static_cast<py::ssize_t>(rows.size()), py::ssize_t(3)});
  float* next = out.mutable_data();
  for (const Eigen::Vector3f& row : rows)
    for (int k = 0; k < 3; ++k) *next++ = row[k];
  return out;
}

/// (N, 4, 4)
inline py::array_t<double> poses_array(const std::vector<UnalignedIsometry3d>& poses) {
  py::array_t<double> out({static_cast<py::ssize_t>(poses.size()), py::ssize_t(4), py::ssize_t(4)});
  double* next = out.mutable_data();
  for (const UnalignedIsometry3d& pose : poses)
    for (int k = 0; k < 16; ++k) *next++ = pose.matrix()(k / 4, k % 4);
  return out;
}

/// In the caller's frame: float32 where no origin was taken off, else float64.
inline py::object in_frame(const std::vector<Eigen::Vector3f>& rows,
                           const Eigen::Vector3d& origin) {
  if (origin.isZero(0)) return array_of(rows);
  py::array_t<double> out({static_cast<py::ssize_t>(rows.size()), py::ssize_t(3)});
  double* next = out.mutable_data();
  for (const Eigen::Vector3f& row : rows)
    for (int k = 0; k < 3; ++k) *next++ = static_cast<double>(row[k]) + origin[k];
  return std::move(out);
}

}  // namespace gpureg::python
