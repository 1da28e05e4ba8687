// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/hd.hpp"

namespace gpureg {

/// float fuses, because the stages were measured so; double does not, because a fused multiply-add
/// of double is wrong in some C libraries.
GPUREG_HD float multiply_add(float a, float b, float c) { return fmaf(a, b, c); }
GPUREG_HD double multiply_add(double a, double b, double c) { return a * b + c; }
GPUREG_HD float root(float a) { return sqrtf(a); }
GPUREG_HD double root(double a) { return sqrt(a); }

/// Ratio above which a summand is far below the last bit of the other one.
GPUREG_HD float beyond_last_bit(float) { return 1e8f; }
GPUREG_HD double beyond_last_bit(double) { return 1e17; }

/// Cyclic Jacobi for a symmetric N x N matrix with a fixed number of sweeps: the same steps on
/// every machine. a: in the matrix, out the eigenvalues on its diagonal; v: out the eigenvectors as
/// columns.
template <int N, int Sweeps, typename Scalar>
GPUREG_HD void jacobi_eigen(Scalar (&a)[N][N], Scalar (&v)[N][N]) {
  const Scalar zero = Scalar(0), one = Scalar(1);
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j) v[i][j] = i == j ? one : zero;
  for (int sweep = 0; sweep < Sweeps; ++sweep) {
    for (int p = 0; p < N - 1; ++p) {
      for (int q = p + 1; q < N; ++q) {
        const Scalar apq = a[p][q];
        const Scalar size = (apq < zero ? -apq : apq) * beyond_last_bit(apq);
        // Below the last bit of both eigenvalues a rotation changes nothing; skipping it makes late
        // sweeps cheap.
        if (apq == zero || (size < (a[p][p] < zero ? -a[p][p] : a[p][p]) &&
                            size < (a[q][q] < zero ? -a[q][q] : a[q][q])))
          continue;
        const Scalar theta = (a[q][q] - a[p][p]) / (Scalar(2) * apq);
        const Scalar magnitude = theta < zero ? -theta : theta;
        // Beyond 1e9 theta^2 would overflow; there t is 1 / (2 theta) to the last bit.
        Scalar t = magnitude > Scalar(1e9)
                       ? Scalar(0.5) / magnitude
                       : one / (magnitude + root(multiply_add(theta, theta, one)));
        if (theta < zero) t = -t;
        const Scalar c = one / root(multiply_add(t, t, one));
        const Scalar s = t * c;
        for (int k = 0; k < N; ++k) {
          const Scalar akp = a[k][p], akq = a[k][q];
          a[k][p] = multiply_add(c, akp, -(s * akq));
          a[k][q] = multiply_add(s, akp, c * akq);
        }
        for (int k = 0; k < N; ++k) {
          const Scalar apk = a[p][k], aqk = a[q][k];
          a[p][k] = multiply_add(c, apk, -(s * aqk));
          a[q][k] = multiply_add(s, apk, c * aqk);
        }
        for (int k = 0; k < N; ++k) {
          const Scalar vkp = v[k][p], vkq = v[k][q];
          v[k][p] = multiply_add(c, vkp, -(s * vkq));
          v[k][q] = multiply_add(s, vkp, c * vkq);
        }
      }
    }
  }
}

}  // namespace gpureg
