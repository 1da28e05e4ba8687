// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace gpureg {

/// Symmetric 6 x 6 matrices side by side, so that vector instructions decompose them together.
struct Matrices6 {
  static constexpr int kLanes = 8;
  double at[6][6][kLanes];
};

/// jacobi_eigen<6, sweeps>() of all lanes, with its bits.
void jacobi_eigen(int sweeps, Matrices6& a, Matrices6& v);

}  // namespace gpureg
