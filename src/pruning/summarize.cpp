// SPDX-License-Identifier: BSD-3-Clause
#include "pruning/summarize.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <unordered_map>

#include "gpureg/error.hpp"
#include "pruning/unit_features.hpp"
#include "settings/settings.hpp"

namespace gpureg::pruning {
namespace {

/// More key points find hardly more overlaps (bench/notes/pruning.md).
constexpr std::size_t kKeyPoints = 256;
/// Distance between key points, of the feature radius.
constexpr float kSeparation = 0.6f;
/// Length of a feature: its rounded values fit into a byte.
constexpr float kLength = 127;

/// Points at a distance from each other, in cells as wide as the distance.
class SeparatedPoints {
 public:
  explicit SeparatedPoints(float distance) : distance_(distance) {}

  bool add(const Eigen::Vector3f& p) {
    const Cell own = cell(p);
    for (std::int64_t dx = -1; dx <= 1; ++dx)
      for (std::int64_t dy = -1; dy <= 1; ++dy)
        for (std::int64_t dz = -1; dz <= 1; ++dz) {
          const auto found = cells_.find(key({own[0] + dx, own[1] + dy, own[2] + dz}));
          if (found == cells_.end()) continue;
          for (const Eigen::Vector3f& other : found->second)
            if ((other - p).squaredNorm() < distance_ * distance_) return false;
        }
    cells_[key(own)].push_back(p);
    return true;
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  Cell cell(const Eigen::Vector3f& p) const {
    const auto at = [&](int axis) {
      return static_cast<std::int64_t>(std::floor(p[axis] / distance_));
    };
    return {at(0), at(1), at(2)};
  }
  /// Cells of one key are 2^21 cells apart: their points are far from each other.
  static std::uint64_t key(const Cell& c) {
    constexpr std::uint64_t kMask = (std::uint64_t{1} << 21) - 1;
    return (static_cast<std::uint64_t>(c[0]) & kMask) << 42 |
           (static_cast<std::uint64_t>(c[1]) & kMask) << 21 |
           (static_cast<std::uint64_t>(c[2]) & kMask);
  }

  float distance_;
  std::unordered_map<std::uint64_t, std::vector<Eigen::Vector3f>> cells_;
};

Rows rows_of(const Matrix& words) {
  return Eigen::Map<const Rows>(words.data.data(), static_cast<Eigen::Index>(words.rows),
                                static_cast<Eigen::Index>(words.columns));
}

}  // namespace

std::vector<float> sum_residuals(const Rows& rows, const std::vector<NearestWord>& nearest,
                                 const Rows& words) {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> sums =
      Eigen::MatrixXd::Zero(words.rows(), words.cols());
  for (std::size_t k = 0; k < nearest.size(); ++k)
    sums.row(nearest[k].word) +=
        (rows.row(static_cast<Eigen::Index>(k)) - words.row(nearest[k].word)).cast<double>();
  for (Eigen::Index c = 0; c < words.rows(); ++c)
    if (const double length = sums.row(c).norm(); length > 0) sums.row(c) /= length;
  if (const double length = sums.norm(); length > 0) sums /= length;
  std::vector<float> out(static_cast<std::size_t>(sums.size()));
  std::transform(sums.data(), sums.data() + sums.size(), out.begin(),
                 [](double v) { return static_cast<float>(v); });
  return out;
}

void check_dimension(const FeatureView& cloud, const Matrix& words) {
  if (cloud.size > 0 && words.rows > 0 && cloud.dimension != words.columns)
    throw InvalidArgument("the features have dimension " + std::to_string(cloud.dimension) +
                          ", the words " + std::to_string(words.columns));
}

std::vector<float> describe(const FeatureView& cloud, const Matrix& words) {
  check_dimension(cloud, words);
  const Rows centres = rows_of(words);
  if (cloud.size == 0 || words.rows == 0)
    return std::vector<float>(words.rows * words.columns, 0.0f);
  const Rows rows = unit_features(cloud);
  return sum_residuals(rows, nearest_words(rows, centres), centres);
}

Summary summarize(const FeatureView& features, const std::vector<Eigen::Vector3f>& points,
                  const std::vector<Eigen::Vector3f>& normals, float feature_radius,
                  const Matrix& words) {
  check_dimension(features, words);
  Summary out;
  out.feature_radius = feature_radius;
  out.descriptor.assign(words.rows * words.columns, 0.0f);
  if (features.size == 0 || words.rows == 0) return out;
  const Rows centres = rows_of(words), rows = unit_features(features);
  const std::vector<NearestWord> nearest = nearest_words(rows, centres);
  out.descriptor = sum_residuals(rows, nearest, centres);

  struct Candidate {
    NearestWord nearest;
    std::size_t row, point;
  };
  std::vector<Candidate> order;
  std::size_t row = 0;
  for (std::size_t k = 0; k < features.size; ++k) {
    if (!is_used(features.data + k * features.dimension, features.dimension)) continue;
    if (!normals[k].isZero(0)) order.push_back({nearest[row], row, k});
    ++row;
  }
  // Of one word, the features that are least like it are the rarest.
  std::sort(order.begin(), order.end(), [](const Candidate& a, const Candidate& b) {
    return std::tuple(a.nearest.word, a.nearest.similarity, a.point) <
           std::tuple(b.nearest.word, b.nearest.similarity, b.point);
  });
  SeparatedPoints separated(kSeparation * feature_radius);
  for (const Candidate& candidate : order) {
    if (out.points.size() == kKeyPoints) break;
    if (!separated.add(points[candidate.point])) continue;
    out.points.push_back(points[candidate.point]);
    out.normals.push_back(normals[candidate.point]);
    for (Eigen::Index d = 0; d < rows.cols(); ++d)
      out.features.push_back(static_cast<std::int8_t>(
          std::lround(kLength * rows(static_cast<Eigen::Index>(candidate.row), d))));
  }
  return out;
}

Summary summarize(const PreparedCloud& cloud, const Matrix& words) {
  const std::vector<float> features = cloud.features();
  const std::size_t dimension = cloud.feature_dimension();
  return summarize({features.data(), dimension > 0 ? features.size() / dimension : 0, dimension},
                   cloud.points(), cloud.normals(), cloud.settings().feature_radius, words);
}

}  // namespace gpureg::pruning
