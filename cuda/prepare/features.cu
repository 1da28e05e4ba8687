// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/fpfh.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/device/launch.cuh"
#include "cuda/prepare/neighbor_rows.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kWarps = 4;  // points per thread block

struct FpfhBatch {
  const std::uint32_t* offset;
  const GridView* grids;
  const Vec3* normals;
  // rows in cell order, so that neighbours' rows are neighbours
  float* spfh;
  const std::size_t* feature_offset;
  float radius;
  float* values;
  std::uint8_t* valid;
  // per cloud: 1 where the features are given and none are computed
  const std::uint8_t* custom;
};

__global__ void normals_in_cell_order(const std::uint32_t* offset, const GridView* grids,
                                      const Vec3* normals, Vec3* out) {
  const std::uint32_t c = blockIdx.y, begin = offset[c], i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < offset[c + 1] - begin) out[begin + i] = normals[begin + grids[c].index[i]];
}

/// Simplified histograms: a warp per point, a lane per neighbour; the counts are integers, so their
/// order is free. Neighbours wait in a queue until there is one for every lane: less than half of
/// the points of the cells are near.
__global__ void __launch_bounds__(32 * kWarps)
    simplified_histograms(FpfhBatch f, const Vec3* sorted_normals) {
  __shared__ std::uint32_t counts[kWarps][kFpfhSize];
  __shared__ std::uint32_t queue[kWarps][64];
  const std::uint32_t c = blockIdx.y, begin = f.offset[c], size = f.offset[c + 1] - begin;
  const int warp = static_cast<int>(threadIdx.x / 32), lane = static_cast<int>(threadIdx.x % 32);
  const std::uint32_t i = blockIdx.x * kWarps + static_cast<std::uint32_t>(warp);
  if (i >= size || f.custom[c]) return;
  for (int b = lane; b < kFpfhSize; b += 32) counts[warp][b] = 0;
  __syncwarp();
  const GridView grid = f.grids[c];
  const Vec3 p = grid.points[i], n = sorted_normals[begin + i];
  int neighbors = 0;
  if (!is_zero(n)) {
    const auto measure = [&](std::uint32_t k) {
      const Vec3 m = sorted_normals[begin + k];
      if (is_zero(m)) return;
      ++neighbors;
      const PairFeature pair = pair_feature(p, n, grid.points[k], m);
      if (!pair.valid) return;
      for (int h = 0; h < 3; ++h) atomicAdd(&counts[warp][h * kFpfhBins + pair.bins[h]], 1u);
    };
    int queued = 0;
    for_each_neighbor_warp(grid, p, f.radius, [&](std::uint32_t k, float, bool inside) {
      const bool near = inside && k != i;
      const unsigned lanes = __ballot_sync(~0u, near);
      if (near) queue[warp][queued + __popc(lanes & ((1u << lane) - 1))] = k;
      queued += __popc(lanes);
      if (queued < 32) return;
      __syncwarp();
      queued -= 32;
      measure(queue[warp][queued + lane]);
      __syncwarp();
    });
    __syncwarp();
    if (lane < queued) measure(queue[warp][lane]);
    __syncwarp();
    for (int step = 16; step > 0; step /= 2) neighbors += __shfl_xor_sync(~0u, neighbors, step);
  }
  __syncwarp();
  float* row = f.spfh + static_cast<std::size_t>(begin + i) * kFpfhSize;
  for (int b = lane; b < kFpfhSize; b += 32) row[b] = spfh_value(counts[warp][b], neighbors);
}

/// A neighbour and its weight.
struct Neighbor {
  std::uint32_t place;
  float weight;
};

/// FPFH: a warp per point, a lane per bin (all lanes have the 33rd too), neighbours in order.
__global__ void __launch_bounds__(32 * kWarps)
    weighted_histograms(FpfhBatch f, const Vec3* sorted_normals) {
  __shared__ float histogram[kWarps][kFpfhSize];
  __shared__ Neighbor queue[kWarps][64];
  const std::uint32_t c = blockIdx.y, begin = f.offset[c], size = f.offset[c + 1] - begin;
  const int warp = static_cast<int>(threadIdx.x / 32), lane = static_cast<int>(threadIdx.x % 32);
  const std::uint32_t i = blockIdx.x * kWarps + static_cast<std::uint32_t>(warp);
  if (i >= size || f.custom[c]) return;
  const GridView grid = f.grids[c];
  const Vec3 p = grid.points[i];
  float sum = 0.0f, last = 0.0f;
  const bool has_normal = !is_zero(sorted_normals[begin + i]);
  if (has_normal) {
    const float* rows = f.spfh + static_cast<std::size_t>(begin) * kFpfhSize;
    const auto add = [&](Neighbor neighbor) {
      const float* row = rows + static_cast<std::size_t>(neighbor.place) * kFpfhSize;
      sum = fmaf(neighbor.weight, row[lane], sum);
      last = fmaf(neighbor.weight, row[32], last);  // the same for all lanes: one read
    };
    int queued = 0;
    for_each_neighbor_warp(grid, p, f.radius, [&](std::uint32_t k, float d2, bool inside) {
      const bool counts = inside && d2 > 0.0f;
      const unsigned lanes = __ballot_sync(~0u, counts);
      if (counts) queue[warp][queued + __popc(lanes & ((1u << lane) - 1))] = {k, 1.0f / d2};
      queued += __popc(lanes);
      if (queued < 32) return;
      __syncwarp();
      // A known number of rows: the reads of several are under way at a time.
#pragma unroll 4
      for (int j = 0; j < 32; ++j) add(queue[warp][j]);
      queued -= 32;
      const Neighbor rest = queue[warp][32 + lane];
      __syncwarp();
      if (lane < queued) queue[warp][lane] = rest;
    });
    __syncwarp();
#pragma unroll 4
    for (int j = 0; j < queued; ++j) add(queue[warp][j]);
  }
  histogram[warp][lane] = sum;
  if (lane == 0) histogram[warp][32] = last;
  __syncwarp();
  bool valid = false;
  if (lane == 0) valid = has_normal && normalize_fpfh(histogram[warp]);
  __syncwarp();  // lane 0 has changed the histogram
  valid = __shfl_sync(~0u, valid, 0);
  const std::uint32_t at = grid.index[i];
  float* out = f.values + f.feature_offset[c] + static_cast<std::size_t>(at) * kFpfhSize;
  for (int b = lane; b < kFpfhSize; b += 32) out[b] = valid ? histogram[warp][b] : 0.0f;
  if (lane == 0) f.valid[begin + at] = valid;
}

/// Copies the given features; rows that are not finite are never matched.
__global__ void take_features(const std::uint32_t* offset, const std::uint32_t* dimensions,
                              const std::uint8_t* custom, const float* in,
                              const std::size_t* in_offset, const std::size_t* out_offset,
                              float* values, std::uint8_t* valid) {
  const std::uint32_t c = blockIdx.y, begin = offset[c], i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= offset[c + 1] - begin || !custom[c]) return;
  const std::uint32_t dimension = dimensions[c];
  bool finite = true;
  for (std::uint32_t d = 0; d < dimension; ++d) {
    const float v = in[in_offset[c] + static_cast<std::size_t>(i) * dimension + d];
    values[out_offset[c] + static_cast<std::size_t>(i) * dimension + d] = v;
    finite = finite && v - v == 0.0f;
  }
  valid[begin + i] = finite;
}

/// FPFH of one radius for the clouds without given features, each at its offset in `out`.
void describe(Exec& exec, const Segments& segments, const DeviceBuffer<Vec3>& normals,
              const Grids& grids, float radius, const std::size_t* feature_offset,
              const std::uint8_t* custom, Features& out) {
  const unsigned clouds_on_grid = static_cast<unsigned>(segments.entries());
  auto sorted_normals = exec.buffer<Vec3>(segments.total());
  launch(exec, "normals_in_cell_order", normals_in_cell_order,
         shape_for(segments.largest, 256, clouds_on_grid), segments.on_device.data(),
         grids.views.data(), normals.data(), sorted_normals.data());
  auto spfh = exec.buffer<float>(static_cast<std::size_t>(segments.total()) * kFpfhSize);
  FpfhBatch batch{};
  batch.offset = segments.on_device.data();
  batch.grids = grids.views.data();
  batch.normals = normals.data();
  batch.spfh = spfh.data();
  batch.feature_offset = feature_offset;
  batch.radius = radius;
  batch.values = out.values.data();
  batch.valid = out.valid.data();
  batch.custom = custom;
  const dim3 grid(blocks_for(segments.largest, kWarps), clouds_on_grid);
  launch(exec, "simplified_histograms", simplified_histograms, {grid, 32 * kWarps}, batch,
         sorted_normals.data());
  launch(exec, "weighted_histograms", weighted_histograms, {grid, 32 * kWarps}, batch,
         sorted_normals.data());
}

}  // namespace

Features compute_features(Exec& exec, DownsampledClouds& clouds, const DeviceBuffer<Vec3>& normals,
                          const Grids& grids, const PrepareSettings& options) {
  const Segments& segments = clouds.segments;
  const std::size_t count = segments.entries();
  Features out;
  std::vector<std::uint8_t> custom;
  std::vector<std::size_t> in_offset;
  bool any_custom = false, any_fpfh = false;
  out.offset.push_back(0);
  for (std::size_t c = 0; c < count; ++c) {
    const CloudFacts& facts = clouds.facts[c];
    custom.push_back(facts.feature_dimension > 0);
    (custom.back() ? any_custom : any_fpfh) = true;
    out.dimension.push_back(custom.back() ? facts.feature_dimension
                                          : static_cast<std::uint32_t>(kFpfhSize));
    out.offset.push_back(out.offset.back() +
                         static_cast<std::size_t>(segments.size(c)) * out.dimension.back());
    in_offset.push_back(facts.feature_offset);
  }
  out.values = exec.buffer<float>(out.offset.back());
  out.valid = exec.buffer<std::uint8_t>(segments.total());
  if (segments.total() == 0) return out;
  const auto custom_on_device = exec.upload(custom);
  const auto offset_on_device = exec.upload(out.offset);
  if (any_fpfh)
    describe(exec, segments, normals, grids, options.feature_radius, offset_on_device.data(),
             custom_on_device.data(), out);
  if (any_custom) {
    const auto dimension_on_device = exec.upload(out.dimension);
    const auto in_offset_on_device = exec.upload(in_offset);
    launch(exec, "take_features", take_features, shape_for(segments.largest, 256, count),
           segments.on_device.data(), dimension_on_device.data(), custom_on_device.data(),
           clouds.features.data(), in_offset_on_device.data(), offset_on_device.data(),
           out.values.data(), out.valid.data());
  }
  return out;
}

Features compute_wide_features(Exec& exec, const DownsampledClouds& clouds, const Grids& grids,
                               const PrepareSettings& options) {
  const Segments& segments = clouds.segments;
  Features out;
  std::vector<std::uint8_t> custom;
  out.offset.push_back(0);
  for (std::size_t c = 0; c < segments.entries(); ++c) {
    custom.push_back(clouds.facts[c].feature_dimension > 0);
    out.dimension.push_back(options.wide_feature_radius > 0 && !custom.back()
                                ? static_cast<std::uint32_t>(kFpfhSize)
                                : 0);
    out.offset.push_back(out.offset.back() +
                         static_cast<std::size_t>(segments.size(c)) * out.dimension.back());
  }
  if (out.offset.back() == 0) return out;
  out.values = exec.buffer<float>(out.offset.back());
  out.valid = exec.buffer<std::uint8_t>(segments.total());
  const auto custom_on_device = exec.upload(custom);
  const auto offset_on_device = exec.upload(out.offset);
  const auto normals =
      estimate_normals(exec, clouds, grids,
                       wide_normal_radius(options.normal_radius, options.feature_radius,
                                          options.wide_feature_radius));
  describe(exec, segments, normals, grids, options.wide_feature_radius, offset_on_device.data(),
           custom_on_device.data(), out);
  return out;
}

}  // namespace gpureg::cuda
