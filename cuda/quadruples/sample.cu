// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/stages.hpp"
#include "cuda/device/device_algorithms.hpp"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"

namespace gpureg::cuda {
namespace {

constexpr std::uint32_t kThreads = 1024;
// Words per chunk, of 32 hypotheses each; chunks are counted, then expanded, one by one.
constexpr std::uint32_t kWordsPerChunk = 1024;
/// Memory for the survivors of the pairs that go on together.
constexpr std::uint64_t kSurvivorMemory = std::uint64_t(2) << 30;
static_assert(limits::kMaxQuadruples <= 0x80000000u - 32 * kWordsPerChunk,
              "numbers of hypotheses fit 32 bits in whole chunks");

struct SampleBatch {
  const std::uint32_t* room;
  const MatchedPoints* matches;
  const std::uint32_t* count;
  std::uint32_t hypotheses, chunks;
  std::uint64_t seed;
  float tau2;
  std::uint32_t* words;        // pairs x chunks x kWordsPerChunk: one bit per hypothesis
  std::uint32_t* chunk_count;  // pairs x chunks
};

/// Source of the points of a match: shared memory, or global memory where there are too many.
struct SharedPoints {
  const float4* a;  // source x, y, z, target x
  const float2* b;  // target y, z
  __device__ void get(std::uint32_t i, Vec3& source, Vec3& target) const {
    const float4 v = a[i];
    const float2 w = b[i];
    source = {v.x, v.y, v.z};
    target = {v.w, w.x, w.y};
  }
};
struct GlobalPoints {
  const MatchedPoints* m;
  __device__ void get(std::uint32_t i, Vec3& source, Vec3& target) const {
    source = m[i].source;
    target = m[i].target;
  }
};

struct Corner {
  Vec3 source, target;
};

template <typename Points>
__device__ Corner corner(const Points& points, std::uint32_t i) {
  Corner c;
  points.get(i, c.source, c.target);
  return c;
}

/// similar_sides() of two corners.
__device__ bool similar(const Corner& a, const Corner& b, float tau2) {
  const float p = squared_norm(a.source - b.source), q = squared_norm(a.target - b.target);
  return p >= tau2 * q && q >= tau2 * p;
}

/// The first side of passes_polygon_test(), which most hypotheses fail, needs two matches only.
template <typename Points>
__device__ bool first_side_passes(const Points& points, const Quadruple& q, float tau2) {
  return similar(corner(points, q.match[0]), corner(points, q.match[1]), tau2);
}

/// The remaining sides. Global matches hold the indices that identify repeated source points.
template <typename Points>
__device__ bool other_sides_pass(const Points& points, const MatchedPoints* m, const Quadruple& q,
                                 float tau2) {
  const Corner c1 = corner(points, q.match[1]), c2 = corner(points, q.match[2]);
  if (!similar(c1, c2, tau2)) return false;
  const Corner c3 = corner(points, q.match[3]);
  if (!similar(c2, c3, tau2) || !similar(c3, corner(points, q.match[0]), tau2)) return false;
  const std::uint32_t a = m[q.match[0]].source_index, b = m[q.match[1]].source_index,
                      c = m[q.match[2]].source_index, d = m[q.match[3]].source_index;
  return a != b && a != c && a != d && b != c && b != d && c != d;
}

/// Shared memory of a warp.
struct WarpQueue {
  std::uint32_t waiting[64];  ///< hypotheses whose first side passes
  std::uint32_t words[32];    ///< one bit per hypothesis: passes
};

/// A warp draws 1,024 hypotheses; each lane gets one of its 32 words, one bit per passing
/// hypothesis. Hypotheses that pass the first side wait in a queue until there is one for every
/// lane: one in eight passes, and without the queue the other lanes idle during three further
/// sides.
__device__ std::uint32_t draw_word(const SampleBatch& s, const SharedPoints& points,
                                   const MatchedPoints* m, std::uint32_t count, std::uint32_t first,
                                   WarpQueue& queue) {
  const std::uint32_t lane = threadIdx.x % 32;
  queue.words[lane] = 0;
  __syncwarp();
  const auto settle = [&](std::uint32_t size) {
    if (lane >= size) return;
    const std::uint32_t hypothesis = queue.waiting[lane];
    if (other_sides_pass(points, m, draw_quadruple(hypothesis, s.seed, count), s.tau2))
      atomicOr(&queue.words[(hypothesis - first) / 32], 1u << hypothesis % 32);
  };
  std::uint32_t waiting = 0;
#pragma unroll 2
  for (std::uint32_t k = 0; k < 32; ++k) {
    const std::uint32_t hypothesis = first + k * 32 + lane;
    const bool pass = hypothesis < s.hypotheses &&
                      first_side_passes(points, draw_quadruple(hypothesis, s.seed, count), s.tau2);
    const unsigned passing = __ballot_sync(~0u, pass);
    if (pass)
      queue.waiting[waiting + static_cast<std::uint32_t>(__popc(
                                  static_cast<int>(passing & ((1u << lane) - 1))))] = hypothesis;
    waiting += static_cast<std::uint32_t>(__popc(static_cast<int>(passing)));
    if (waiting < 32) continue;
    __syncwarp();
    settle(32);
    waiting -= 32;
    __syncwarp();
    const std::uint32_t rest = queue.waiting[32 + lane];
    __syncwarp();
    if (lane < waiting) queue.waiting[lane] = rest;
  }
  __syncwarp();
  settle(waiting);
  __syncwarp();
  return queue.words[lane];
}

/// From global memory, reading the same corners again costs more than idle lanes.
__device__ std::uint32_t draw_word(const SampleBatch& s, const GlobalPoints& points,
                                   const MatchedPoints* m, std::uint32_t count, std::uint32_t first,
                                   WarpQueue&) {
  const std::uint32_t lane = threadIdx.x % 32;
  std::uint32_t mine = 0;
  for (std::uint32_t k = 0; k < 32; ++k) {
    const std::uint32_t hypothesis = first + k * 32 + lane;
    bool pass = false;
    if (hypothesis < s.hypotheses) {
      const Quadruple q = draw_quadruple(hypothesis, s.seed, count);
      pass = first_side_passes(points, q, s.tau2) && other_sides_pass(points, m, q, s.tau2);
    }
    const unsigned word = __ballot_sync(~0u, pass);
    if (lane == k) mine = word;
  }
  return mine;
}

template <typename Points>
__device__ void sample_chunks(const SampleBatch& s, const Points& points, const MatchedPoints* m,
                              std::uint32_t count, WarpQueue& queue) {
  const std::uint32_t p = blockIdx.y, warp = threadIdx.x / 32, lane = threadIdx.x % 32;
  for (std::uint32_t chunk = blockIdx.x; chunk < s.chunks; chunk += gridDim.x) {
    const std::uint32_t mine =
        draw_word(s, points, m, count, (chunk * kWordsPerChunk + warp * 32) * 32, queue);
    const std::uint32_t kept = warp_sum(static_cast<std::uint32_t>(__popc(static_cast<int>(mine))));
    s.words[(static_cast<std::size_t>(p) * s.chunks + chunk) * kWordsPerChunk + warp * 32 + lane] =
        mine;
    if (lane == 0 && kept > 0)
      atomicAdd(&s.chunk_count[static_cast<std::size_t>(p) * s.chunks + chunk], kept);
  }
}

/// Draws and tests all hypotheses of a pair; blockIdx.y is the pair.
__global__ void __launch_bounds__(kThreads) sample(SampleBatch s, std::uint32_t shared_capacity) {
  extern __shared__ float4 shared[];
  __shared__ WarpQueue queues[kThreads / 32];
  WarpQueue& queue = queues[threadIdx.x / 32];
  const std::uint32_t p = blockIdx.y, count = s.count[p];
  if (count < 4) return;
  const MatchedPoints* m = s.matches + s.room[p];
  if (count > shared_capacity) {
    sample_chunks(s, GlobalPoints{m}, m, count, queue);
    return;
  }
  float2* rest = reinterpret_cast<float2*>(shared + shared_capacity);
  for (std::uint32_t i = threadIdx.x; i < count; i += kThreads) {
    shared[i] = make_float4(m[i].source.x, m[i].source.y, m[i].source.z, m[i].target.x);
    rest[i] = make_float2(m[i].target.y, m[i].target.z);
  }
  __syncthreads();
  sample_chunks(s, SharedPoints{shared, rest}, m, count, queue);
}

/// Expands bits to indices, in order. before: survivors in earlier chunks, over all pairs of the
/// batch.
__global__ void __launch_bounds__(kWordsPerChunk)
    expand(const std::uint32_t* words, const std::uint32_t* before, std::uint32_t chunks,
           const std::uint32_t* offset, std::uint32_t* id) {
  __shared__ std::uint32_t warp_sums[32];
  const std::uint32_t p = blockIdx.y, chunk = blockIdx.x, lane = threadIdx.x % 32,
                      warp = threadIdx.x / 32;
  const std::size_t at = static_cast<std::size_t>(p) * chunks + chunk;
  if (before[at] == before[at + 1]) return;
  const std::uint32_t first = before[at] - before[static_cast<std::size_t>(p) * chunks],
                      room = offset[p + 1] - offset[p];
  if (first >= room) return;
  std::uint32_t word = words[at * kWordsPerChunk + threadIdx.x];
  const std::uint32_t mine = static_cast<std::uint32_t>(__popc(static_cast<int>(word)));
  const std::uint32_t sum = warp_prefix_sum(mine);
  if (lane == 31) warp_sums[warp] = sum;
  __syncthreads();
  std::uint32_t rank = first + sum - mine;
  for (std::uint32_t w = 0; w < warp; ++w) rank += warp_sums[w];
  for (; word != 0 && rank < room; word &= word - 1, ++rank)
    id[offset[p] + rank] = (chunk * kWordsPerChunk + threadIdx.x) * 32 +
                           static_cast<std::uint32_t>(__ffs(static_cast<int>(word)) - 1);
}

}  // namespace

Samples sample_quadruples(Exec& exec, const Matches& matches, const RegistrationSettings& options) {
  const std::size_t pairs = matches.room.entries();
  const std::uint32_t chunks = blocks_for(options.quadruples.count, 32 * kWordsPerChunk);
  const std::size_t all_chunks = pairs * chunks;
  auto words = exec.buffer<std::uint32_t>(all_chunks * kWordsPerChunk);
  auto before = exec.filled<std::uint32_t>(all_chunks + 1, 0);

  // Shared memory for the matches of the largest pair, if they fit; larger pairs read global
  // memory.
  constexpr std::size_t kBytesPerMatch = sizeof(float4) + sizeof(float2);
  const std::uint32_t fits =
      static_cast<std::uint32_t>(exec.allow_shared_memory(sample) / kBytesPerMatch);
  const std::uint32_t capacity = std::min(matches.room.largest, fits);
  const std::size_t shared_bytes = capacity * kBytesPerMatch;
  // A thread block stages the matches once and then draws for many chunks: few blocks per pair, but
  // all processors busy.
  const unsigned wanted = blocks_for(static_cast<std::size_t>(exec.multiprocessors()) * 8,
                                     static_cast<unsigned>(pairs));
  const unsigned blocks = std::max(1u, std::min(chunks, std::max(4u, wanted)));
  SampleBatch batch{};
  batch.room = matches.room.on_device.data();
  batch.matches = matches.pairs.data();
  batch.count = matches.count.data();
  batch.hypotheses = options.quadruples.count;
  batch.chunks = chunks;
  batch.seed = options.seed;
  batch.tau2 = options.quadruples.edge_similarity * options.quadruples.edge_similarity;
  batch.words = words.data();
  batch.chunk_count = before.data();
  launch(exec, "sample", sample, {{blocks, static_cast<unsigned>(pairs)}, kThreads, shared_bytes},
         batch, capacity);
  exclusive_sum(exec, before.data(), before.data(), all_chunks + 1);
  // One number per pair: the survivors before its first chunk.
  std::uint32_t* starts = exec.staging<std::uint32_t>(pairs + 1);
  check(cudaMemcpy2DAsync(starts, sizeof(std::uint32_t), before.data(),
                          chunks * sizeof(std::uint32_t), sizeof(std::uint32_t), pairs,
                          cudaMemcpyDeviceToHost, exec.stream()),
        "cudaMemcpy2DAsync");
  check(cudaMemcpyAsync(starts + pairs, before.data() + all_chunks, sizeof(std::uint32_t),
                        cudaMemcpyDeviceToHost, exec.stream()),
        "cudaMemcpyAsync");
  exec.synchronize();

  Samples out;
  out.chunks = chunks;
  for (std::size_t p = 0; p < pairs; ++p)
    out.survivors.push_back(std::min(starts[p + 1] - starts[p], options.quadruples.max_survivors));
  out.words = std::move(words);
  out.before = std::move(before);
  return out;
}

std::vector<pipeline::Run> runs_of(Exec&, const Samples& samples) {
  // A survivor's index, pose, validity, inliers, tie and residual.
  constexpr std::uint64_t kSurvivorBytes =
      sizeof(std::uint32_t) + sizeof(Pose<float>) + 1 + 2 * sizeof(std::uint32_t) + 8;
  return pipeline::runs_within(samples.survivors.size(), kSurvivorMemory / kSurvivorBytes,
                               [&](std::size_t p) { return samples.survivors[p]; });
}

Quadruples survivors_of(Exec& exec, const Samples& samples, pipeline::Run pairs) {
  Quadruples out;
  out.first_pair = pairs.begin;
  out.segments = make_segments(exec, pairs.size(),
                               [&](std::size_t p) { return samples.survivors[pairs.begin + p]; });
  out.id = exec.buffer<std::uint32_t>(out.segments.total());
  if (out.segments.total() == 0) return out;
  const std::size_t first_chunk = pairs.begin * samples.chunks;
  launch(exec, "expand", expand,
         {{samples.chunks, static_cast<unsigned>(pairs.size())}, kWordsPerChunk},
         samples.words.data() + first_chunk * kWordsPerChunk, samples.before.data() + first_chunk,
         samples.chunks, out.segments.on_device.data(), out.id.data());
  return out;
}

}  // namespace gpureg::cuda
