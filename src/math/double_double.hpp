// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/hd.hpp"

namespace gpureg::portable {

/// A number as the sum of two doubles, |low| at most half a unit in the last place of high. The
/// sums and products below are exact (Dekker 1971, Knuth 1969) and need no fused multiply-add,
/// which some C libraries compute wrongly.
struct Sum {
  double high, low;
};

GPUREG_HD Sum two_sum(double a, double b) {
  const double sum = a + b, of_b = sum - a;
  return {sum, (a - (sum - of_b)) + (b - of_b)};
}

/// |a| >= |b|, or a is 0.
GPUREG_HD Sum fast_two_sum(double a, double b) {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

/// Upper half of the digits of a, for |a| < 2^996.
GPUREG_HD double upper_half(double a) {
  const double c = 134217729.0 * a;  // 2^27 + 1
  return c - (c - a);
}

/// Exact unless the product underflows, for factors below 2^996.
GPUREG_HD Sum two_product(double a, double b) {
  const double product = a * b;
  const double a1 = upper_half(a), a2 = a - a1, b1 = upper_half(b), b2 = b - b1;
  return {product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2};
}

/// a / b to about 100 bits.
GPUREG_HD Sum quotient(Sum a, Sum b) {
  const double q = a.high / b.high;
  const Sum back = two_product(q, b.high);
  return {q, (((a.high - back.high) - back.low) + a.low - q * b.low) / b.high};
}

}  // namespace gpureg::portable
