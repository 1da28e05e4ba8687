// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/fpfh.hpp"
#include "cpu/pair_bins.hpp"
#include "cpu/stages.hpp"

namespace gpureg::cpu {
namespace {

bool finite_row(const float* row, std::size_t dimension) {
  for (std::size_t d = 0; d < dimension; ++d)
    if (!(row[d] - row[d] == 0.0f)) return false;
  return true;
}

void describe(Exec& exec, const std::vector<DownsampledCloud>& clouds,
              const std::vector<std::vector<Vec3>>& normals, const std::vector<Grid>& grids,
              float radius, std::vector<Features>& features) {
  constexpr std::size_t kGrain = 128;
  std::vector<std::vector<float>> spfh(clouds.size());
  const auto items = [&](std::size_t c) {
    return clouds[c].feature_dimension > 0 ? std::size_t(0) : clouds[c].points.size();
  };
  for (std::size_t c = 0; c < clouds.size(); ++c) {
    if (clouds[c].feature_dimension > 0) continue;
    features[c].dimension = kFpfhSize;
    features[c].valid.assign(items(c), 0);
    features[c].values.resize(items(c) * kFpfhSize);
    spfh[c].resize(items(c) * kFpfhSize);
  }
  exec.parallel_items(
      clouds.size(), items, kGrain, [&](std::size_t c, std::size_t begin, std::size_t end) {
        const GridView grid = grids[c].view();
        PairBins bins;
        for (std::size_t i = begin; i < end; ++i) {
          std::uint32_t counts[kFpfhSize];
          const int neighbors =
              bins.spfh_counts(grid, span_of(normals[c]), static_cast<std::uint32_t>(i),
                               clouds[c].points[i], radius, counts);
          for (int b = 0; b < kFpfhSize; ++b)
            spfh[c][i * kFpfhSize + b] = spfh_value(counts[b], neighbors);
        }
      });
  exec.parallel_items(
      clouds.size(), items, kGrain, [&](std::size_t c, std::size_t begin, std::size_t end) {
        const GridView grid = grids[c].view();
        for (std::size_t i = begin; i < end; ++i)
          features[c].valid[i] = weighted_fpfh(grid, span_of(normals[c]), spfh[c].data(),
                                               static_cast<std::uint32_t>(i), clouds[c].points[i],
                                               radius, features[c].values.data() + i * kFpfhSize);
      });
}

}  // namespace

std::vector<Features> compute_wide_features(Exec& exec, const std::vector<DownsampledCloud>& clouds,
                                            const std::vector<std::vector<Vec3>>& normals,
                                            const std::vector<Grid>& grids,
                                            const PrepareOptions& options) {
  std::vector<Features> features(clouds.size());
  if (options.wide_feature_radius > 0)
    describe(exec, clouds, normals, grids, options.wide_feature_radius, features);
  return features;
}

std::vector<Features> compute_features(Exec& exec, const std::vector<DownsampledCloud>& clouds,
                                       const std::vector<std::vector<Vec3>>& normals,
                                       const std::vector<Grid>& grids,
                                       const PrepareOptions& options) {
  std::vector<Features> features(clouds.size());
  // Custom features come as they are; their rows with a NaN are never matched.
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
