// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <string>

#include "common/limits.hpp"

/// Values that a field may have.
namespace gpureg::fields {

constexpr double kMost = std::numeric_limits<double>::max();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// An interval. NaN is in none, infinity only where an end is infinite.
struct Range {
  double low = -kInfinity, high = kInfinity;
  bool open_low = false, open_high = false;  ///< that end itself is refused
  bool or_zero = false;                      ///< 0 is accepted, too
  const char* expected = nullptr;            ///< for messages; none: from the ends
  const char* unit = nullptr;                ///< for documents, instead of `expected`
  bool checked = true;
  bool voxels = false;  ///< a length of in_units()

  constexpr bool contains(double value) const {
    if (!checked || (or_zero && value == 0)) return true;
    return (open_low ? value > low : value >= low) && (open_high ? value < high : value <= high);
  }
  constexpr Range in(const char* of) const {
    Range out = *this;
    out.unit = of;
    return out;
  }
  constexpr Range in_voxels() const {
    Range out = in("voxels");
    out.voxels = true;
    return out;
  }
};

constexpr Range from(double low, double high, const char* expected = nullptr) {
  return {low, high, false, false, false, expected};
}
constexpr Range above(double low, double high, const char* expected) {
  return {low, high, true, false, false, expected};
}
constexpr Range between(double low, double high, const char* expected) {
  return {low, high, true, true, false, expected};
}

constexpr Range kAnything{-kInfinity, kInfinity, false, false, false, nullptr, nullptr, false};
constexpr Range kLength =
    from(limits::kMinLength, limits::kMaxLength, "a length in [1e-6, 1e6]").in("metres");
constexpr Range kLengthOrZero{
    limits::kMinLength, limits::kMaxLength, false, false, true, "0 or a length in [1e-6, 1e6]",
    "metres, or 0"};
constexpr Range kVoxels = from(1e-3, 1e3, "a number of voxels in [0.001, 1000]").in("voxels");
constexpr Range kVoxelsOrZero{
    1e-3, 1e3, false, false, true, "0 or a number of voxels in [0.001, 1000]", "voxels, or 0"};
constexpr Range kDegrees = above(0, 180, "degrees in (0, 180]");
constexpr Range kRatio = from(0, 1, "a ratio in [0, 1]");
constexpr Range kPositiveRatio = above(0, 1, "a ratio in (0, 1]");
constexpr Range kProbability = from(0, 1, "a probability in [0, 1]");
constexpr Range kOpenProbability = between(0, 1, "a probability in (0, 1)");
constexpr Range kUpToOne = from(0, 1, "[0, 1]"), kPositiveUpToOne = above(0, 1, "(0, 1]"),
                kWithinOne = between(0, 1, "(0, 1)");
constexpr Range kFinite = from(-kMost, kMost, "a finite number");
constexpr Range kPositive = above(0, kMost, "a finite number > 0");
constexpr Range kNotNegative = from(0, kMost, "a finite number >= 0");
constexpr Range kMilliseconds = kAnything.in("milliseconds");

/// What a message says that was expected.
inline std::string expected_of(const Range& range) {
  if (range.expected) return range.expected;
  const auto whole = [](double value) { return std::to_string(static_cast<long long>(value)); };
  if (range.high == kInfinity) return whole(range.low) + " or more";
  if (range.low == 0) return "at most " + whole(range.high);
  return whole(range.low) + " to " + whole(range.high);
}

/// Unit or interval for documents; empty where there is nothing to say.
inline std::string described(const Range& range) {
  if (range.unit) return range.unit;
  return range.checked ? expected_of(range) : "";
}

}  // namespace gpureg::fields
