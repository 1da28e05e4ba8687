// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "gpureg/pruning.hpp"

namespace gpureg::pruning {

using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Signed roots of the features at unit length, as FPFH is a set of histograms (Arandjelovic and
/// Zisserman 2012). Rows of zeros are left out; of the others, those whose number, counted from
/// `first`, is a multiple of `step` are returned.
Rows unit_features(const FeatureView& cloud, std::size_t step = 1, std::size_t first = 0);

/// The nearest word of each row, and (row, word) - |word|^2 / 2; the first of equals.
struct NearestWord {
  Eigen::Index word = 0;
  float similarity = 0;
};
std::vector<NearestWord> nearest_words(const Rows& rows, const Rows& words);

/// Residuals of the rows from their words as in describe().
std::vector<float> sum_residuals(const Rows& rows, const std::vector<NearestWord>& nearest,
                                 const Rows& words);

/// Whether unit_features() keeps the feature.
bool is_used(const float* feature, std::size_t dimension);

/// @throws InvalidArgument unless the cloud is empty or has features as long as the words.
void check_dimension(const FeatureView& cloud, const Matrix& words);

}  // namespace gpureg::pruning
