// SPDX-License-Identifier: BSD-3-Clause
#include "nearest_feature.hpp"
#include "stages.hpp"
#include "warp.cuh"

namespace gpureg::cuda {
namespace {

struct MatchBatch {
  const PairView* pairs;
  const std::uint32_t* query_offset;    // of the pairs' forward answers, k per query
  const std::uint32_t* forward;
  const std::uint32_t* backward_offset;
  const std::uint32_t* backward;        // null: not mutual
  std::uint32_t k;
  const std::uint32_t* room;
  MatchedPoints* out;
  std::uint32_t* count;
};

/// A thread block per pair writes its matches in order, a tile of answers at a time.
__global__ void __launch_bounds__(1024) collect_matches(MatchBatch m) {
  __shared__ std::uint32_t warp_count[32];
  __shared__ std::uint32_t written;
  const std::uint32_t p = blockIdx.x;
  const PairView& pair = m.pairs[p];
  MatchedPoints* out = m.out + m.room[p];
  const bool custom = pair.custom_count > 0;
  const std::uint32_t answers = custom ? pair.custom_count : m.query_offset[p + 1] - m.query_offset[p];
  const std::uint32_t lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  if (threadIdx.x == 0) written = 0;
  for (std::uint32_t base = 0; base < answers; base += 1024) {
    const std::uint32_t a = base + threadIdx.x;
    std::uint32_t source = 0, target = kNoValue;
    if (a < answers) {
      source = custom ? pair.custom_source[a] : a / m.k;
      target = custom ? pair.custom_target[a] : m.forward[m.query_offset[p] + a];
      if (!custom && m.backward && target != kNoValue && m.backward[m.backward_offset[p] + target] != source) target = kNoValue;
    }
    const bool keep = target != kNoValue;
    const unsigned mask = __ballot_sync(~0u, keep);
    if (lane == 0) warp_count[warp] = static_cast<std::uint32_t>(__popc(static_cast<int>(mask)));
    __syncthreads();
    std::uint32_t before = written;
    for (std::uint32_t w = 0; w < warp; ++w) before += warp_count[w];
    if (keep)
      out[before + static_cast<std::uint32_t>(__popc(static_cast<int>(mask & ((1u << lane) - 1))))] = {
          pair.source.points[source], pair.target.points[target], source, target};
    __syncthreads();
    if (threadIdx.x == 1023) written = before + warp_count[31];
    __syncthreads();
  }
  if (threadIdx.x == 0) m.count[p] = written;
}

FeatureQuery query(const CloudView& from, const CloudView& in, std::uint32_t out) {
  const auto &a = *static_cast<const CudaCloud*>(from.executor_data), &b = *static_cast<const CudaCloud*>(in.executor_data);
  return {from.features, from.has_feature, from.size, in.features, in.has_feature, in.size, from.feature_dimension, out,
          a.feature_norm, b.feature_norm, a.feature_tf32, b.feature_tf32, a.feature_padded, b.feature_padded};
}

}  // namespace

Matches match_features(Exec& exec, Span<const PairView> pairs, const HypothesisOptions& options) {
  const std::uint32_t k = options.neighbors;
  const auto asks = [&](std::size_t p) { return pairs[p].custom_count == 0 && pairs[p].source.size > 0 && pairs[p].target.size > 0; };
  const Segments forward_segments = make_segments(exec, pairs.size, [&](std::size_t p) { return asks(p) ? std::size_t(pairs[p].source.size) * k : 0; });
  std::vector<FeatureQuery> forward, backward;
  for (std::size_t p = 0; p < pairs.size; ++p) {
    if (!asks(p)) continue;
    const CloudView &s = pairs[p].source, &t = pairs[p].target;
    forward.push_back(query(s, t, forward_segments.offset[p]));
  }
  MatchBatch batch{};
  const auto forward_answers = nearest_features(exec, forward, k, forward_segments.total());
  Segments backward_segments;
  DeviceBuffer<std::uint32_t> backward_answers;
  if (options.mutual) {
    backward_segments = make_segments(exec, pairs.size, [&](std::size_t p) { return asks(p) ? pairs[p].target.size : 0; });
    for (std::size_t p = 0; p < pairs.size; ++p) {
      if (!asks(p)) continue;
      const CloudView &s = pairs[p].source, &t = pairs[p].target;
      backward.push_back(query(t, s, backward_segments.offset[p]));
    }
    backward_answers = nearest_features(exec, backward, 1, backward_segments.total());
    batch.backward_offset = backward_segments.on_device.data();
    batch.backward = backward_answers.data();
  }
  Matches out;
  out.room = make_segments(exec, pairs.size, [&](std::size_t p) { return std::max(pairs[p].custom_count, forward_segments.size(p)); });
  out.pairs = exec.buffer<MatchedPoints>(out.room.total());
  out.count = exec.buffer<std::uint32_t>(pairs.size);
  // The caller's own correspondences lie in host memory.
  std::vector<PairView> views(pairs.begin(), pairs.end());
  std::vector<DeviceBuffer<std::uint32_t>> custom;
  for (PairView& view : views) {
    if (view.custom_count == 0) continue;
    custom.push_back(exec.upload(view.custom_source, view.custom_count));
    view.custom_source = custom.back().data();
    custom.push_back(exec.upload(view.custom_target, view.custom_count));
    view.custom_target = custom.back().data();
  }
  const auto views_on_device = exec.upload(views);
  batch.pairs = views_on_device.data();
  batch.query_offset = forward_segments.on_device.data();
  batch.forward = forward_answers.data();
  batch.k = k;
  batch.room = out.room.on_device.data();
  batch.out = out.pairs.data();
  batch.count = out.count.data();
  collect_matches<<<static_cast<unsigned>(pairs.size), 1024, 0, exec.stream()>>>(batch);
  check_launch("collect_matches");
  return out;
}

}  // namespace gpureg::cuda
