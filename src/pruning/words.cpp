// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "common/validate.hpp"
#include "gpureg/pruning.hpp"
#include "pruning/unit_features.hpp"

namespace gpureg::pruning {
namespace {

/// Features per word that k-means looks at; more do not change the words much.
constexpr std::size_t kFeaturesPerWord = 256;
constexpr int kClusterRounds = 20;

/// Moves a centre without features to the feature that is farthest from its own centre.
void revive(Eigen::Index centre, const Rows& rows, const Eigen::VectorXf& similarity,
            std::vector<char>& taken, Rows& centres) {
  Eigen::Index farthest = -1;
  for (Eigen::Index k = 0; k < rows.rows(); ++k)
    if (!taken[static_cast<std::size_t>(k)] &&
        (farthest < 0 || similarity[k] < similarity[farthest]))
      farthest = k;
  if (farthest < 0) return;
  taken[static_cast<std::size_t>(farthest)] = 1;
  centres.row(centre) = rows.row(farthest);
}

std::vector<std::size_t> counts_of(const std::vector<NearestWord>& nearest, std::size_t words) {
  std::vector<std::size_t> counts(words, 0);
  for (const NearestWord& found : nearest) ++counts[static_cast<std::size_t>(found.word)];
  return counts;
}

/// One iteration of Lloyd 1982: every feature to its nearest centre, every centre to the mean.
void improve(const Rows& rows, Rows& centres) {
  const std::vector<NearestWord> nearest = nearest_words(rows, centres);
  const std::vector<std::size_t> counts =
      counts_of(nearest, static_cast<std::size_t>(centres.rows()));
  Eigen::VectorXf similarity(rows.rows());
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(centres.rows(), centres.cols());
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    const NearestWord& found = nearest[static_cast<std::size_t>(k)];
    similarity[k] = found.similarity;
    sums.row(found.word) += rows.row(k).cast<double>();
  }
  std::vector<char> taken(static_cast<std::size_t>(rows.rows()), 0);
  for (Eigen::Index c = 0; c < centres.rows(); ++c) {
    const auto count = static_cast<double>(counts[static_cast<std::size_t>(c)]);
    if (count > 0)
      centres.row(c) = (sums.row(c) / count).cast<float>();
    else
      revive(c, rows, similarity, taken, centres);
  }
}

/// The centres with the fewest rows first.
Rows rarest_first(const Rows& rows, const Rows& centres) {
  const std::vector<std::size_t> counts =
      counts_of(nearest_words(rows, centres), static_cast<std::size_t>(centres.rows()));
  std::vector<std::size_t> order(counts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return counts[a] < counts[b]; });
  Rows sorted(centres.rows(), centres.cols());
  for (std::size_t k = 0; k < order.size(); ++k)
    sorted.row(static_cast<Eigen::Index>(k)) = centres.row(static_cast<Eigen::Index>(order[k]));
  return sorted;
}

}  // namespace

std::vector<NearestWord> nearest_words(const Rows& rows, const Rows& words) {
  std::vector<NearestWord> out(static_cast<std::size_t>(rows.rows()));
  const Eigen::VectorXf offsets = 0.5f * words.rowwise().squaredNorm();
  for (std::size_t k = 0; k < out.size(); ++k)
    out[k].similarity = (words * rows.row(static_cast<Eigen::Index>(k)).transpose() - offsets)
                            .maxCoeff(&out[k].word);
  return out;
}

bool is_used(const float* feature, std::size_t dimension) {
  const Eigen::Map<const Eigen::RowVectorXf> row(feature, static_cast<Eigen::Index>(dimension));
  return row.allFinite() && !row.isZero(0);
}

Rows unit_features(const FeatureView& cloud, std::size_t step, std::size_t first) {
  const auto dimension = static_cast<Eigen::Index>(cloud.dimension);
  Rows rows(static_cast<Eigen::Index>(cloud.size), dimension);
  Eigen::Index used = 0;
  std::size_t seen = 0;
  for (std::size_t k = 0; k < cloud.size; ++k) {
    const float* values = cloud.data + k * cloud.dimension;
    if (!is_used(values, cloud.dimension)) continue;
    if ((first + seen++) % step != 0) continue;
    const Eigen::Map<const Eigen::RowVectorXf> feature(values, dimension);
    const Eigen::RowVectorXf root = feature.array().sign() * feature.array().abs().sqrt();
    rows.row(used++) = root / root.norm();
  }
  rows.conservativeResize(used, dimension);
  return rows;
}

Matrix learn_words(const std::vector<FeatureView>& clouds, std::uint32_t most) {
  require(most >= 1, "words", most, "1 or more");
  Matrix words;
  std::size_t features = 0;
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    if (clouds[k].size == 0) continue;
    if (words.columns == 0) words.columns = clouds[k].dimension;
    if (clouds[k].dimension != words.columns)
      throw InvalidArgument("clouds[" + std::to_string(k) + "] has features of dimension " +
                            std::to_string(clouds[k].dimension) + ", others of " +
                            std::to_string(words.columns));
    features += static_cast<std::size_t>(unit_features(clouds[k]).rows());
  }
  const std::size_t step = std::max<std::size_t>(1, features / (kFeaturesPerWord * most));
  Rows rows(static_cast<Eigen::Index>((features + step - 1) / step),
            static_cast<Eigen::Index>(words.columns));
  Eigen::Index used = 0;
  std::size_t before = 0;
  for (const FeatureView& cloud : clouds) {
    if (cloud.size == 0) continue;
    const Rows part = unit_features(cloud, step, before);
    rows.middleRows(used, part.rows()) = part;
    used += part.rows();
    before += static_cast<std::size_t>(unit_features(cloud).rows());
  }
  words.rows = std::min<std::size_t>(most, static_cast<std::size_t>(used));
  Rows centres(static_cast<Eigen::Index>(words.rows), rows.cols());
  for (std::size_t c = 0; c < words.rows; ++c)
    centres.row(static_cast<Eigen::Index>(c)) =
        rows.row(static_cast<Eigen::Index>(c * static_cast<std::size_t>(used) / words.rows));
  if (words.rows > 0) {
    for (int k = 0; k < kClusterRounds; ++k) improve(rows, centres);
    centres = rarest_first(rows, centres);
  }
  words.data.assign(centres.data(), centres.data() + centres.size());
  return words;
}

}  // namespace gpureg::pruning
