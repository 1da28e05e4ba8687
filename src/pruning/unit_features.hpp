// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "gpureg/pruning.hpp"

namespace gpureg::pruning {

using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Signed roots of the features at unit length, as FPFH is a set of histograms (Arandjelovic and
/// Zisserman 2012). Rows of zeros are left out; of the others, those whose number, counted from
/// `first`, is a multiple of `step` are returned.
Rows unit_features(const FeatureView& cloud, std::size_t step = 1, std::size_t first = 0);

}  // namespace gpureg::pruning
