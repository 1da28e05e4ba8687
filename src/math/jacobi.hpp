// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/hd.hpp"

namespace gpureg {

/// Cyclic Jacobi for a symmetric N x N matrix with a fixed number of sweeps: the same steps on
/// every machine. a: in the matrix, out the eigenvalues on its diagonal; v: out the eigenvectors as
/// columns.
template <int N, int Sweeps>
GPUREG_HD void jacobi_eigen(float (&a)[N][N], float (&v)[N][N]) {
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j) v[i][j] = i == j ? 1.0f : 0.0f;
  for (int sweep = 0; sweep < Sweeps; ++sweep) {
    for (int p = 0; p < N - 1; ++p) {
      for (int q = p + 1; q < N; ++q) {
        const float apq = a[p][q];
        const float size = (apq < 0.0f ? -apq : apq) * 1e8f;
        // Below the last bit of both eigenvalues a rotation changes nothing; skipping it makes late
        // sweeps cheap.
        if (apq == 0.0f || (size < (a[p][p] < 0.0f ? -a[p][p] : a[p][p]) &&
                            size < (a[q][q] < 0.0f ? -a[q][q] : a[q][q])))
          continue;
        const float theta = (a[q][q] - a[p][p]) / (2.0f * apq);
        const float magnitude = theta < 0.0f ? -theta : theta;
        // Beyond 1e9 theta^2 would overflow; there t is 1 / (2 theta) to the last bit.
        float t = magnitude > 1e9f ? 0.5f / magnitude
                                   : 1.0f / (magnitude + sqrtf(fmaf(theta, theta, 1.0f)));
        if (theta < 0.0f) t = -t;
        const float c = 1.0f / sqrtf(fmaf(t, t, 1.0f));
        const float s = t * c;
        for (int k = 0; k < N; ++k) {
          const float akp = a[k][p], akq = a[k][q];
          a[k][p] = fmaf(c, akp, -(s * akq));
          a[k][q] = fmaf(s, akp, c * akq);
        }
        for (int k = 0; k < N; ++k) {
          const float apk = a[p][k], aqk = a[q][k];
          a[p][k] = fmaf(c, apk, -(s * aqk));
          a[q][k] = fmaf(s, apk, c * aqk);
        }
        for (int k = 0; k < N; ++k) {
          const float vkp = v[k][p], vkq = v[k][q];
          v[k][p] = fmaf(c, vkp, -(s * vkq));
          v[k][q] = fmaf(s, vkp, c * vkq);
        }
      }
    }
  }
}

}  // namespace gpureg
