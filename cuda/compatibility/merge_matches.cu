// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <string>

#include "algorithm/compatibility.hpp"
#include "algorithm/normal_weight.hpp"
#include "algorithm/query_sample.hpp"
#include "common/in_halves.hpp"
#include "cuda/common/feature_query.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/compatibility/sort_matches.hpp"
#include "cuda/device/device_algorithms.hpp"
#include "cuda/device/entry_of.cuh"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 256;

/// One search of a pair.
struct PairSearch {
  QuerySample sample;
  const std::uint32_t *row, *nearest;  ///< per query

  __device__ bool found(std::uint32_t from, std::uint32_t to) const {
    if (sample.count == 0) return false;
    const std::uint32_t place = sample.place_of(from);
    return row[place] == from && nearest[place] == to;
  }
};

/// The searches of one pair in the order of query_samples(), or the given matches.
struct MergePair {
  PairSearch search[4];
  const std::uint32_t *custom_source, *custom_target;
  /// results of all searches one after another, or number of given matches
  std::uint32_t answers;
};

struct MergeBatch {
  const MergePair* pairs;
  const PairView* views;
  std::uint32_t pair_count;
  const std::uint32_t* answer_offset;
  std::uint64_t seed;
  std::uint32_t most;
  std::uint64_t* key;  // pair, whether the result is dropped, order of the match
  std::uint32_t* answer;
  std::uint32_t* found;  // per pair
  std::uint32_t* bins;   // per pair: source, target
  const std::uint32_t* room;
  MatchSets::Columns columns;
  MatchRow* rows;
  std::uint32_t* count;
  std::uint64_t* total;
};

struct Match {
  std::uint32_t source, target;
};

/// Result k of a pair. keep: it is a match that no earlier search has found.
__device__ Match answer_of(const MergePair& u, std::uint32_t k, bool& keep) {
  keep = true;
  if (u.custom_source) return {u.custom_source[k], u.custom_target[k]};
  int number = 0;
  for (; k >= u.search[number].sample.count; ++number) k -= u.search[number].sample.count;
  const std::uint32_t row = u.search[number].row[k], near = u.search[number].nearest[k];
  const Match m = number % 2 == 0 ? Match{row, near} : Match{near, row};
  keep = near != kNoValue;
  for (int earlier = 0; keep && earlier < number; ++earlier)
    keep = earlier % 2 == 0 ? !u.search[earlier].found(m.source, m.target)
                            : !u.search[earlier].found(m.target, m.source);
  return m;
}

/// y: search.
__global__ void write_query_rows(const QuerySample* samples, const std::uint32_t* offset,
                                 std::uint32_t* row) {
  const QuerySample sample = samples[blockIdx.y];
  const std::uint32_t k = blockIdx.x * blockDim.x + threadIdx.x;
  if (k < sample.count) row[offset[blockIdx.y] + k] = sample.row(k);
}

__global__ void __launch_bounds__(kThreads) order_matches(MergeBatch b) {
  __shared__ std::uint32_t kept;
  const std::uint32_t p = blockIdx.y, k = blockIdx.x * kThreads + threadIdx.x;
  const MergePair u = b.pairs[p];
  if (threadIdx.x == 0) kept = 0;
  __syncthreads();
  bool keep = false;
  if (k < u.answers) {
    const Match m = answer_of(u, k, keep);
    const std::uint64_t order = keep ? match_order(m.source, m.target, b.seed) : 0xffffffffu;
    const std::size_t at = b.answer_offset[p] + k;
    b.key[at] =
        static_cast<std::uint64_t>(p) << 33 | static_cast<std::uint64_t>(!keep) << 32 | order;
    b.answer[at] = k;
  }
  const unsigned mask = __ballot_sync(~0u, keep);
  if (threadIdx.x % 32 == 0 && mask != 0)
    atomicAdd(&kept, static_cast<std::uint32_t>(__popc(static_cast<int>(mask))));
  __syncthreads();
  if (threadIdx.x == 0 && kept > 0) atomicAdd(b.found + p, kept);
}

/// Writes the first matches of every pair, and counts the directions of their normals.
__global__ void __launch_bounds__(kThreads) gather_matches(MergeBatch b) {
  __shared__ std::uint32_t bins[2 * kNormalBins];
  const std::uint32_t p = blockIdx.y, k = blockIdx.x * kThreads + threadIdx.x;
  const std::uint32_t found = b.found[p], count = min(found, b.most);
  if (blockIdx.x * kThreads >= count) return;
  if (threadIdx.x < 2 * kNormalBins) bins[threadIdx.x] = 0;
  __syncthreads();
  if (k < count) {
    const MergePair u = b.pairs[p];
    const CloudView &s = b.views[p].source, &t = b.views[p].target;
    const std::uint64_t* key = b.key + b.answer_offset[p];
    const std::uint32_t* answer = b.answer + b.answer_offset[p];
    // Matches of equal order, which are rare, sort by their indices: this position takes the one
    // with as many before it.
    std::uint32_t begin = k, end = k + 1;
    while (begin > 0 && key[begin - 1] == key[k]) --begin;
    while (end < found && key[end] == key[k]) ++end;
    bool keep;
    Match m = answer_of(u, answer[k], keep);
    for (std::uint32_t a = begin; a < end && end - begin > 1; ++a) {
      const Match one = answer_of(u, answer[a], keep);
      std::uint32_t before = 0;
      for (std::uint32_t o = begin; o < end; ++o) {
        const Match other = answer_of(u, answer[o], keep);
        before +=
            other.source < one.source || (other.source == one.source && other.target < one.target);
      }
      if (before == k - begin) m = one;
    }
    const std::size_t at = b.room[p] + k;
    const auto set = [&](float* x, float* y, float* z, Vec3 value) {
      x[at] = value.x;
      y[at] = value.y;
      z[at] = value.z;
    };
    const Vec3 source_point = s.points[m.source], target_point = t.points[m.target],
               source_normal = s.normals[m.source], target_normal = t.normals[m.target];
    const MatchSets::Columns& to = b.columns;
    set(to.px, to.py, to.pz, source_point);
    set(to.qx, to.qy, to.qz, target_point);
    set(to.mx, to.my, to.mz, source_normal);
    set(to.nx, to.ny, to.nz, target_normal);
    const std::uint32_t source_bin = normal_bin(source_normal),
                        target_bin = normal_bin(target_normal);
    to.source[at] = m.source;
    to.target[at] = m.target;
    to.source_weight[at] = source_bin;
    to.target_weight[at] = target_bin;
    atomicAdd(bins + source_bin, 1u);
    atomicAdd(bins + kNormalBins + target_bin, 1u);
  }
  __syncthreads();
  if (threadIdx.x < 2 * kNormalBins && bins[threadIdx.x] > 0)
    atomicAdd(b.bins + p * 2 * kNormalBins + threadIdx.x, bins[threadIdx.x]);
}

/// Weights from the counts of directions; rows.
__global__ void __launch_bounds__(kThreads) weight_matches_by_normals(MergeBatch b) {
  __shared__ std::uint32_t weight[2 * kNormalBins];
  const std::uint32_t p = blockIdx.y, count = min(b.found[p], b.most);
  const std::uint32_t* bins = b.bins + p * 2 * kNormalBins;
  if (threadIdx.x < 2 * kNormalBins) weight[threadIdx.x] = normal_weight_in_bin(bins[threadIdx.x]);
  __syncthreads();
  const std::uint32_t k = blockIdx.x * kThreads + threadIdx.x;
  if (k < count) {
    const std::uint32_t at = b.room[p] + k;
    const MatchSets::Columns& m = b.columns;
    const std::uint32_t source = weight[m.source_weight[at]],
                        target = weight[kNormalBins + m.target_weight[at]];
    m.source_weight[at] = source;
    m.target_weight[at] = target;
    MatchRow& row = b.rows[at];
    row.points[0] = make_float4(m.px[at], m.py[at], m.pz[at], m.qx[at]);
    row.points[1] = make_float4(m.qy[at], m.qz[at], __uint_as_float(source + target), 0.0f);
    row.normals[0] = make_float4(m.mx[at], m.my[at], m.mz[at], m.nx[at]);
    row.normals[1] = make_float4(m.ny[at], m.nz[at], 0.0f, 0.0f);
  }
  if (k != 0) return;
  b.count[p] = count;
  for (int side = 0; side < 2; ++side) {
    std::uint64_t total = 0;
    for (int bin = side * kNormalBins; bin < (side + 1) * kNormalBins; ++bin)
      total += static_cast<std::uint64_t>(bins[bin]) * weight[bin];
    b.total[2 * p + static_cast<std::uint32_t>(side)] = total;
  }
}

/// The given matches, without duplicates.
std::vector<std::uint64_t> distinct_matches(const PairView& pair) {
  std::vector<std::uint64_t> out;
  for (std::uint32_t k = 0; k < pair.custom_count; ++k)
    out.push_back(static_cast<std::uint64_t>(pair.custom_source[k]) << 32 | pair.custom_target[k]);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

/// Queries of all searches of the batch and their results.
struct Answers {
  DeviceBuffer<std::uint32_t> rows, nearest;
};

/// Runs all searches of the batch and sets those of each pair.
Answers search(Exec& exec, Span<const PairView> pairs, const RegistrationSettings& options,
               std::vector<MergePair>& entries) {
  std::vector<FeatureQuery> queries;
  std::vector<QuerySample> samples;
  std::vector<std::uint32_t> offset;
  std::vector<PairSearch*> searches;
  std::uint64_t at = 0;
  std::uint32_t largest = 0;
  const auto ask = [&](FeatureQuery query, const QuerySample& sample, MergePair& pair, int number) {
    query.out = static_cast<std::uint32_t>(at);
    query.query_count = sample.count;
    queries.push_back(query);
    samples.push_back(sample);
    offset.push_back(query.out);
    searches.push_back(&pair.search[number]);
    pair.search[number].sample = sample;
    pair.answers += sample.count;
    largest = std::max(largest, sample.count);
    at += sample.count;
    if (at > limits::kMaxPoints)
      throw BatchTooLarge("a batch of " + std::to_string(at) +
                          " feature queries exceeds 2^31 - 1: split it");
  };
  for (std::size_t p = 0; p < pairs.size; ++p) {
    const CloudView &s = pairs[p].source, &t = pairs[p].target;
    if (pairs[p].custom_count > 0 || s.size == 0 || t.size == 0) continue;
    const bool both = s.wide_features && t.wide_features;
    const auto sample = query_samples(s.size, t.size, both ? 4 : 2,
                                      options.compatibility.max_matches, options.seed);
    ask(narrow_query(s, t, 0), sample[0], entries[p], 0);
    ask(narrow_query(t, s, 0), sample[1], entries[p], 1);
    if (!both) continue;
    ask(wide_query(s, t, 0), sample[2], entries[p], 2);
    ask(wide_query(t, s, 0), sample[3], entries[p], 3);
  }
  Answers out;
  if (at == 0) return out;
  out.rows = exec.buffer<std::uint32_t>(at);
  const auto samples_on_device = exec.upload(samples);
  const auto offset_on_device = exec.upload(offset);
  launch(exec, "write_query_rows", write_query_rows, shape_for(largest, kThreads, samples.size()),
         samples_on_device.data(), offset_on_device.data(), out.rows.data());
  for (std::size_t k = 0; k < queries.size(); ++k)
    queries[k].query_row = out.rows.data() + offset[k];
  out.nearest = nearest_features(exec, queries, 1, static_cast<std::size_t>(at));
  for (std::size_t k = 0; k < searches.size(); ++k) {
    searches[k]->row = out.rows.data() + offset[k];
    searches[k]->nearest = out.nearest.data() + offset[k];
  }
  return out;
}

}  // namespace

MatchSets merge_matches(Exec& exec, Span<const PairView> pairs,
                        const RegistrationSettings& options) {
  std::vector<MergePair> entries(pairs.size);
  const auto answers = search(exec, pairs, options, entries);
  std::vector<DeviceBuffer<std::uint32_t>> custom;
  for (std::size_t p = 0; p < pairs.size; ++p) {
    if (pairs[p].custom_count == 0) continue;
    std::vector<std::uint32_t> source, target;
    for (const std::uint64_t match : distinct_matches(pairs[p])) {
      source.push_back(static_cast<std::uint32_t>(match >> 32));
      target.push_back(static_cast<std::uint32_t>(match));
    }
    custom.push_back(exec.upload(source));
    entries[p].custom_source = custom.back().data();
    custom.push_back(exec.upload(target));
    entries[p].custom_target = custom.back().data();
    entries[p].answers = static_cast<std::uint32_t>(source.size());
  }
  const Segments answer_segments =
      make_segments(exec, pairs.size, [&](std::size_t p) { return entries[p].answers; });

  MatchSets out;
  out.room = make_segments(exec, pairs.size, [&](std::size_t p) {
    return std::min(entries[p].answers, options.compatibility.max_matches);
  });
  const std::size_t room = out.room.total();
  out.reals = exec.buffer<float>(room * MatchSets::Columns::kReals);
  out.integers = exec.buffer<std::uint32_t>(room * MatchSets::Columns::kIntegers);
  out.rows = exec.buffer<MatchRow>(room);
  out.count = exec.filled<std::uint32_t>(pairs.size, 0);
  out.total = exec.filled<std::uint64_t>(2 * pairs.size, 0);
  if (answer_segments.total() == 0) return out;
  const auto merge_on_device = exec.upload(entries);
  const auto views = exec.upload(pairs.data, pairs.size);
  auto key = exec.buffer<std::uint64_t>(answer_segments.total());
  auto answer = exec.buffer<std::uint32_t>(answer_segments.total());
  const auto found = exec.filled<std::uint32_t>(pairs.size, 0);
  const auto bins = exec.filled<std::uint32_t>(pairs.size * 2 * kNormalBins, 0);
  MergeBatch batch{};
  batch.pairs = merge_on_device.data();
  batch.views = views.data();
  batch.pair_count = static_cast<std::uint32_t>(pairs.size);
  batch.answer_offset = answer_segments.on_device.data();
  batch.seed = options.seed;
  batch.most = options.compatibility.max_matches;
  batch.key = key.data();
  batch.answer = answer.data();
  batch.found = found.data();
  batch.bins = bins.data();
  batch.room = out.room.on_device.data();
  batch.columns = out.columns();
  batch.rows = out.rows.data();
  batch.count = out.count.data();
  batch.total = out.total.data();
  const unsigned pair_count = static_cast<unsigned>(pairs.size);
  launch(exec, "order_matches", order_matches,
         shape_for(answer_segments.largest, kThreads, pair_count), batch);
  if (!sort_matches(exec, answer_segments, found.data(), key.data(), answer.data())) {
    constexpr int kOrderBits = 32 + 1;  // order of the match, whether it is dropped
    sort_pairs(exec, key, answer, kOrderBits + bits_for(pairs.size));
    batch.key = key.data();
    batch.answer = answer.data();
  }
  const dim3 grid(blocks_for(out.room.largest, kThreads), pair_count);
  launch(exec, "gather_matches", gather_matches, {grid, kThreads}, batch);
  launch(exec, "weight_matches_by_normals", weight_matches_by_normals, {grid, kThreads}, batch);
  return out;
}

}  // namespace gpureg::cuda
