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
constexpr float kTolerance = 0.6f, kShortest = 0.8f;
/// Largest difference of cosines between compatible matches.
constexpr float kMaxTurn = 0.3f;
/// Key points per cloud fit into eight bits, so that a product and a point fit into one integer.
constexpr std::int32_t kPoints = 256;
/// Points of the target whose products are computed together.
constexpr std::size_t kBlock = 16;

std::uint32_t point_of(std::int32_t key) {
  return static_cast<std::uint32_t>(kPoints - 1 - (key & (kPoints - 1)));
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
      !(std::min(a.length, b.length) >= kShortest * radius))
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
  blocks_ = (points + kBlock - 1) / kBlock;
  columns_.assign(dimension_ * blocks_ * kBlock, 0.0f);
  for (std::size_t j = 0; j < points; ++j)
    for (std::size_t d = 0; d < dimension_; ++d)
      columns_[(j / kBlock * dimension_ + d) * kBlock + j % kBlock] =
          static_cast<float>(target.features[j * dimension_ + d]);
}

double Agreement::with(const Summary& source) {
  if (source.points.empty() || target_->points.empty()) return 0;
  match(source);
  compare(source);
  return portable::log(1 + std::sqrt(strongest_support()));
}

/// Pairs of key points that are among the most similar of each other.
void Agreement::match(const Summary& source) {
  const std::size_t rows = source.points.size(), columns = target_->points.size();
  for (Best* best : {&of_source_, &of_target_}) {
    const std::size_t points = best == &of_source_ ? rows : columns;
    best->first.assign(points, -1);
    best->second.assign(points, -1);
  }
  products_.resize(blocks_ * kBlock);
  std::vector<float> feature(dimension_);
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t d = 0; d < dimension_; ++d)
      feature[d] = static_cast<float>(source.features[i * dimension_ + d]);
    for (std::size_t block = 0; block < blocks_; ++block) {
      // Products of integers below 2^24: any order of the sums is exact.
      float sums[kBlock] = {};
      const float* column = columns_.data() + block * dimension_ * kBlock;
      for (std::size_t d = 0; d < dimension_; ++d)
        for (std::size_t j = 0; j < kBlock; ++j) sums[j] += feature[d] * column[d * kBlock + j];
      std::copy(sums, sums + kBlock,
                products_.begin() + static_cast<std::ptrdiff_t>(block * kBlock));
    }
    const float* products = products_.data();
    std::int32_t first = -1, second = -1;
    std::int32_t *firsts = of_target_.first.data(), *seconds = of_target_.second.data();
    const std::int32_t own = kPoints - 1 - static_cast<std::int32_t>(i);
    for (std::size_t j = 0; j < columns; ++j) {
      const std::int32_t product = std::max(0, static_cast<std::int32_t>(products[j])) * kPoints;
      const std::int32_t key = product + kPoints - 1 - static_cast<std::int32_t>(j);
      second = std::max(second, std::min(first, key));
      first = std::max(first, key);
      seconds[j] = std::max(seconds[j], std::min(firsts[j], product + own));
      firsts[j] = std::max(firsts[j], product + own);
    }
    of_source_.first[i] = first;
    of_source_.second[i] = second;
  }
  matches_.clear();
  for (std::uint32_t i = 0; i < rows; ++i)
    for (const std::int32_t key : {of_source_.first[i], of_source_.second[i]}) {
      if (key < 0) continue;
      const std::uint32_t j = point_of(key);
      for (const std::int32_t back : {of_target_.first[j], of_target_.second[j]})
        if (back >= 0 && point_of(back) == i) matches_.push_back({i, j});
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
