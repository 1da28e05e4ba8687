// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
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

/// One iteration of Lloyd 1982: every feature to its nearest centre, every centre to the mean.
void improve(const Rows& rows, Rows& centres) {
  Eigen::VectorXf similarity(rows.rows());
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(centres.rows(), centres.cols());
  std::vector<double> counts(static_cast<std::size_t>(centres.rows()), 0);
  const Eigen::VectorXf offsets = 0.5f * centres.rowwise().squaredNorm();
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    Eigen::Index nearest;
    similarity[k] =
        (centres * rows.row(k).transpose() - offsets).maxCoeff(&nearest);  // the first of equals
    sums.row(nearest) += rows.row(k).cast<double>();
    ++counts[static_cast<std::size_t>(nearest)];
  }
  std::vector<char> taken(static_cast<std::size_t>(rows.rows()), 0);
  for (Eigen::Index c = 0; c < centres.rows(); ++c) {
    const double count = counts[static_cast<std::size_t>(c)];
    if (count > 0)
      centres.row(c) = (sums.row(c) / count).cast<float>();
    else
      revive(c, rows, similarity, taken, centres);
  }
}

}  // namespace

Rows unit_features(const FeatureView& cloud, std::size_t step, std::size_t first) {
  const auto dimension = static_cast<Eigen::Index>(cloud.dimension);
  Rows rows(static_cast<Eigen::Index>(cloud.size), dimension);
  Eigen::Index used = 0;
  std::size_t seen = 0;
  for (std::size_t k = 0; k < cloud.size; ++k) {
    const Eigen::Map<const Eigen::RowVectorXf> feature(cloud.data + k * cloud.dimension, dimension);
    if (!feature.allFinite() || feature.isZero(0)) continue;
    if ((first + seen++) % step != 0) continue;
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
  if (words.rows > 0)
    for (int k = 0; k < kClusterRounds; ++k) improve(rows, centres);
  words.data.assign(centres.data(), centres.data() + centres.size());
  return words;
}

}  // namespace gpureg::pruning
