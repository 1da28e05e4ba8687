// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include <cooperative_groups.h>

#include "algorithm/evidence.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/compatibility/sampled_pairs.hpp"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kSums = 27;  // of IcpSums

struct RefineModes {
  const SampledPair* pairs;
  std::uint32_t most;
  Mode* modes;
  std::uint32_t* count;
  std::uint32_t max_iterations;
  float max_distance, kernel_width, min_cosine;
  double settled;
};

/// Terms of one source point: turn, normal, weight and residual, see add_icp_term(). False where it
/// has no partner.
__device__ bool correspondence(const SampledPair& pair, const RefineModes& r, const Rigid& rigid,
                               float inverse_radius, std::uint32_t i, float (&row)[8]) {
  const CloudView &s = pair.source, &t = pair.pair.target;
  const Vec3 p = s.points[i], q = apply(rigid, p);
  const CellSummaries& cells = pair.pair.target_cells;
  const FoundPoint c = find_point(t, cells, q, r.max_distance * r.max_distance);
  if (!c.found() || c.normal == kPackedZero ||
      !c.agrees(t, cells, rotate(rigid, s.normals[i]), r.min_cosine))
    return false;
  const Vec3 normal = t.normals[c.index_in(cells)];
  const float distance = dot(q - c.point, normal);
  const Vec3 turn = cross(rotate(rigid, p) * inverse_radius, normal);
  row[0] = turn.x;
  row[1] = turn.y;
  row[2] = turn.z;
  row[3] = normal.x;
  row[4] = normal.y;
  row[5] = normal.z;
  row[6] = robust_weight(distance, r.kernel_width) * normal_weight_share(s.normal_weight[i]);
  row[7] = distance * (1.0f / r.max_distance);
  return true;
}

/// Sums of thread block `first` of `blocks`, which alternate in steps of kThreads points. Each of
/// 27 lanes accumulates one sum over the points of the warp: the terms of add_icp_term() with one
/// register per thread instead of 54. rows, partial: shared memory, for each warp.
template <int kThreads>
__device__ void add_up(const SampledPair& pair, const RefineModes& r, const Rigid& rigid,
                       std::uint32_t first, std::uint32_t blocks, float (*rows)[32][8],
                       std::int64_t (*partial)[kSums], IcpSums& sums) {
  const std::uint32_t lane = threadIdx.x % 32, warp = threadIdx.x / 32, size = pair.source.size;
  const float inverse_radius = 1.0f / pair.source.radius;
  // Sum k is the product of entries a and b: the lower triangle row by row, then all with the
  // residual.
  std::uint32_t a = 0, b = lane;
  while (b > a) b -= ++a;
  if (lane >= 21) {
    a = lane < kSums ? lane - 21 : 0;
    b = 7;
  }
  std::int64_t sum = 0;
  for (std::uint32_t base = first * kThreads + threadIdx.x - lane; base < size;
       base += blocks * kThreads) {
    const std::uint32_t i = base + lane;
    float row[8];
    const bool has = i < size && correspondence(pair, r, rigid, inverse_radius, i, row);
    const unsigned mask = __ballot_sync(~0u, has);
    if (has) {
      float4* out = reinterpret_cast<float4*>(
          rows[warp][__popc(static_cast<int>(mask & ((1u << lane) - 1)))]);
      out[0] = make_float4(row[0], row[1], row[2], row[3]);
      out[1] = make_float4(row[4], row[5], row[6], row[7]);
    }
    __syncwarp();
    const int count = __popc(static_cast<int>(mask));
#pragma unroll 4
    for (int k = 0; k < count; ++k) {
      const float* one = rows[warp][k];
      sum += to_icp_fixed(one[6] * one[a] * one[b]);
    }
    __syncwarp();
  }
  if (lane < kSums) partial[warp][lane] = sum;
  __syncthreads();
  if (threadIdx.x < kSums) {
    std::int64_t total = 0;
    for (int w = 0; w < kThreads / 32; ++w) total += partial[w][threadIdx.x];
    sums.v[threadIdx.x] = total;
  }
  __syncthreads();
}

/// Adds up the sums of the blocks of a cluster, for each of them. Two alternating buffers make one
/// synchronisation per iteration sufficient.
template <int kBlocks>
__device__ void add_over_cluster(IcpSums& mine, IcpSums& total) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  const auto cluster = cooperative_groups::this_cluster();
  cluster.sync();
  if (threadIdx.x < kSums) {
    // Requests all values before it uses the first.
    std::int64_t sum = 0;
#pragma unroll
    for (int b = 0; b < kBlocks; ++b)
      sum += cluster.map_shared_rank(&mine, static_cast<unsigned>(b))->v[threadIdx.x];
    total.v[threadIdx.x] = sum;
  }
  __syncthreads();
#endif
}

/// No block exits while another may still read its sums.
__device__ void leave_cluster() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  cooperative_groups::this_cluster().sync();
#endif
}

/// A thread block per mode, or a cluster of kBlocks, runs all iterations of one refinement.
template <int kThreads, int kBlocks, int kResident = 1024>
__global__ void __launch_bounds__(kThreads, kResident / kThreads) refine(RefineModes r) {
  __shared__ float rows[kThreads / 32][32][8];
  __shared__ std::int64_t partial[kThreads / 32][kSums];
  __shared__ IcpSums own[2], total_of_all;
  __shared__ Pose<double> pose;
  __shared__ bool done;
  const std::uint32_t number = blockIdx.x / kBlocks, first = blockIdx.x % kBlocks;
  if (number >= r.count[blockIdx.y]) return;
  // A copy in shared memory: its fields are read again at every point.
  __shared__ __align__(16) char pair_bytes[sizeof(SampledPair)];
  static_assert(sizeof(SampledPair) % 4 == 0, "copied by words");
  for (std::uint32_t w = threadIdx.x; w < sizeof(SampledPair) / 4; w += kThreads)
    reinterpret_cast<std::uint32_t*>(pair_bytes)[w] =
        reinterpret_cast<const std::uint32_t*>(r.pairs + blockIdx.y)[w];
  __syncthreads();
  const SampledPair& pair = *reinterpret_cast<const SampledPair*>(pair_bytes);
  Mode& mode = r.modes[static_cast<std::size_t>(blockIdx.y) * r.most + number];
  if (threadIdx.x == 0) {
    pose = mode.pose;
    done = false;
  }
  std::uint32_t iterations = 0;
  __syncthreads();
  while (!done) {
    IcpSums& mine = own[iterations % 2];
    add_up<kThreads>(pair, r, to_rigid(pose), first, kBlocks, rows, partial, mine);
    if constexpr (kBlocks > 1) add_over_cluster<kBlocks>(mine, total_of_all);
    ++iterations;
    if (threadIdx.x == 0) {
      const IcpSums& sums = kBlocks > 1 ? total_of_all : mine;
      const IcpStep step = solve_icp(sums, pair.source.radius, r.max_distance);
      if (step.valid) pose = compose_small(step.omega, step.shift, pose);
      done = !step.valid || icp_settled(step, pair.source.radius, r.max_distance, r.settled) ||
             iterations >= r.max_iterations;
    }
    __syncthreads();
  }
  if constexpr (kBlocks > 1) leave_cluster();
  if (threadIdx.x == 0 && first == 0) {
    mode.pose = pose;
    mode.iterations += iterations;
  }
}

/// Clusters of blocks, for so few modes that the device would wait for single blocks. Two of these
/// blocks share a multiprocessor, so that the 24 modes of one pair run at once; clusters of blocks
/// twice as large would need two waves. Half as many modes leave a block all registers.
constexpr int kClusterBlocks = 8, kClusterThreads = 512;

/// Threads of small blocks on a multiprocessor: more hide the latency of the search, though they
/// leave few registers.
constexpr int kSmallResident = 1280;

/// True where the clusters were compiled: their code is empty below architecture 9.0.
bool has_clusters(const Exec& exec) {
  return exec.compiled_for(refine<kClusterThreads, kClusterBlocks>) >= 90;
}

void refine_by_clusters(Exec& exec, const RefineModes& batch, unsigned pairs) {
  cudaLaunchAttribute cluster{};
  cluster.id = cudaLaunchAttributeClusterDimension;
  cluster.val.clusterDim.x = kClusterBlocks;
  cluster.val.clusterDim.y = cluster.val.clusterDim.z = 1;
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(batch.most * kClusterBlocks, pairs);
  config.blockDim = dim3(kClusterThreads);
  config.stream = exec.stream();
  config.attrs = &cluster;
  config.numAttrs = 1;
  const bool alone = std::size_t(batch.most) * pairs * kClusterBlocks <=
                     static_cast<std::size_t>(exec.multiprocessors());
  check(cudaLaunchKernelEx(&config,
                           alone ? refine<kClusterThreads, kClusterBlocks, kClusterThreads>
                                 : refine<kClusterThreads, kClusterBlocks>,
                           batch),
        "refine by clusters");
}

/// Merges modes that refinement moved to the same pose; keeps the first. A warp per pair.
__global__ void __launch_bounds__(32)
    merge(std::uint32_t most, Mode* all_modes, std::uint32_t* counts, ModeLimits within) {
  __shared__ Rigid rigid[limits::kMaxModes];  // the first `count` of them are kept
  __shared__ std::uint32_t kept[limits::kMaxModes];
  const std::uint32_t size = counts[blockIdx.x], lane = threadIdx.x;
  Mode* modes = all_modes + static_cast<std::size_t>(blockIdx.x) * most;
  for (std::uint32_t k = lane; k < size; k += 32) rigid[k] = to_rigid(modes[k].pose);
  __syncwarp();
  std::uint32_t count = 0;
  for (std::uint32_t k = 0; k < size; ++k) {
    const Rigid mine = rigid[k];
    bool known = false;
    for (std::uint32_t o = lane; o < count; o += 32) known |= same_mode(mine, rigid[o], within);
    if (__any_sync(~0u, known)) continue;
    __syncwarp();  // a vote does not order the reads of other lanes before this write
    if (lane == 0) {
      rigid[count] = mine;
      kept[count] = k;
    }
    __syncwarp();
    ++count;
  }
  // Modes move to the front, 32 at a time: none is overwritten before it is read.
  for (std::uint32_t base = 0; base < count; base += 32) {
    const std::uint32_t k = base + lane;
    Mode mode{};
    if (k < count) mode = modes[kept[k]];
    __syncwarp();
    if (k < count) modes[k] = mode;
    __syncwarp();
  }
  if (lane == 0) counts[blockIdx.x] = count;
}

/// A warp per pair. Lane 0 compares with the origin mode, the others with the poses kept so far.
__global__ void __launch_bounds__(32)
    drop(std::uint32_t most, const ReturnTest* tests, Mode* all_modes, std::uint32_t* counts) {
  static_assert(limits::kMaxPerturbedPoses < 32, "a lane compares with each pose kept");
  __shared__ ReturnTest test;
  __shared__ Pose<double> kept[32];
  const std::uint32_t size = counts[blockIdx.x], lane = threadIdx.x;
  Mode* modes = all_modes + static_cast<std::size_t>(blockIdx.x) * most;
  if (lane == 0) {
    test = tests[blockIdx.x];
    kept[0] = test.origin;
  }
  __syncwarp();
  std::uint32_t count = 0;
  for (std::uint32_t k = 0; k < size; ++k) {
    const Mode mode = modes[k];
    const bool near =
        lane <= count && squared_displacement(mode.pose, kept[lane], test) <= test.squared_distance;
    if (__any_sync(~0u, near)) continue;
    if (lane == 0) {
      modes[count] = mode;
      kept[count + 1] = mode.pose;
    }
    __syncwarp();
    ++count;
  }
  if (lane == 0) counts[blockIdx.x] = count;
}

void refine_all(Exec& exec, const SampledPairs& pairs, Modes& modes, std::uint32_t max_iterations,
                const RegistrationSettings& options, float kernel_width, double settled) {
  RefineModes batch{};
  batch.pairs = pairs.pairs.data();
  batch.most = modes.most;
  batch.modes = modes.mode.data();
  batch.count = modes.count.data();
  batch.max_iterations = max_iterations;
  batch.max_distance = options.prepare.max_correspondence_distance;
  batch.kernel_width = kernel_width;
  batch.min_cosine =
      inlier_test(options.prepare.max_correspondence_distance, kRefineNormalAngle).min_cosine;
  batch.settled = settled;
  const unsigned pair_count = static_cast<unsigned>(pairs.pairs.size());
  // Small blocks overlap each other's solving. With too few modes to fill the device, large blocks
  // or clusters are faster.
  const std::size_t count = std::size_t(modes.most) * pair_count,
                    processors = static_cast<std::size_t>(exec.multiprocessors());
  if (count * kClusterBlocks <= processors * 3 && has_clusters(exec)) {
    refine_by_clusters(exec, batch, pair_count);
  } else {
    const bool few = count < processors * 2;
    launch(exec, "refine", (few ? refine<1024, 1> : refine<256, 1, kSmallResident>),
           {{modes.most, pair_count}, few ? 1024u : 256u}, batch);
  }
}

}  // namespace

void refine_roughly(Exec& exec, Span<const PairView> pairs, Modes& modes,
                    const RegistrationSettings& options) {
  if (options.refine.max_iterations == 0) return;
  refine_all(exec, sample_pairs(exec, pairs, refinement_sample(options.evidence), false), modes,
             std::min(kRoughIterations, options.refine.max_iterations), options,
             options.refine.kernel_width, kRoughSettled);
}

void polish_modes(Exec& exec, Span<const PairView> pairs, Modes& modes,
                  const RegistrationSettings& options) {
  if (options.refine.max_iterations == 0) return;
  const float kernel_width = kPolishKernel * options.refine.kernel_width;
  refine_all(exec, sample_pairs(exec, pairs, refinement_sample(options.evidence), false), modes,
             options.refine.max_iterations, options, kernel_width, kPolishSettled);
  refine_all(exec, whole_pairs(exec, pairs), modes,
             std::min(kFinalIterations, options.refine.max_iterations), options, kernel_width,
             kPolishSettled);
}

void merge_modes(Exec& exec, Modes& modes, const RegistrationSettings& options, float share) {
  const unsigned pairs = static_cast<unsigned>(modes.count.size());
  launch(exec, "merge", merge, {pairs, 32}, modes.most, modes.mode.data(), modes.count.data(),
         mode_limits(options.evidence.mode_angle, options.evidence.mode_distance, share));
}

void drop_returned(Exec& exec, Modes& perturbed, const std::vector<PosesOfPair>& perturbations) {
  std::vector<ReturnTest> tests(perturbations.size());
  for (std::size_t p = 0; p < tests.size(); ++p) tests[p] = perturbations[p].returned;
  const auto on_device = exec.upload(tests);
  launch(exec, "drop", drop, {static_cast<unsigned>(tests.size()), 32}, perturbed.most,
         on_device.data(), perturbed.mode.data(), perturbed.count.data());
}

Modes modes_from_poses(Exec& exec, const std::vector<PosesOfPair>& poses) {
  Modes out;
  for (const PosesOfPair& of_pair : poses)
    out.most = std::max(out.most, static_cast<std::uint32_t>(of_pair.poses.size()));
  out.most = std::max(out.most, 1u);  // a launch needs a block
  std::vector<Mode> modes(poses.size() * out.most);
  std::vector<std::uint32_t> count(poses.size());
  for (std::size_t p = 0; p < poses.size(); ++p)
    for (const Pose<double>& pose : poses[p].poses) modes[p * out.most + count[p]++] = {pose, 0, 0};
  out.mode = exec.upload(modes);
  out.count = exec.upload(count);
  return out;
}

Candidates no_candidates(Exec& exec, Span<const PairView> pairs) {
  Candidates out;
  out.count = exec.filled<std::uint32_t>(pairs.size, 0);
  return out;
}

}  // namespace gpureg::cuda
