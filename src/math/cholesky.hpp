// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/hd.hpp"

namespace gpureg {

/// Solves A x = b for a symmetric positive definite 6 x 6 matrix (lower triangle is read). False where A is not positive definite.
GPUREG_HD bool solve_cholesky6(const double (&matrix)[6][6], const double (&b)[6], double (&x)[6]) {
  double l[6][6];
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = matrix[i][j];
      for (int k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
      if (i == j) {
        if (!(sum > 0.0)) return false;
        l[i][i] = sqrt(sum);
      } else {
        l[i][j] = sum / l[j][j];
      }
    }
  }
  double y[6];
  for (int i = 0; i < 6; ++i) {
    double sum = b[i];
    for (int k = 0; k < i; ++k) sum -= l[i][k] * y[k];
    y[i] = sum / l[i][i];
  }
  for (int i = 5; i >= 0; --i) {
    double sum = y[i];
    for (int k = i + 1; k < 6; ++k) sum -= l[k][i] * x[k];
    x[i] = sum / l[i][i];
  }
  return true;
}

}  // namespace gpureg
