// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstring>
#include <limits>

#include "math/double_double.hpp"

/// Exponential and logarithm of double by + - * / alone: C libraries differ in their last bits, and
/// results depend on them. Errors are below 1 unit in the last place
/// (tests/math/elementary_test.cpp).
namespace gpureg::portable {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// log 2 in two parts; products of the first one with integers below 2^21 are exact.
constexpr double kLogTwoHigh = 0x1.62e42ffp-1, kLogTwoLow = -0x1.718432a1b0e26p-35;

constexpr double square(double x) { return x * x; }

/// Nearest integer of |x| < 2^51.
GPUREG_HD double nearest_integer(double x) {
  constexpr double kShift = 6755399441055744.0;  // 1.5 * 2^52: no digit is left behind the point
  return (x + kShift) - kShift;
}

GPUREG_HD std::uint64_t bits_of(double x) {
  std::uint64_t bits;
  memcpy(&bits, &x, sizeof bits);
  return bits;
}

GPUREG_HD double of_bits(std::uint64_t bits) {
  double x;
  memcpy(&x, &bits, sizeof x);
  return x;
}

/// 2^k for -1022 <= k <= 1023.
GPUREG_HD double power_of_two(int k) { return of_bits(static_cast<std::uint64_t>(k + 1023) << 52); }

/// e^x. Overflows to infinity and underflows to 0 as IEEE rounds.
GPUREG_HD double exp(double x) {
  if (x != x) return x;
  if (x > 709.782712893384) return kInfinity;
  if (x < -745.1332191019412) return 0.0;
  // x = k log 2 + r with |r| below 0.35.
  const double k = nearest_integer(x * 0x1.71547652b82fep+0);
  const Sum r = two_sum(x - k * kLogTwoHigh, -(k * kLogTwoLow));
  // (e^r - 1 - r) / r^2; the series breaks off after r^14.
  double p = 0.0;
  for (int n = 14; n >= 2; --n) p = (p * r.high + 1.0) / n;
  const Sum s = fast_two_sum(1.0, r.high);
  const double y = s.high + (s.low + (r.low + r.high * r.high * p));
  const int e = static_cast<int>(k);
  if (e > 1000) return y * power_of_two(e - 24) * 16777216.0;
  // Only the last product rounds, so numbers below the normal ones round once.
  if (e < -1000) return y * power_of_two(e + 100) * power_of_two(-100);
  return y * power_of_two(e);
}

/// log x of a positive finite x.
GPUREG_HD Sum log_of_positive(double x) {
  int k = 0;
  if (x < 0x1p-1022) {
    x *= 0x1p54;
    k = -54;
  }
  // x = 2^k (1 + f) with 1 + f between the roots of 1/2 and 2.
  std::uint64_t bits = bits_of(x);
  k += static_cast<int>(bits >> 52) - 1023;
  bits = (bits & 0x000fffffffffffffu) | 0x3ff0000000000000u;
  double m = of_bits(bits);
  if (m > 1.4142135623730951) {
    m *= 0.5;
    ++k;
  }
  const double f = m - 1.0;
  // log(1 + f) = 2 artanh(s), s = f / (2 + f): |s| is below 0.172, the series breaks off after
  // s^25.
  const Sum s = quotient({f, 0.0}, two_sum(2.0, f));
  const double z = s.high * s.high;
  double p = 0.0;
  for (int n = 25; n >= 3; n -= 2) p = (p + 2.0 / n) * z;
  const Sum sum = two_sum(k * kLogTwoHigh, 2.0 * s.high);
  return fast_two_sum(sum.high, sum.low + (2.0 * s.low + (s.high * p + k * kLogTwoLow)));
}

/// Natural logarithm; minus infinity of 0, NaN of negative numbers.
GPUREG_HD double log(double x) {
  if (x == 0.0) return -kInfinity;
  if (!(x > 0.0)) return (x - x) / (x - x);
  if (x == kInfinity) return x;
  return log_of_positive(x).high;
}

/// log(1 + x) without the rounding of the sum.
GPUREG_HD double log1p(double x) {
  if (!(x > -1.0) || x == kInfinity) return log(1.0 + x);
  const Sum u = two_sum(1.0, x), y = log_of_positive(u.high);
  return y.high + (y.low + u.low / u.high);
}

/// Probability of log odds.
GPUREG_HD double logistic(double log_odds) { return 1.0 / (1.0 + exp(-log_odds)); }

}  // namespace gpureg::portable
