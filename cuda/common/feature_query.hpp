// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/nearest_feature.hpp"
#include "cuda/common/stage_data.hpp"

namespace gpureg::cuda {

/// The members that features and wide features share. a, b: search data of queries and rows.
inline FeatureQuery make_query(const CloudView& from, const FeatureAids& a, const CloudView& in,
                               const FeatureAids& b, std::uint32_t out) {
  FeatureQuery query{};
  query.query_count = from.size;
  query.row_count = in.size;
  query.dimension = from.feature_dimension;
  query.out = out;
  query.query_half = a.copy == b.copy ? a.half : nullptr;
  query.row_half = b.half;
  query.copy = b.copy;
  query.query_error = a.error;
  query.row_square = b.square;
  query.query_scale = a.scale;
  query.row_scale = b.scale;
  return query;
}

/// Query of all features of one cloud in another. out: first element of the results.
inline FeatureQuery narrow_query(const CloudView& from, const CloudView& in, std::uint32_t out) {
  FeatureQuery query =
      make_query(from, static_cast<const CudaCloud*>(from.executor_data)->narrow_aids, in,
                 static_cast<const CudaCloud*>(in.executor_data)->narrow_aids, out);
  query.queries = from.features;
  query.query_valid = from.has_feature;
  query.rows = in.features;
  query.row_valid = in.has_feature;
  return query;
}

/// Query of all wide features of one cloud in another; both clouds must have them.
inline FeatureQuery wide_query(const CloudView& from, const CloudView& in, std::uint32_t out) {
  FeatureQuery query =
      make_query(from, static_cast<const CudaCloud*>(from.executor_data)->wide_aids, in,
                 static_cast<const CudaCloud*>(in.executor_data)->wide_aids, out);
  query.queries = from.wide_features;
  query.query_valid = from.has_wide_feature;
  query.rows = in.wide_features;
  query.row_valid = in.has_wide_feature;
  return query;
}

}  // namespace gpureg::cuda
