// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "math/trigonometry.hpp"

namespace gpureg::portable {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Distance of neighbouring doubles at the value.
double last_place(long double value) {
  int exponent;
  std::frexp(static_cast<double>(std::fabs(value)), &exponent);
  return std::ldexp(1.0, std::max(exponent - 53, -1074));
}

/// Largest error in units of the last place over random arguments between the limits, which are
/// exponents of e where `logarithmic`. long double of x86-64 has 11 bits more than double, so its
/// own error is below 0.001 units.
template <typename Own, typename Library>
double worst_error(const Own& own, const Library& library, double low, double high,
                   bool logarithmic = false) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> place(low, high);
  double worst = 0;
  for (int k = 0; k < 200000; ++k) {
    const double x = logarithmic ? std::exp(place(random)) : place(random);
    const long double expected = library(static_cast<long double>(x));
    const double error = std::fabs(static_cast<double>((own(x) - expected) / last_place(expected)));
    if (!(error <= worst)) worst = error;
  }
  return worst;
}

class Elementary : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::numeric_limits<long double>::digits < 64)
      GTEST_SKIP() << "long double has no more digits than double here";
  }
};

TEST_F(Elementary, Exponential) {
  const auto own = [](double x) { return exp(x); };
  const auto library = [](long double x) { return std::exp(x); };
  EXPECT_LT(worst_error(own, library, -1, 1), 0.7);
  EXPECT_LT(worst_error(own, library, -700, 709.7), 0.7);
  EXPECT_LT(worst_error(own, library, -745, -700), 1.0);
}

TEST_F(Elementary, Logarithm) {
  const auto own = [](double x) { return log(x); };
  const auto library = [](long double x) { return std::log(x); };
  EXPECT_LT(worst_error(own, library, 0.99, 1.01), 0.6);
  EXPECT_LT(worst_error(own, library, 0.4, 2.2), 0.6);
  EXPECT_LT(worst_error(own, library, -744, 709, true), 0.6);
}

TEST_F(Elementary, LogarithmOfOnePlus) {
  const auto own = [](double x) { return log1p(x); };
  const auto library = [](long double x) { return std::log1p(x); };
  EXPECT_LT(worst_error(own, library, -0.9, 3), 0.7);
  EXPECT_LT(worst_error(own, library, -100, 700, true), 0.7);
}

TEST_F(Elementary, SineAndCosine) {
  const auto own_sine = [](double x) { return sin(x); };
  const auto sine = [](long double x) { return std::sin(x); };
  const auto own_cosine = [](double x) { return cos(x); };
  const auto cosine = [](long double x) { return std::cos(x); };
  for (const double most : {0.8, 7.0, kLargestExactAngle}) {
    EXPECT_LT(worst_error(own_sine, sine, -most, most), 0.85);
    EXPECT_LT(worst_error(own_cosine, cosine, -most, most), 0.85);
  }
  EXPECT_LT(worst_error(own_sine, sine, -700, 0, true), 0.85);
}

TEST_F(Elementary, ArcTangent) {
  for (const double other : {1.0, -3.7, 1e300, -1e-300})
    for (const bool is_x : {false, true}) {
      const auto own = [&](double v) { return is_x ? atan2(other, v) : atan2(v, other); };
      const auto library = [&](long double v) {
        const long double o = other;
        return is_x ? std::atan2(o, v) : std::atan2(v, o);
      };
      EXPECT_LT(worst_error(own, library, -5, 5), 0.6);
      // Results below the normal numbers round twice.
      EXPECT_LT(worst_error(own, library, -700, 700, true), 0.8) << other << is_x;
    }
}

TEST_F(Elementary, ArcCosine) {
  const auto own = [](double x) { return acos(x); };
  const auto library = [](long double x) { return std::acos(x); };
  EXPECT_LT(worst_error(own, library, -1, 1), 1.5);
  EXPECT_LT(worst_error(own, library, 0.9999, 1), 1.5);
}

TEST(ElementaryLimits, SpecialArguments) {
  EXPECT_EQ(exp(0), 1);
  EXPECT_EQ(exp(710), kInfinity);
  EXPECT_EQ(exp(kInfinity), kInfinity);
  EXPECT_EQ(exp(-746), 0);
  EXPECT_EQ(exp(-kInfinity), 0);
  EXPECT_TRUE(std::isnan(exp(kNan)));
  EXPECT_EQ(log(1), 0);
  EXPECT_EQ(log(0), -kInfinity);
  EXPECT_EQ(log(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(log(-1)));
  EXPECT_TRUE(std::isnan(log(kNan)));
  EXPECT_EQ(log1p(0), 0);
  EXPECT_EQ(log1p(-1), -kInfinity);
  EXPECT_EQ(log1p(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(log1p(-2)));
  EXPECT_EQ(sin(0), 0);
  EXPECT_EQ(cos(0), 1);
  EXPECT_TRUE(std::isnan(sin(kInfinity)));
  EXPECT_TRUE(std::isnan(cos(kNan)));
  EXPECT_EQ(acos(1), 0);
  EXPECT_EQ(acos(-1), std::acos(-1.0));
  EXPECT_TRUE(std::isnan(acos(1.5)));
  EXPECT_EQ(logistic(0), 0.5);
  EXPECT_EQ(logistic(-kInfinity), 0);
}

TEST(ElementaryLimits, ArcTangentOfZerosAndInfinities) {
  const double values[] = {0.0, -0.0, 1.0, -1.0, kInfinity, -kInfinity, 5e-324, -1.7e308};
  for (const double y : values)
    for (const double x : values) {
      const double own = atan2(y, x), expected = std::atan2(y, x);
      EXPECT_EQ(own, expected) << y << " " << x;
      EXPECT_EQ(std::signbit(own), std::signbit(expected)) << y << " " << x;
    }
  EXPECT_TRUE(std::isnan(atan2(kNan, 1)));
  EXPECT_TRUE(std::isnan(atan2(1, kNan)));
}

TEST(ElementaryLimits, AnglesBeyondTheExactOnesStayOnTheCircle) {
  for (const double angle : {1e7, -3e15, 1e300})
    EXPECT_NEAR(sin(angle) * sin(angle) + cos(angle) * cos(angle), 1, 1e-15);
}

}  // namespace
}  // namespace gpureg::portable
