// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "nearest_feature.hpp"
#include "stage_data.hpp"

namespace gpureg::cuda {

/// All features of one cloud asked for in another; out: where the answers begin.
inline FeatureQuery narrow_query(const CloudView& from, const CloudView& in, std::uint32_t out) {
  const FeatureAids& a = static_cast<const CudaCloud*>(from.executor_data)->narrow_aids;
  const FeatureAids& b = static_cast<const CudaCloud*>(in.executor_data)->narrow_aids;
  return {from.features,
          from.has_feature,
          from.size,
          in.features,
          in.has_feature,
          in.size,
          from.feature_dimension,
          out,
          a.copy == b.copy ? a.half : nullptr,
          b.half,
          b.copy,
          a.padded,
          b.padded,
          a.error,
          b.square,
          a.scale,
          b.scale};
}

/// The same by the features of the wide radius, which both clouds must have.
inline FeatureQuery wide_query(const CloudView& from, const CloudView& in, std::uint32_t out) {
  const FeatureAids& a = static_cast<const CudaCloud*>(from.executor_data)->wide_aids;
  const FeatureAids& b = static_cast<const CudaCloud*>(in.executor_data)->wide_aids;
  return {from.wide_features,
          from.has_wide_feature,
          from.size,
          in.wide_features,
          in.has_wide_feature,
          in.size,
          from.feature_dimension,
          out,
          a.copy == b.copy ? a.half : nullptr,
          b.half,
          b.copy,
          a.padded,
          b.padded,
          a.error,
          b.square,
          a.scale,
          b.scale};
}

}  // namespace gpureg::cuda
