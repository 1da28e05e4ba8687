// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>

#include "cpu/common/stages.hpp"

#if defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
#endif

namespace gpureg::cpu {
namespace {

constexpr int kLanes = 16;   // rows per vector block
constexpr int kQueries = 4;  // queries per pass: their sums stay in registers

/// Rows transposed in blocks of kLanes: block, dimension, lane. Invalid and missing rows are
/// infinitely far.
std::vector<float> transpose_blocks(FeatureRows rows) {
  const std::size_t blocks = (rows.size + kLanes - 1) / kLanes;
  std::vector<float> out(blocks * rows.dimension * kLanes, std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < rows.size; ++i) {
    if (!rows.valid[i]) continue;
    float* block = out.data() + i / kLanes * rows.dimension * kLanes + i % kLanes;
    for (std::size_t d = 0; d < rows.dimension; ++d)
      block[d * kLanes] = rows.values[i * rows.dimension + d];
  }
  return out;
}

/// Squared distances of kQueries queries to one block: sum over the dimensions in ascending order,
/// each step one fmaf.
void block_distances(const float* const* queries, const float* block, std::size_t dimension,
                     float (*out)[kLanes]) {
#if defined(__AVX2__) && defined(__FMA__)
  static_assert(kLanes == 16 && kQueries == 4, "written out for 4 x 16");
  __m256 sum[kQueries][2];
  for (auto& s : sum) s[0] = s[1] = _mm256_setzero_ps();
  for (std::size_t d = 0; d < dimension; ++d) {
    const __m256 lo = _mm256_loadu_ps(block + d * kLanes),
                 hi = _mm256_loadu_ps(block + d * kLanes + 8);
    for (int q = 0; q < kQueries; ++q) {
      const __m256 value = _mm256_set1_ps(queries[q][d]);
      const __m256 a = _mm256_sub_ps(value, lo), b = _mm256_sub_ps(value, hi);
      sum[q][0] = _mm256_fmadd_ps(a, a, sum[q][0]);
      sum[q][1] = _mm256_fmadd_ps(b, b, sum[q][1]);
    }
  }
  for (int q = 0; q < kQueries; ++q) {
    _mm256_storeu_ps(out[q], sum[q][0]);
    _mm256_storeu_ps(out[q] + 8, sum[q][1]);
  }
#else
  for (int q = 0; q < kQueries; ++q)
    for (int l = 0; l < kLanes; ++l) out[q][l] = 0.0f;
  for (std::size_t d = 0; d < dimension; ++d)
    for (int q = 0; q < kQueries; ++q)
      for (int l = 0; l < kLanes; ++l) {
        const float difference = queries[q][d] - block[d * kLanes + l];
        out[q][l] = fmaf(difference, difference, out[q][l]);
      }
#endif
}

/// The k best (distance, index) of one query, ascending; ties keep the lower index because rows
/// come in ascending order.
struct TopK {
  float distance[limits::kMaxNeighbors];
  std::uint32_t index[limits::kMaxNeighbors];
  std::uint32_t k;

  void clear(std::uint32_t count) {
    k = count;
    std::fill_n(distance, limits::kMaxNeighbors, std::numeric_limits<float>::infinity());
    std::fill_n(index, limits::kMaxNeighbors, kNoValue);
  }
  void insert(float d, std::uint32_t i) {
    std::uint32_t at = k - 1;
    for (; at > 0 && d < distance[at - 1]; --at) {
      distance[at] = distance[at - 1];
      index[at] = index[at - 1];
    }
    distance[at] = d;
    index[at] = i;
  }
};

void search(FeatureRows queries, const std::vector<float>& blocks, FeatureRows rows,
            std::uint32_t k, std::size_t begin, std::size_t end, std::uint32_t* out) {
  const std::size_t block_count = (rows.size + kLanes - 1) / kLanes;
  const std::size_t dimension = rows.dimension;
  TopK top[kQueries];
  float distances[kQueries][kLanes];
  for (std::size_t q = begin; q < end; q += kQueries) {
    const float* values[kQueries];
    for (int j = 0; j < kQueries; ++j) {
      values[j] = queries.values + std::min(q + j, end - 1) * dimension;
      top[j].clear(k);
    }
    for (std::size_t b = 0; b < block_count; ++b) {
      block_distances(values, blocks.data() + b * dimension * kLanes, dimension, distances);
      for (int j = 0; j < kQueries; ++j) {
        const float worst = top[j].distance[k - 1];
        float smallest = distances[j][0];
        for (int l = 1; l < kLanes; ++l)
          smallest = distances[j][l] < smallest ? distances[j][l] : smallest;
        if (!(smallest < worst)) continue;
        for (int l = 0; l < kLanes; ++l)
          if (distances[j][l] < top[j].distance[k - 1])
            top[j].insert(distances[j][l], static_cast<std::uint32_t>(b * kLanes + l));
      }
    }
    for (int j = 0; j < kQueries && q + j < end; ++j)
      for (std::uint32_t t = 0; t < k; ++t)
        out[(q + j - begin) * k + t] = queries.valid[q + j] ? top[j].index[t] : kNoValue;
  }
}

FeatureRows rows_of(const CloudView& cloud) {
  return {cloud.features, cloud.has_feature, cloud.size, cloud.feature_dimension};
}

MatchedPoints matched(const PairView& pair, std::uint32_t source, std::uint32_t target) {
  return {pair.source.points[source], pair.target.points[target], source, target};
}

}  // namespace

void nearest_features(FeatureRows queries, FeatureRows rows, std::uint32_t k, std::size_t begin,
                      std::size_t end, std::uint32_t* out) {
  search(queries, transpose_blocks(rows), rows, k, begin, end, out);
}

std::vector<Matches> match_features(Exec& exec, Span<const PairView> pairs,
                                    const RegistrationSettings& options) {
  const std::uint32_t k = options.quadruples.neighbors;
  std::vector<std::vector<float>> forward_blocks(pairs.size), backward_blocks(pairs.size);
  std::vector<std::vector<std::uint32_t>> forward(pairs.size), backward(pairs.size);
  const auto asks = [&](std::size_t p) {
    return pairs[p].custom_count == 0 && pairs[p].source.size > 0 && pairs[p].target.size > 0;
  };
  exec.parallel(pairs.size, [&](std::size_t p) {
    if (!asks(p)) return;
    forward_blocks[p] = transpose_blocks(rows_of(pairs[p].target));
    forward[p].resize(static_cast<std::size_t>(pairs[p].source.size) * k);
    if (!options.quadruples.mutual) return;
    backward_blocks[p] = transpose_blocks(rows_of(pairs[p].source));
    backward[p].resize(pairs[p].target.size);
  });
  exec.parallel_items(
      pairs.size, [&](std::size_t p) { return asks(p) ? pairs[p].source.size : 0; }, 256,
      [&](std::size_t p, std::size_t begin, std::size_t end) {
        search(rows_of(pairs[p].source), forward_blocks[p], rows_of(pairs[p].target), k, begin, end,
               forward[p].data() + begin * k);
      });
  if (options.quadruples.mutual)
    exec.parallel_items(
        pairs.size, [&](std::size_t p) { return asks(p) ? pairs[p].target.size : 0; }, 256,
        [&](std::size_t p, std::size_t begin, std::size_t end) {
          search(rows_of(pairs[p].target), backward_blocks[p], rows_of(pairs[p].source), 1, begin,
                 end, backward[p].data() + begin);
        });

  std::vector<Matches> out(pairs.size);
  exec.parallel(pairs.size, [&](std::size_t p) {
    const PairView& pair = pairs[p];
    std::vector<MatchedPoints>& matches = out[p].pairs;
    for (std::uint32_t c = 0; c < pair.custom_count; ++c)
      matches.push_back(matched(pair, pair.custom_source[c], pair.custom_target[c]));
    for (std::size_t m = 0; m < forward[p].size(); ++m) {
      const std::uint32_t source = static_cast<std::uint32_t>(m / k), target = forward[p][m];
      if (target == kNoValue || (options.quadruples.mutual && backward[p][target] != source))
        continue;
      matches.push_back(matched(pair, source, target));
    }
  });
  return out;
}

}  // namespace gpureg::cpu
