// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/pruning.hpp"

namespace gpureg::pruning {

/// summarize() of a cloud's parts: one feature and one normal per point.
Summary summarize(const FeatureView& features, const std::vector<Eigen::Vector3f>& points,
                  const std::vector<Eigen::Vector3f>& normals, float feature_radius,
                  const Matrix& words);

}  // namespace gpureg::pruning
