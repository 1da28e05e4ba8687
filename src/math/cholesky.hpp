// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/hd.hpp"

namespace gpureg {

/// Solves A x = b for a symmetric positive definite 6 x 6 matrix (reads the lower triangle) by L D
/// L'. Its only divisions are the six reciprocals of D, because one thread solves while its thread
/// block waits. False where A is not positive definite.
GPUREG_HD bool solve_cholesky6(const double (&matrix)[6][6], const double (&b)[6], double (&x)[6]) {
  double l[6][6], inverse[6];
  for (int i = 0; i < 6; ++i) {
    double row[6];  // of L D
    for (int j = 0; j < i; ++j) {
      double sum = matrix[i][j];
      for (int k = 0; k < j; ++k) sum -= row[k] * l[j][k];
      row[j] = sum;
      l[i][j] = sum * inverse[j];
    }
    double d = matrix[i][i];
    for (int k = 0; k < i; ++k) d -= row[k] * l[i][k];
    if (!(d > 0.0)) return false;
    inverse[i] = 1.0 / d;
  }
  double y[6];
  for (int i = 0; i < 6; ++i) {
    y[i] = b[i];
    for (int k = 0; k < i; ++k) y[i] -= l[i][k] * y[k];
  }
  for (int i = 5; i >= 0; --i) {
    x[i] = y[i] * inverse[i];
    for (int k = i + 1; k < 6; ++k) x[i] -= l[k][i] * x[k];
  }
  return true;
}

}  // namespace gpureg
