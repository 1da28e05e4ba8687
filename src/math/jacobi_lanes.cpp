// SPDX-License-Identifier: BSD-3-Clause
#include "math/jacobi_lanes.hpp"

#include <cmath>
#include <cstdint>

#include "math/jacobi.hpp"

namespace gpureg {
namespace {

constexpr int kLanes = Matrices6::kLanes;

/// Rotations in the plane of two axes, one for each lane; turns: 0 where the lane keeps its matrix.
struct Rotations {
  double c[kLanes], s[kLanes];
  std::int64_t turns[kLanes];

  /// x, y -> c x - s y, s x + c y.
  void apply(double (&x)[kLanes], double (&y)[kLanes]) const {
    for (int l = 0; l < kLanes; ++l) {
      const double a = x[l], b = y[l];
      const double first = c[l] * a + -(s[l] * b), second = s[l] * a + c[l] * b;
      x[l] = turns[l] != 0 ? first : a;
      y[l] = turns[l] != 0 ? second : b;
    }
  }
};

/// Of element (p, q), as jacobi_eigen() finds them.
bool find_rotations(const Matrices6& a, int p, int q, Rotations& r) {
  std::int64_t any = 0;
  for (int l = 0; l < kLanes; ++l) {
    const double apq = a.at[p][q][l], app = a.at[p][p][l], aqq = a.at[q][q][l];
    const double size = std::abs(apq) * beyond_last_bit(apq);
    const bool small = (size < std::abs(app)) & (size < std::abs(aqq));
    r.turns[l] = (apq == 0.0) | small ? 0 : 1;
    any |= r.turns[l];
  }
  if (any == 0) return false;
  for (int l = 0; l < kLanes; ++l) {
    const double theta = (a.at[q][q][l] - a.at[p][p][l]) / (2.0 * a.at[p][q][l]);
    const double magnitude = std::abs(theta);
    const double far = 0.5 / magnitude, near = 1.0 / (magnitude + std::sqrt(theta * theta + 1.0));
    double t = magnitude > 1e9 ? far : near;
    t = theta < 0.0 ? -t : t;
    r.c[l] = 1.0 / std::sqrt(t * t + 1.0);
    r.s[l] = t * r.c[l];
  }
  return true;
}

}  // namespace

void jacobi_eigen(int sweeps, Matrices6& a, Matrices6& v) {
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      for (int l = 0; l < kLanes; ++l) v.at[i][j][l] = i == j ? 1.0 : 0.0;
  Rotations r;
  bool turned = true;
  for (int sweep = 0; sweep < sweeps && turned; ++sweep) {
    turned = false;
    for (int p = 0; p < 5; ++p)
      for (int q = p + 1; q < 6; ++q) {
        if (!find_rotations(a, p, q, r)) continue;
        turned = true;
        for (int k = 0; k < 6; ++k) r.apply(a.at[k][p], a.at[k][q]);
        for (int k = 0; k < 6; ++k) r.apply(a.at[p][k], a.at[q][k]);
        for (int k = 0; k < 6; ++k) r.apply(v.at[k][p], v.at[k][q]);
      }
  }
}

}  // namespace gpureg
