// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/feature_query.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"

namespace gpureg::cuda {
namespace {

struct MatchBatch {
  const PairView* pairs;
  const std::uint32_t* query_offset;  // of the forward results of the pairs, k per query
  const std::uint32_t* forward;
  const std::uint32_t* backward_offset;
  const std::uint32_t* backward;  // null: without the mutual test
  std::uint32_t k;
  const std::uint32_t* room;
  MatchedPoints* out;
  std::uint32_t* count;
};

constexpr std::uint32_t kTile = 1024;

/// Result `a` of the search of a pair as a match; false where there is none.
__device__ bool match_of(const MatchBatch& m, const PairView& pair, std::uint32_t p,
                         std::uint32_t a, std::uint32_t& source, std::uint32_t& target) {
  if (pair.custom_count > 0) {
    source = pair.custom_source[a];
    target = pair.custom_target[a];
    return true;
  }
  source = a / m.k;
  target = m.forward[m.query_offset[p] + a];
  return target != kNoValue && (!m.backward || m.backward[m.backward_offset[p] + target] == source);
}

/// Sum over the thread block. All threads get it.
__device__ std::uint32_t sum_of_block(std::uint32_t mine, std::uint32_t* warp_sums) {
  mine = warp_sum(mine);
  __syncthreads();
  if (threadIdx.x % 32 == 0) warp_sums[threadIdx.x / 32] = mine;
  __syncthreads();
  return warp_sum(warp_sums[threadIdx.x % 32]);
}

/// A thread block per tile of the search results of a pair (blockIdx.x) writes its matches in
/// order. It counts the matches of earlier tiles itself, which is faster than waiting for their
/// blocks.
__global__ void __launch_bounds__(kTile) collect_matches(MatchBatch m) {
  __shared__ std::uint32_t warp_sums[32];
  const std::uint32_t p = blockIdx.y, tile = blockIdx.x;
  const PairView& pair = m.pairs[p];
  const std::uint32_t answers =
      pair.custom_count > 0 ? pair.custom_count : m.query_offset[p + 1] - m.query_offset[p];
  if (tile * kTile >= answers && tile > 0) return;
  std::uint32_t source, target, mine = 0;
  for (std::uint32_t a = threadIdx.x; a < tile * kTile; a += kTile)
    mine += match_of(m, pair, p, a, source, target);
  const std::uint32_t before = sum_of_block(mine, warp_sums);
  const std::uint32_t a = tile * kTile + threadIdx.x, lane = threadIdx.x % 32;
  const bool keep = a < answers && match_of(m, pair, p, a, source, target);
  const unsigned mask = __ballot_sync(~0u, keep);
  const std::uint32_t all = sum_of_block(
      lane == 0 ? static_cast<std::uint32_t>(__popc(static_cast<int>(mask))) : 0, warp_sums);
  std::uint32_t at =
      before + static_cast<std::uint32_t>(__popc(static_cast<int>(mask & ((1u << lane) - 1))));
  for (std::uint32_t w = 0; w < threadIdx.x / 32; ++w) at += warp_sums[w];
  if (keep)
    m.out[m.room[p] + at] = {pair.source.points[source], pair.target.points[target], source,
                             target};
  if (threadIdx.x == 0 && (tile + 1) * kTile >= answers) m.count[p] = before + all;
}

}  // namespace

Matches match_features(Exec& exec, Span<const PairView> pairs,
                       const RegistrationSettings& options) {
  const std::uint32_t k = options.quadruples.neighbors;
  const auto asks = [&](std::size_t p) {
    return pairs[p].custom_count == 0 && pairs[p].source.size > 0 && pairs[p].target.size > 0;
  };
  const Segments forward_segments = make_segments(exec, pairs.size, [&](std::size_t p) {
    return asks(p) ? std::size_t(pairs[p].source.size) * k : 0;
  });
  std::vector<FeatureQuery> forward, backward;
  for (std::size_t p = 0; p < pairs.size; ++p) {
    if (!asks(p)) continue;
    const CloudView &s = pairs[p].source, &t = pairs[p].target;
    forward.push_back(narrow_query(s, t, forward_segments.offset[p]));
  }
  MatchBatch batch{};
  const auto forward_answers = nearest_features(exec, forward, k, forward_segments.total());
  Segments backward_segments;
  DeviceBuffer<std::uint32_t> backward_answers;
  if (options.quadruples.mutual) {
    backward_segments = make_segments(
        exec, pairs.size, [&](std::size_t p) { return asks(p) ? pairs[p].target.size : 0; });
    for (std::size_t p = 0; p < pairs.size; ++p) {
      if (!asks(p)) continue;
      const CloudView &s = pairs[p].source, &t = pairs[p].target;
      backward.push_back(narrow_query(t, s, backward_segments.offset[p]));
    }
    backward_answers = nearest_features(exec, backward, 1, backward_segments.total());
    batch.backward_offset = backward_segments.on_device.data();
    batch.backward = backward_answers.data();
  }
  Matches out;
  out.room = make_segments(exec, pairs.size, [&](std::size_t p) {
    return std::max(pairs[p].custom_count, forward_segments.size(p));
  });
  out.pairs = exec.buffer<MatchedPoints>(out.room.total());
  out.count = exec.buffer<std::uint32_t>(pairs.size);
  // Given correspondences are in host memory.
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
  launch(exec, "collect_matches", collect_matches,
         {{std::max(1u, blocks_for(out.room.largest, kTile)), static_cast<unsigned>(pairs.size)},
          kTile},
         batch);
  return out;
}

}  // namespace gpureg::cuda
