// SPDX-License-Identifier: BSD-3-Clause
#include "io/clouds/row_width.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numeric>

namespace gpureg::io {
namespace {

constexpr std::size_t kWidths[] = {2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 15, 16};
constexpr std::size_t kMostWidth = 16;

/// What is looked at: so many stretches, of a length that every width divides, so that no place in
/// a row has more numbers than another one.
constexpr std::size_t kStretches = 8, kStretch = 5040;

/// The smallest width that explains so much of the largest sum of shares is the width. Its
/// multiples explain more, as beams of a scanner alternate: with two or four beams a row of four
/// numbers explains 0.61 of it, where rows are of twelve at most 0.46
/// (tests/io/row_width_test.cpp).
constexpr double kMost = 0.55;
/// The same of whole numbers alone, which do not come and go with the beams: they explain all of it
/// with the right width.
constexpr double kMostWhole = 0.75;
/// Three columns that have three others of similar kinds behind them explain up to 0.61.
constexpr double kSurelyThree = 0.9, kSurelyNotThree = 0.3;
/// Smallest sum of shares that tells anything; with four or five columns it was 0.4 or more.
constexpr double kLeast = 0.05;
/// The same, as a multiple of what chance explains of so few numbers.
constexpr double kChance = 4;

std::vector<std::size_t> sample_of(std::size_t size) {
  std::vector<std::size_t> places;
  const auto add = [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) places.push_back(k);
  };
  if (size <= kStretches * kStretch) {
    add(0, size);
    return places;
  }
  const std::size_t last = size - kStretch;
  for (std::size_t k = 0; k < kStretches; ++k) {
    const std::size_t begin = last / (kStretches - 1) * k / kStretch * kStretch;
    add(begin, begin + kStretch);
  }
  return places;
}

constexpr std::size_t kFeatures = 3, kWhole = 2;
using Features = std::array<float, kFeatures>;

/// Sign and size, size, and whether the number is a whole one; each from -1 to 1.
Features features_of(float number, float scale) {
  if (!std::isfinite(number)) return {0, 0, 0};
  const float size = std::abs(number) / (std::abs(number) + scale);
  return {number < 0 ? -size : size, size, number == std::floor(number) ? 1.f : 0.f};
}

using Shares = std::array<double, kFeatures>;

double sum(const Shares& shares) { return std::accumulate(shares.begin(), shares.end(), 0.0); }

/// Share of the variance of each feature that the place in a row of this width explains.
Shares explained(const std::vector<std::size_t>& places, const std::vector<Features>& features,
                 std::size_t width) {
  std::array<std::size_t, kMostWidth> counts{};
  std::array<std::array<double, kFeatures>, kMostWidth> sums{};
  Shares all{}, squares{};
  for (std::size_t k = 0; k < places.size(); ++k) {
    const std::size_t column = places[k] % width;
    ++counts[column];
    for (std::size_t f = 0; f < kFeatures; ++f) {
      const auto value = static_cast<double>(features[k][f]);
      sums[column][f] += value;
      all[f] += value;
      squares[f] += value * value;
    }
  }
  const auto count = static_cast<double>(places.size());
  Shares shares{};
  for (std::size_t f = 0; f < kFeatures; ++f) {
    const double mean = all[f] / count, total = squares[f] - count * mean * mean;
    double between = -count * mean * mean;
    for (std::size_t column = 0; column < width; ++column)
      if (counts[column] > 0)
        between += sums[column][f] * sums[column][f] / static_cast<double>(counts[column]);
    if (total > 1e-6 * count) shares[f] = between / total;
  }
  return shares;
}

}  // namespace

int row_width(const std::vector<float>& numbers) {
  const std::vector<std::size_t> places = sample_of(numbers.size());
  std::vector<float> sizes;
  for (const std::size_t k : places)
    if (std::isfinite(numbers[k])) sizes.push_back(std::abs(numbers[k]));
  if (sizes.empty()) return 0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  const float scale = std::max(*middle, 1e-6f);
  std::vector<Features> features;
  for (const std::size_t k : places) features.push_back(features_of(numbers[k], scale));

  std::array<Shares, std::size(kWidths)> shares{};
  double most = 0, most_whole = 0;
  for (std::size_t k = 0; k < std::size(kWidths); ++k) {
    shares[k] = explained(places, features, kWidths[k]);
    most = std::max(most, sum(shares[k]));
    most_whole = std::max(most_whole, shares[k][kWhole]);
  }
  const auto at = std::find_if(shares.begin(), shares.end(), [&](const Shares& s) {
    return sum(s) >= kMost * most && s[kWhole] >= kMostWhole * most_whole - kLeast;
  });
  if (at == shares.end()) return 0;
  const std::size_t width = kWidths[at - shares.begin()];
  const double three = sum(shares[1]), chance = kFeatures * static_cast<double>(width - 1) /
                                                static_cast<double>(places.size());
  const bool ambiguous =
      (width == 3 && three < kSurelyThree * most) || (width == 6 && three > kSurelyNotThree * most);
  const bool tells = sum(*at) >= kLeast + kChance * chance;
  return tells && !ambiguous ? static_cast<int>(width) : 0;
}

}  // namespace gpureg::io
