// SPDX-License-Identifier: BSD-3-Clause
#include "pruning/agreement.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>

#include "math/exponential.hpp"

namespace gpureg::pruning {
namespace {

/// Of the feature radius: the largest difference of distances between compatible matches, and the
/// smallest distance. Key points are 0.6 radii apart, so those of one place differ by as much.
constexpr float kTolerance = 0.6f, kLeastLength = 0.8f;
/// Largest difference of cosines between compatible matches.
constexpr float kMaxTurn = 0.3f;
/// A key is the product of two features and the place of a key point counted from the end: below
/// 127 * 127 * 256 + 256, which a float holds exactly, as it does every sum on the way there.
constexpr float kPoints = 256;
constexpr float kNone = -1;
/// Dimensions that are summed together.
constexpr std::size_t kDimensions = 4;

float key_of(float product, std::size_t point) {
  return std::max(product, 0.0f) * kPoints + (kPoints - 1 - static_cast<float>(point));
}

std::uint32_t point_of(float key) {
  return static_cast<std::uint32_t>(kPoints) - 1 -
         static_cast<std::uint32_t>(key) % static_cast<std::uint32_t>(kPoints);
}

int count_bits(std::uint64_t bits) { return static_cast<int>(std::bitset<64>(bits).count()); }

/// Two key points of one cloud, and the cosines between them that motions do not change.
struct Segment {
  const Eigen::Vector3f *first_normal, *second_normal;
  Eigen::Vector3f between;
  float length;

  Segment(const Summary& cloud, std::uint32_t a, std::uint32_t b)
      : first_normal(&cloud.normals[a]),
        second_normal(&cloud.normals[b]),
        between(cloud.points[b] - cloud.points[a]),
        length(between.norm()) {}
  std::array<float, 3> cosines() const {
    return {first_normal->dot(*second_normal), first_normal->dot(between) / length,
            second_normal->dot(between) / length};
  }
};

bool are_compatible(const Segment& a, const Segment& b, float radius) {
  if (std::abs(a.length - b.length) > kTolerance * radius ||
      !(std::min(a.length, b.length) >= kLeastLength * radius))
    return false;
  const std::array<float, 3> x = a.cosines(), y = b.cosines();
  return std::abs(x[0] - y[0]) <= kMaxTurn && std::abs(x[1] - y[1]) <= kMaxTurn &&
         std::abs(x[2] - y[2]) <= kMaxTurn;
}

}  // namespace

void Agreement::set_target(const Summary& target) {
  target_ = &target;
  const std::size_t points = target.points.size();
  dimension_ = points > 0 ? target.features.size() / points : 0;
  columns_.assign((dimension_ + kDimensions - 1) / kDimensions * kDimensions * points, 0.0f);
  for (std::size_t j = 0; j < points; ++j)
    for (std::size_t d = 0; d < dimension_; ++d)
      columns_[d * points + j] = static_cast<float>(target.features[j * dimension_ + d]);
}

double Agreement::with(const Summary& source) {
  if (source.points.empty() || target_->points.empty()) return 0;
  match(source);
  compare(source);
  return portable::log(1 + std::sqrt(strongest_support()));
}

/// products_ of a key point with those of the target.
void Agreement::multiply(const Summary& source, std::size_t point) {
  const std::size_t columns = target_->points.size();
  feature_.assign(columns_.size() / columns, 0.0f);
  for (std::size_t d = 0; d < dimension_; ++d)
    feature_[d] = static_cast<float>(source.features[point * dimension_ + d]);
  products_.assign(columns, 0.0f);
  float* products = products_.data();
  for (std::size_t d = 0; d < feature_.size(); d += kDimensions) {
    const float *f = feature_.data() + d, *first = columns_.data() + d * columns,
                *second = first + columns, *third = second + columns, *fourth = third + columns;
    for (std::size_t j = 0; j < columns; ++j)
      products[j] += f[0] * first[j] + f[1] * second[j] + f[2] * third[j] + f[3] * fourth[j];
  }
}

/// Pairs of key points that are among the two most similar of each other.
void Agreement::match(const Summary& source) {
  const std::size_t rows = source.points.size(), columns = target_->points.size();
  for (std::vector<float>* best : {&of_source_.first, &of_source_.second})
    best->assign(rows, kNone);
  for (std::vector<float>* best : {&of_target_.first, &of_target_.second})
    best->assign(columns, kNone);
  for (std::size_t i = 0; i < rows; ++i) {
    multiply(source, i);
    const float* products = products_.data();
    float *firsts = of_target_.first.data(), *seconds = of_target_.second.data();
    for (std::size_t j = 0; j < columns; ++j) {
      const float key = key_of(products[j], i);
      seconds[j] = std::max(seconds[j], std::min(firsts[j], key));
      firsts[j] = std::max(firsts[j], key);
    }
    float first = kNone, second = kNone;
    for (std::size_t j = 0; j < columns; ++j) {
      const float key = key_of(products[j], j);
      second = std::max(second, std::min(first, key));
      first = std::max(first, key);
    }
    of_source_.first[i] = first;
    of_source_.second[i] = second;
  }
  matches_.clear();
  for (std::uint32_t i = 0; i < rows; ++i)
    for (const float key : {of_source_.first[i], of_source_.second[i]}) {
      if (key == kNone) continue;
      const std::uint32_t j = point_of(key);
      for (const float back : {of_target_.first[j], of_target_.second[j]})
        if (back != kNone && point_of(back) == i) matches_.push_back({i, j});
    }
}

void Agreement::compare(const Summary& source) {
  const float radius = std::max(source.feature_radius, target_->feature_radius);
  width_ = (matches_.size() + 63) / 64;
  compatible_.assign(matches_.size() * width_, 0);
  compatibles_.assign(matches_.size(), 0);
  for (std::size_t x = 0; x < matches_.size(); ++x)
    for (std::size_t y = x + 1; y < matches_.size(); ++y) {
      const Match &a = matches_[x], &b = matches_[y];
      if (!are_compatible({source, a.source, b.source}, {*target_, a.target, b.target}, radius))
        continue;
      compatible_[x * width_ + y / 64] |= std::uint64_t{1} << y % 64;
      compatible_[y * width_ + x / 64] |= std::uint64_t{1} << x % 64;
      ++compatibles_[x];
      ++compatibles_[y];
    }
}

/// Of a match: the matches compatible with it and with each match that it is compatible with.
double Agreement::strongest_support() const {
  std::int64_t strongest = 0;
  for (std::size_t x = 0; x < matches_.size(); ++x) {
    const std::int64_t degree = compatibles_[x];
    if (degree * degree <= strongest) continue;
    const std::uint64_t* row = compatible_.data() + x * width_;
    std::int64_t support = 0;
    for (std::size_t y = 0; y < matches_.size(); ++y) {
      if ((row[y / 64] >> y % 64 & 1) == 0) continue;
      for (std::size_t k = 0; k < width_; ++k)
        support += count_bits(row[k] & compatible_[y * width_ + k]);
    }
    strongest = std::max(strongest, support);
  }
  return static_cast<double>(strongest);
}

}  // namespace gpureg::pruning
