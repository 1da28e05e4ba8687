// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <type_traits>

#include "algorithm/evidence.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/compatibility/compare_point.cuh"
#include "cuda/device/block_sum.cuh"
#include "cuda/device/launch.cuh"
#include "pipeline/conclude.hpp"
#include "pipeline/evidence_test.hpp"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 128, kWarps = kThreads / 32;
/// Of a multiprocessor at least. Without it, one more term of evidence takes 14 registers more.
constexpr int kBlocks = 6;
constexpr std::uint32_t kInformationSums = 24;

struct VerifyModes {
  const SearchPair* pairs;
  MatchSetView matches;
  const std::uint32_t *room, *match_count;
  std::uint32_t most;
  const Mode* modes;
  const std::uint32_t* count;
  EvidenceTest test;
  float squared_distance;
  ModeOutcome* out;
};

/// Adds the part of one of several blocks; a single block writes.
template <typename T>
__device__ void put(T& out, T value, bool alone) {
  using Atomic = std::conditional_t<sizeof(T) == 8, unsigned long long, unsigned>;
  if (alone)
    out = value;
  else
    atomicAdd(reinterpret_cast<Atomic*>(&out), static_cast<Atomic>(value));
}
__device__ void put(SideEvidence& out, const SideEvidence& e, bool alone) {
#pragma unroll
  for (std::uint32_t k = 0; k < kTerms; ++k) put(out.sum[k], e.sum[k], alone);
}

__device__ MatchEvidence count_matches(const VerifyModes& w, std::uint32_t p, const Rigid& rigid,
                                       std::uint32_t first, std::uint32_t step,
                                       std::int64_t* scratch) {
  std::int64_t v[3] = {0, 0, 0};
  const MatchSetView& m = w.matches;
  for (std::uint32_t k = first; k < w.match_count[p]; k += step) {
    const std::uint32_t at = w.room[p] + k;
    if (!(squared_norm(apply(rigid, {m.px[at], m.py[at], m.pz[at]}) -
                       Vec3{m.qx[at], m.qy[at], m.qz[at]}) < w.squared_distance))
      continue;
    ++v[0];
    v[1] += m.source_weight[at];
    v[2] += m.target_weight[at];
  }
  block_sum(v, scratch);
  return {static_cast<std::uint64_t>(v[1]), static_cast<std::uint64_t>(v[2]),
          static_cast<std::uint32_t>(v[0])};
}

/// Part of a mode that a thread block verifies: points first, first + step, ...
struct Share {
  std::uint32_t p, part, first, step;
  bool alone;
  std::size_t mode;
  __device__ Share(const VerifyModes& w, std::uint32_t number, std::uint32_t parts)
      : p(blockIdx.y),
        part(number),
        first(number * kThreads + threadIdx.x),
        step(parts * kThreads),
        alone(parts == 1),
        mode(static_cast<std::size_t>(blockIdx.y) * w.most + blockIdx.x) {}
};

/// The points of the target in the source.
__device__ void compare_target(const VerifyModes& w, const Share& share) {
  __shared__ std::int64_t scratch[kWarps * kTerms];
  const CloudView &s = w.pairs[share.p].source, &t = w.pairs[share.p].target;
  const Rigid back = inverse(to_rigid(w.modes[share.mode].pose));
  LaneEvidence mine;
  for (std::uint32_t i = share.first; i < t.size; i += share.step) {
    compare_point(t, s, w.pairs[share.p].source_cells, back, w.test, s.visibility.count, i, mine);
  }
  const SideEvidence side = block_sum(mine, scratch);
  if (threadIdx.x == 0) put(w.out[share.mode].target, side, share.alone);
}

/// Values of a source point with a closest point, side by side: what the sums of a mode multiply.
/// The gaps keep the banks of shared memory apart.
struct SumRow {
  static constexpr std::uint32_t kInformation = 0, kArm = 6, kSource = 9, kTarget = 12, kOne = 15;
  float4 values[5];
};

/// The lane's sum in a list of sums of products of two values of a row. value, other: their places.
struct LaneSum {
  std::uint32_t value, other;
  std::int64_t total;
  __device__ void add(const float* row) { total += to_icp_fixed(row[value] * row[other]); }
};

/// Places of entry k of the lower triangle of a symmetric matrix, row by row.
__device__ LaneSum triangle_sum(std::uint32_t k, std::uint32_t first) {
  std::uint32_t row = 0;
  while (k > row) k -= ++row;
  return {first + row, first + k, 0};
}

/// Sums of InformationSums: the lower triangle, then the arms.
__device__ LaneSum information_sum(std::uint32_t lane) {
  return lane < 21
             ? triangle_sum(lane, SumRow::kInformation)
             : LaneSum{SumRow::kArm + (lane < kInformationSums ? lane - 21 : 0), SumRow::kOne, 0};
}

/// Sums of Moments of one cloud: x, y, z, then xx, xy, xz, yy, yz, zz.
__device__ LaneSum moment_sum(std::uint32_t k, std::uint32_t first) {
  if (k < 3) return {first + k, SumRow::kOne, 0};
  const std::uint32_t row = k < 6 ? 0 : k < 8 ? 1 : 2;
  return {first + row, first + (row == 0 ? k - 3 : row == 1 ? k - 5 : 2), 0};
}

/// The points of the source in the target, the information of the inliers, the moments of the
/// correspondences, and the matches. Each lane adds up one sum of the information and one of the
/// moments over the points of its warp: two registers instead of one for each of 42 sums.
__device__ void compare_source(const VerifyModes& w, const Share& share) {
  __shared__ SumRow rows[kWarps][32];
  __shared__ std::int64_t scratch[kWarps * kTerms], partial[kWarps][2 * 32];
  static_assert(kIcpFixedScale == kMomentFixedScale, "one conversion for all sums");
  const SearchPair& pair = w.pairs[share.p];
  const CloudView &s = pair.source, &t = pair.target;
  const Mode& mode = w.modes[share.mode];
  const Rigid there = to_rigid(mode.pose);
  const std::uint32_t lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  const unsigned before = (1u << lane) - 1;
  const float inverse_source = 1.0f / s.radius, inverse_target = 1.0f / t.radius;
  LaneSum information = information_sum(lane),
          moment = lane < 9 ? moment_sum(lane, SumRow::kSource)
                            : moment_sum(lane < 18 ? lane - 9 : 0, SumRow::kTarget);
  LaneEvidence mine;
  for (std::uint32_t base = share.first - lane; base < s.size; base += share.step) {
    const std::uint32_t i = base + lane;
    ComparedWith found{{0, {0, 0, 0}, kPackedZero, kNoValue, kNoValue}, false};
    if (i < s.size)
      found = compare_point(s, t, pair.target_cells, there, w.test, t.visibility.count, i, mine);
    const bool hit = found.closest.found();
    const unsigned hits = __ballot_sync(~0u, hit), inliers = __ballot_sync(~0u, found.inlier);
    const int inlier_count = __popc(static_cast<int>(inliers)),
              count = __popc(static_cast<int>(hits));
    if (hit) {  // inliers first
      const int place = found.inlier
                            ? __popc(static_cast<int>(inliers & before))
                            : inlier_count + __popc(static_cast<int>(hits & ~inliers & before));
      const Vec3 p = s.points[i], arm = rotate(there, p) * inverse_source,
                 normal = rotate(there, s.normals[i]), turn = cross(arm, normal),
                 a = p * inverse_source, b = found.closest.point * inverse_target;
      float4* out = rows[warp][place].values;
      out[0] = make_float4(turn.x, turn.y, turn.z, normal.x);
      out[1] = make_float4(normal.y, normal.z, arm.x, arm.y);
      out[2] = make_float4(arm.z, a.x, a.y, a.z);
      out[3] = make_float4(b.x, b.y, b.z, 1.0f);
    }
    __syncwarp();
    const auto row = [&](int k) { return reinterpret_cast<const float*>(rows[warp][k].values); };
#pragma unroll 4
    for (int k = 0; k < count; ++k) moment.add(row(k));
#pragma unroll 4
    for (int k = 0; k < inlier_count; ++k) information.add(row(k));
    __syncwarp();
  }
  const SideEvidence side = block_sum(mine, scratch);
  partial[warp][lane] = information.total;
  partial[warp][32 + lane] = moment.total;
  __syncthreads();
  ModeOutcome& out = w.out[share.mode];
  if (threadIdx.x < 64 && lane < (warp == 0 ? kInformationSums : 18)) {
    std::int64_t total = 0;
    for (int k = 0; k < kWarps; ++k) total += partial[k][threadIdx.x];
    Moments& moments = lane < 9 ? out.source_moments : out.target_moments;
    const std::uint32_t k = lane % 9;
    put(warp == 0 ? (lane < 21 ? out.information.v[lane] : out.information.arm[lane - 21])
                  : (k < 3 ? moments.sum[k] : moments.outer[k - 3]),
        total, share.alone);
  }
  const MatchEvidence matches = count_matches(w, share.p, there, share.first, share.step, scratch);
  if (threadIdx.x != 0) return;
  if (share.part == 0) {
    out.pose = mode.pose;
    out.hypothesis = mode.seed;
    out.iterations = mode.iterations;
  }
  put(out.matches.source_weight, matches.source_weight, share.alone);
  put(out.matches.target_weight, matches.target_weight, share.alone);
  put(out.matches.inliers, matches.inliers, share.alone);
  put(out.source, side, share.alone);
  put(out.source_moments.count, static_cast<std::uint64_t>(side[Term::hits]), share.alone);
  put(out.target_moments.count, static_cast<std::uint64_t>(side[Term::hits]), share.alone);
}

/// One or several thread blocks per mode (z).
__global__ void __launch_bounds__(kThreads, kBlocks) verify_target(VerifyModes w) {
  if (blockIdx.x < w.count[blockIdx.y]) compare_target(w, Share(w, blockIdx.z, gridDim.z));
}
__global__ void __launch_bounds__(kThreads, kBlocks) verify_source(VerifyModes w) {
  if (blockIdx.x < w.count[blockIdx.y]) compare_source(w, Share(w, blockIdx.z, gridDim.z));
}
/// Both at the same time: half of the blocks each.
__global__ void __launch_bounds__(kThreads, kBlocks) verify_both(VerifyModes w) {
  if (blockIdx.x >= w.count[blockIdx.y]) return;
  const Share share(w, blockIdx.z / 2, gridDim.z / 2);
  if (blockIdx.z % 2 == 0)
    compare_target(w, share);
  else
    compare_source(w, share);
}

}  // namespace

void verify_modes(Exec& exec, Span<const PairView> pairs, const MatchSets& matches,
                  const Candidates& candidates, const Modes& modes,
                  const RegistrationSettings& options, Span<PairOutcome> outcomes) {
  const auto views = upload_search_pairs(exec, pairs);
  // Filled: unused modes are copied too, and parts are added up.
  const auto verified = exec.filled<ModeOutcome>(pairs.size * modes.most, 0);
  // Several blocks share a mode where there are too few to fill the device.
  const std::size_t blocks = std::size_t(modes.most) * pairs.size,
                    processors = static_cast<std::size_t>(exec.multiprocessors());
  const unsigned parts =
      static_cast<unsigned>(std::clamp<std::size_t>(8 * processors / blocks, 1, 24));
  VerifyModes batch{};
  batch.pairs = views.data();
  batch.matches = matches.view();
  batch.room = matches.room.on_device.data();
  batch.match_count = matches.count.data();
  batch.most = modes.most;
  batch.modes = modes.mode.data();
  batch.count = modes.count.data();
  batch.test = pipeline::evidence_test(options);
  batch.squared_distance =
      options.compatibility.consensus_distance * options.compatibility.consensus_distance;
  batch.out = verified.data();
  const auto grid = [&](unsigned z) {
    return dim3(modes.most, static_cast<unsigned>(pairs.size), z);
  };
  if (parts > 1) {
    launch(exec, "verify_both", verify_both, {grid(2 * parts), kThreads}, batch);
  } else {
    launch(exec, "verify_target", verify_target, {grid(1), kThreads}, batch);
    launch(exec, "verify_source", verify_source, {grid(1), kThreads}, batch);
  }
  const ModeOutcome* mode = exec.download(verified.data(), verified.size());
  const std::uint32_t* mode_count = exec.download(modes.count.data(), pairs.size);
  const std::uint32_t* match_count = exec.download(matches.count.data(), pairs.size);
  const std::uint64_t* total = exec.download(matches.total.data(), 2 * pairs.size);
  const std::uint32_t* candidate_count = exec.download(candidates.count.data(), pairs.size);
  exec.synchronize();
  for (std::size_t p = 0; p < pairs.size; ++p) {
    PairOutcome& out = outcomes[p];
    out.modes.assign(mode + p * modes.most, mode + p * modes.most + mode_count[p]);
    out.match_weight_source = total[2 * p];
    out.match_weight_target = total[2 * p + 1];
    pipeline::count_seeds(pairs[p].source.size, pairs[p].target.size, match_count[p],
                          candidate_count[p], options, out.statistics);
  }
}

}  // namespace gpureg::cuda
