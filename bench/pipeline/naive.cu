// SPDX-License-Identifier: BSD-3-Clause
#include "naive.hpp"

#include <cuda_runtime_api.h>

#include <string>

#include "algorithm/fit.hpp"
#include "algorithm/inlier.hpp"
#include "algorithm/quadruple.hpp"
#include "cuda/common/nearest_feature.hpp"
#include "cuda/common/prepared_cloud.hpp"
#include "cuda/device/launch.cuh"
#include "gpureg/error.hpp"

namespace gpureg::bench {
namespace {

using cuda::check;
using cuda::launch;

constexpr int kThreads = 256;

/// Feature matching: a thread per source point walks over all target features.
__global__ void match(CloudView source, CloudView target, MatchedPoints* matches,
                      std::uint32_t* count) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= source.size || !source.has_feature[i]) return;
  const std::uint32_t dimension = source.feature_dimension, stride = cuda::row_stride(dimension);
  const float* query = source.features + static_cast<std::size_t>(i) * stride;
  float best = 3.402823466e38f;
  std::uint32_t nearest = kNoValue;
  for (std::uint32_t j = 0; j < target.size; ++j) {
    if (!target.has_feature[j]) continue;
    const float* row = target.features + static_cast<std::size_t>(j) * stride;
    float sum = 0.0f;
    for (std::uint32_t d = 0; d < dimension; ++d)
      sum = fmaf(query[d] - row[d], query[d] - row[d], sum);
    if (sum < best) {
      best = sum;
      nearest = j;
    }
  }
  if (nearest == kNoValue) return;
  // In order of the source: Algorithm 1 draws from a list.
  std::uint32_t before = 0;
  for (std::uint32_t k = 0; k < i; ++k) before += source.has_feature[k];
  matches[before] = {source.points[i], target.points[nearest], i, nearest};
  atomicAdd(count, 1u);
}

/// Sampling and the polygon test: a thread per hypothesis.
__global__ void sample(const MatchedPoints* m, const std::uint32_t* match_count,
                       std::uint32_t hypotheses, std::uint64_t seed, float tau2,
                       std::uint32_t* survivors, std::uint32_t* count) {
  const std::uint32_t h = blockIdx.x * blockDim.x + threadIdx.x;
  if (h >= hypotheses || *match_count < 4) return;
  const Quadruple q = draw_quadruple(h, seed, *match_count);
  if (passes_polygon_test(m[q.match[0]], m[q.match[1]], m[q.match[2]], m[q.match[3]], tau2))
    survivors[atomicAdd(count, 1u)] = h;
}

__global__ void fit(const MatchedPoints* m, const std::uint32_t* match_count,
                    const std::uint32_t* survivors, std::uint32_t count, std::uint64_t seed,
                    Pose<float>* poses, std::uint8_t* valid) {
  const std::uint32_t k = blockIdx.x * blockDim.x + threadIdx.x;
  if (k >= count) return;
  const Quadruple q = draw_quadruple(survivors[k], seed, *match_count);
  Vec3 source[4], target[4];
  for (int c = 0; c < 4; ++c) {
    source[c] = m[q.match[c]].source;
    target[c] = m[q.match[c]].target;
  }
  Pose<float> pose = identity_pose<float>();
  valid[k] = fit_rigid(source, target, pose);
  poses[k] = pose;
}

/// Consensus: a thread block per hypothesis, a parallel reduction over the points, each looked up
/// in the 3-D grid.
__global__ void __launch_bounds__(kThreads)
    score(CloudView source, CloudView target, InlierTest test, const Pose<float>* poses,
          const std::uint8_t* valid, const std::uint32_t* survivors, Support* out) {
  __shared__ std::uint32_t inliers[kThreads];
  __shared__ unsigned long long residual[kThreads];
  const std::uint32_t k = blockIdx.x;
  std::uint32_t count = 0;
  unsigned long long sum = 0;
  if (valid[k]) {
    const Rigid rigid = to_rigid(poses[k]);
    for (std::uint32_t i = threadIdx.x; i < source.size; i += kThreads) {
      const Closest c = find_closest(target.closest, target.points, apply(rigid, source.points[i]),
                                     test.max_squared);
      if (c.index == kNoValue || !normals_agree(rotate(rigid, source.normals[i]),
                                                target.normals[c.index], test.min_cosine))
        continue;
      ++count;
      sum += fixed_residual(c.squared_distance, test.inverse_max_squared);
    }
  }
  inliers[threadIdx.x] = count;
  residual[threadIdx.x] = sum;
  for (int half = kThreads / 2; half > 0; half /= 2) {
    __syncthreads();
    if (static_cast<int>(threadIdx.x) >= half) continue;
    inliers[threadIdx.x] += inliers[threadIdx.x + half];
    residual[threadIdx.x] += residual[threadIdx.x + half];
  }
  if (threadIdx.x == 0) out[k] = {inliers[0], survivors[k], residual[0]};
}

template <typename T>
class Array {
 public:
  explicit Array(std::size_t size) {
    check(cudaMalloc(reinterpret_cast<void**>(&data_), (size + 1) * sizeof(T)), "cudaMalloc");
  }
  ~Array() { cudaFree(data_); }
  Array(const Array&) = delete;
  Array& operator=(const Array&) = delete;
  T* data() const { return data_; }

 private:
  T* data_ = nullptr;
};

}  // namespace

struct Naive::Arrays {
  explicit Arrays(std::size_t points, std::size_t hypotheses)
      : matches(points),
        counts(2),
        survivors(hypotheses),
        poses(hypotheses),
        valid(hypotheses),
        supports(hypotheses) {}
  Array<MatchedPoints> matches;
  Array<std::uint32_t> counts, survivors;
  Array<Pose<float>> poses;
  Array<std::uint8_t> valid;
  Array<Support> supports;
};

Naive::Naive(std::size_t most_points, const RegistrationSettings& options)
    : options_(options), arrays_(std::make_unique<Arrays>(most_points, options.quadruples.count)) {}
Naive::~Naive() = default;

const ClosestGridView& Naive::grid_of(const PreparedState& cloud) {
  std::unique_ptr<HashGrid>& grid = grids_[&cloud];
  if (!grid) grid = std::make_unique<HashGrid>(cloud);
  return grid->view();
}

NaiveResult Naive::align(const PreparedState& source_state, const PreparedState& target_state) {
  const auto source_copy = static_cast<const cuda::PreparedCloud&>(source_state).on(0),
             target_copy = static_cast<const cuda::PreparedCloud&>(target_state).on(0);
  if (!source_copy || !target_copy)
    throw InvalidArgument("the naive mode wants both clouds on device 0");
  CloudView source = source_copy->view_on_device, target = target_copy->view_on_device;
  source.closest = grid_of(source_state);
  target.closest = grid_of(target_state);
  if (options_.smaller_as_source && target.size < source.size) std::swap(source, target);
  Arrays& a = *arrays_;
  const QuadrupleSettings& o = options_.quadruples;
  std::uint32_t* match_count = a.counts.data();
  const auto blocks = [](std::size_t items) {
    return static_cast<unsigned>((items + kThreads - 1) / kThreads);
  };
  check(cudaMemset(match_count, 0, 2 * sizeof(std::uint32_t)), "cudaMemset");
  const cudaStream_t stream{};
  launch(stream, "match", match, {blocks(source.size), kThreads}, source, target, a.matches.data(),
         match_count);
  launch(stream, "sample", sample, {blocks(o.count), kThreads}, a.matches.data(), match_count,
         o.count, options_.seed, o.edge_similarity * o.edge_similarity, a.survivors.data(),
         match_count + 1);
  NaiveResult result{};
  check(
      cudaMemcpy(&result.survivors, match_count + 1, sizeof(std::uint32_t), cudaMemcpyDeviceToHost),
      "cudaMemcpy");
  if (result.survivors == 0) return result;
  launch(stream, "fit", fit, {blocks(result.survivors), kThreads}, a.matches.data(), match_count,
         a.survivors.data(), result.survivors, options_.seed, a.poses.data(), a.valid.data());
  launch(stream, "score", score, {result.survivors, kThreads}, source, target,
         inlier_test(options_.prepare.max_correspondence_distance,
                     options_.quadruples.max_normal_angle),
         a.poses.data(), a.valid.data(), a.survivors.data(), a.supports.data());
  supports_.resize(result.survivors);
  check(cudaMemcpy(supports_.data(), a.supports.data(), result.survivors * sizeof(Support),
                   cudaMemcpyDeviceToHost),
        "cudaMemcpy");
  result.best = supports_[0];
  for (const Support& s : supports_)
    if (better(s, result.best)) result.best = s;
  return result;
}

}  // namespace gpureg::bench
