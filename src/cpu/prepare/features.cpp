// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/fpfh.hpp"

#include <algorithm>
#include <memory>

#include "cpu/common/stages.hpp"
#include "cpu/prepare/pair_bins.hpp"

#if defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
#endif

namespace gpureg::cpu {
namespace {

bool finite_row(const float* row, std::size_t dimension) {
  for (std::size_t d = 0; d < dimension; ++d)
    if (!(row[d] - row[d] == 0.0f)) return false;
  return true;
}

constexpr std::size_t kRow = 40;  // kFpfhSize, rounded up to whole vectors; the rest is zero

/// Adds the weighted row to the sums, each entry by one fmaf.
class WeightedRows {
 public:
#if defined(__AVX2__) && defined(__FMA__)
  WeightedRows() {
    for (auto& s : sum_) s = _mm256_setzero_ps();
  }
  void add(float weight, const float* row) {
    const __m256 w = _mm256_set1_ps(weight);
    for (int k = 0; k < 5; ++k) sum_[k] = _mm256_fmadd_ps(w, _mm256_loadu_ps(row + 8 * k), sum_[k]);
  }
  void get(float* out) const {
    for (int k = 0; k < 5; ++k) _mm256_storeu_ps(out + 8 * k, sum_[k]);
  }

 private:
  __m256 sum_[5];
#else
  void add(float weight, const float* row) {
    for (std::size_t k = 0; k < kRow; ++k) sum_[k] = fmaf(weight, row[k], sum_[k]);
  }
  void get(float* out) const { std::copy_n(sum_, kRow, out); }

 private:
  float sum_[kRow] = {};
#endif
};

/// weighted_fpfh() of the point at a position; spfh: rows of kRow, by position.
bool weighted_fpfh(const NeighborRows& rows, const std::vector<float>& spfh, std::size_t self,
                   float radius, std::vector<std::uint32_t>& places, std::vector<float>& squared,
                   float* out) {
  std::fill_n(out, kFpfhSize, 0.0f);
  if (is_zero(rows.normal(self))) return false;
  const std::size_t n = rows.within(rows.point(self), radius, places, squared,
                                    [](std::uint32_t, float d2) { return d2 > 0.0f; });
  for (std::size_t k = 0; k < n; ++k) squared[k] = 1.0f / squared[k];
  WeightedRows sum;
  for (std::size_t k = 0; k < n; ++k) sum.add(squared[k], spfh.data() + places[k] * kRow);
  float histogram[kRow];
  sum.get(histogram);
  if (!normalize_fpfh(histogram)) return false;
  std::copy_n(histogram, kFpfhSize, out);
  return true;
}

void describe(Exec& exec, const std::vector<DownsampledCloud>& clouds,
              const std::vector<std::vector<Vec3>>& normals, const std::vector<Grid>& grids,
              float radius, std::vector<Features>& features) {
  constexpr std::size_t kGrain = 128;
  std::vector<std::vector<float>> spfh(clouds.size());
  std::vector<std::unique_ptr<NeighborRows>> rows(clouds.size());
  const auto items = [&](std::size_t c) {
    return clouds[c].feature_dimension > 0 ? std::size_t(0) : clouds[c].points.size();
  };
  exec.parallel(clouds.size(), [&](std::size_t c) {
    if (clouds[c].feature_dimension > 0) return;
    features[c].dimension = kFpfhSize;
    features[c].valid.assign(items(c), 0);
    features[c].values.resize(items(c) * kFpfhSize);
    spfh[c].assign(items(c) * kRow, 0.0f);
    rows[c] = std::make_unique<NeighborRows>(grids[c], normals[c]);
  });
  exec.parallel_items(clouds.size(), items, kGrain,
                      [&](std::size_t c, std::size_t begin, std::size_t end) {
                        PairBins bins;
                        for (std::size_t i = begin; i < end; ++i) {
                          std::uint32_t counts[kFpfhSize];
                          const int neighbors = bins.spfh_counts(*rows[c], i, radius, counts);
                          for (int b = 0; b < kFpfhSize; ++b)
                            spfh[c][i * kRow + b] = spfh_value(counts[b], neighbors);
                        }
                      });
  exec.parallel_items(
      clouds.size(), items, kGrain, [&](std::size_t c, std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> places;
        std::vector<float> squared;
        for (std::size_t k = begin; k < end; ++k) {
          const std::size_t i = rows[c]->index(k);
          features[c].valid[i] = weighted_fpfh(*rows[c], spfh[c], k, radius, places, squared,
                                               features[c].values.data() + i * kFpfhSize);
        }
      });
}

}  // namespace

std::vector<Features> compute_wide_features(Exec& exec, const std::vector<DownsampledCloud>& clouds,
                                            const std::vector<Grid>& grids,
                                            const PrepareSettings& options) {
  std::vector<Features> features(clouds.size());
  const bool any = std::any_of(clouds.begin(), clouds.end(), [](const DownsampledCloud& cloud) {
    return cloud.feature_dimension == 0;
  });
  if (!any || !(options.wide_feature_radius > 0)) return features;
  const auto normals =
      estimate_normals(exec, clouds, grids,
                       wide_normal_radius(options.normal_radius, options.feature_radius,
                                          options.wide_feature_radius));
  describe(exec, clouds, normals, grids, options.wide_feature_radius, features);
  return features;
}

std::vector<Features> compute_features(Exec& exec, const std::vector<DownsampledCloud>& clouds,
                                       const std::vector<std::vector<Vec3>>& normals,
                                       const std::vector<Grid>& grids,
                                       const PrepareSettings& options) {
  std::vector<Features> features(clouds.size());
  // Given features are copied; rows with a NaN are never matched.
  for (std::size_t c = 0; c < clouds.size(); ++c) {
    if (clouds[c].feature_dimension == 0) continue;
    const std::size_t n = clouds[c].points.size();
    features[c].dimension = clouds[c].feature_dimension;
    features[c].values = clouds[c].features;
    features[c].valid.assign(n, 0);
    for (std::size_t i = 0; i < n; ++i)
      features[c].valid[i] =
          finite_row(features[c].values.data() + i * features[c].dimension, features[c].dimension);
  }
  describe(exec, clouds, normals, grids, options.feature_radius, features);
  return features;
}

}  // namespace gpureg::cpu
