// SPDX-License-Identifier: BSD-3-Clause
#include "math/atan2.hpp"

#include <gtest/gtest.h>

#include <random>

namespace gpureg {
namespace {

TEST(Atan2, AgreesWithDouble) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-3, 3), exponent(-12, 12);
  double worst = 0;
  for (int k = 0; k < 200000; ++k) {
    const float y = value(random) * std::exp(exponent(random)),
                x = value(random) * std::exp(exponent(random));
    worst = std::max(worst, std::fabs(static_cast<double>(exact_atan2(y, x)) -
                                      std::atan2(static_cast<double>(y), static_cast<double>(x))));
  }
  // The polynomial is good to 4e-8, a float near pi to 1.2e-7, and two roundings follow each other.
  EXPECT_LT(worst, 4e-7);
}

TEST(Atan2, Axes) {
  EXPECT_EQ(exact_atan2(0, 0), 0);
  EXPECT_EQ(exact_atan2(0, 1), 0);
  EXPECT_NEAR(exact_atan2(0, -1), kPi, 1e-6);
  EXPECT_NEAR(exact_atan2(1, 0), kPi / 2, 1e-6);
  EXPECT_NEAR(exact_atan2(-1, 0), -kPi / 2, 1e-6);
}

}  // namespace
}  // namespace gpureg
