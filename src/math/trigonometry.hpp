// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/double_double.hpp"
#include "math/exponential.hpp"

/// Trigonometry of double by + - * / and sqrt alone; see math/exponential.hpp. Errors are below 1
/// unit in the last place, of acos below 2 (tests/math/elementary_test.cpp).
namespace gpureg::portable {

constexpr double kPi = 0x1.921fb54442d18p+1, kPiLow = 0x1.1a62633145c07p-53;
constexpr double kRadiansPerDegree = kPi / 180.0;
/// Beyond this angle, sin and cos first take the remainder by the double nearest 2 pi: the same
/// everywhere, but with an error that grows with the angle.
constexpr double kLargestExactAngle = 1e6;

/// The angle as k pi / 2 + r with |r| <= pi / 4.
struct Quadrant {
  int k;  ///< modulo 4
  Sum r;
};

GPUREG_HD Quadrant quadrant_of(double angle) {
  // pi / 2 in three parts; products of the first two with integers below 2^20 are exact.
  constexpr double kFirst = 0x1.921fb544p+0, kSecond = 0x1.0b4611a6p-34,
                   kThird = 0x1.3198a2e037073p-69;
  if (angle > kLargestExactAngle || angle < -kLargestExactAngle)
    angle = remainder(angle, 2.0 * kPi);
  const double k = nearest_integer(angle * 0x1.45f306dc9c883p-1);
  const Sum r = two_sum(angle - k * kFirst, -(k * kSecond));
  return {static_cast<int>(k) & 3, fast_two_sum(r.high, r.low - k * kThird)};
}

/// sin of |r| <= pi / 4; the series breaks off after r^17.
GPUREG_HD double sin_near_zero(Sum r) {
  const double z = r.high * r.high;
  double p = 0.0;
  for (int n = 16; n >= 2; n -= 2) p = (1.0 + p) * (-z / (n * (n + 1)));
  return r.high + (r.low * (1.0 - 0.5 * z) + r.high * p);
}

/// cos of |r| <= pi / 4; the series breaks off after r^18.
GPUREG_HD double cos_near_zero(Sum r) {
  const Sum square = two_product(r.high, r.high);
  const double z = square.high;
  double p = 0.0;
  for (int n = 17; n >= 3; n -= 2) p = (1.0 + p) * (-z / (n * (n + 1)));
  // 1 - z / 2 (1 + p)
  const Sum first = fast_two_sum(1.0, -0.5 * z);
  return first.high + (first.low - (0.5 * square.low + r.high * r.low) - 0.5 * z * p);
}

/// NaN of an infinite angle.
GPUREG_HD double sin(double angle) {
  if (angle - angle != 0.0) return angle - angle;
  const Quadrant q = quadrant_of(angle);
  const double value = (q.k & 1) != 0 ? cos_near_zero(q.r) : sin_near_zero(q.r);
  return (q.k & 2) != 0 ? -value : value;
}

GPUREG_HD double cos(double angle) {
  if (angle - angle != 0.0) return angle - angle;
  const Quadrant q = quadrant_of(angle);
  const double value = (q.k & 1) != 0 ? sin_near_zero(q.r) : cos_near_zero(q.r);
  return q.k == 1 || q.k == 2 ? -value : value;
}

/// arctan(y / x) of 0 <= y <= x, x > 0, both between 2^-900 and 2^900 or y smaller.
GPUREG_HD Sum atan_of_quotient(double y, double x) {
  // arctan of k / 8.
  constexpr double kHigh[] = {0.0,
                              0x1.fd5ba9aac2f6ep-4,
                              0x1.f5b75f92c80ddp-3,
                              0x1.6f61941e4def1p-2,
                              0x1.dac670561bb4fp-2,
                              0x1.1e00babdefeb4p-1,
                              0x1.4978fa3269ee1p-1,
                              0x1.700a7c5784634p-1,
                              0x1.921fb54442d18p-1};
  constexpr double kLow[] = {0.0,
                             -0x1.cd37686760c17p-59,
                             0x1.8ab6e3cf7afbdp-57,
                             -0x1.c63aae6f6e918p-56,
                             0x1.a2b7f222f65e2p-56,
                             -0x1.928df287a668fp-58,
                             0x1.2419a87f2a458p-56,
                             -0x1.8c34d25aadef6p-56,
                             0x1.1a62633145c07p-55};
  // arctan t = arctan c + arctan((t - c) / (1 + t c)), c = k / 8: the second term is below 1/16.
  const int k = static_cast<int>(nearest_integer(8.0 * (y / x)));
  const double c = k / 8.0;
  const Sum cx = two_product(c, x), cy = two_product(c, y);
  const Sum above = two_sum(y, -cx.high), below = two_sum(x, cy.high);
  const Sum t = quotient({above.high, above.low - cx.low}, {below.high, below.low + cy.low});
  const double z = t.high * t.high;
  double p = 0.0;  // the series breaks off after t^17
  for (int n = 17; n >= 3; n -= 2) p = (1.0 / n - p) * z;
  const Sum sum = two_sum(kHigh[k], t.high);
  return fast_two_sum(sum.high, sum.low + (kLow[k] + (t.low - t.high * p)));
}

/// Angle of (x, y) in [-pi, pi], with the signs of zeros and the limits of C's atan2.
GPUREG_HD double atan2(double y, double x) {
  if (x != x || y != y) return x + y;
  const bool left = bits_of(x) >> 63 != 0, lower = bits_of(y) >> 63 != 0;
  double ax = left ? -x : x, ay = lower ? -y : y;
  if (ax == kInfinity || ay == kInfinity) {
    ax = ax == kInfinity ? 1.0 : 0.0;
    ay = ay == kInfinity ? 1.0 : 0.0;
  }
  const bool steep = ay > ax;
  double larger = steep ? ay : ax, smaller = steep ? ax : ay;
  // Away from the limits of the exponent, so that the products are exact.
  const double scale = larger > 0x1p+900 ? 0x1p-200 : larger < 0x1p-700 ? 0x1p+300 : 1.0;
  larger *= scale;
  smaller *= scale;
  Sum angle = larger > 0.0 ? atan_of_quotient(smaller, larger) : Sum{0.0, 0.0};
  if (steep) {
    const Sum rest = two_sum(0.5 * kPi, -angle.high);
    angle = fast_two_sum(rest.high, rest.low + (0.5 * kPiLow - angle.low));
  }
  if (left) {
    const Sum rest = two_sum(kPi, -angle.high);
    angle = fast_two_sum(rest.high, rest.low + (kPiLow - angle.low));
  }
  return lower ? -angle.high : angle.high;
}

/// NaN outside [-1, 1].
GPUREG_HD double acos(double x) {
  const Sum square = two_product(x, x), rest = two_sum(1.0, -square.high);
  return atan2(sqrt(rest.high + (rest.low - square.low)), x);
}

}  // namespace gpureg::portable
