// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/evidence.hpp"
#include "block_sum.cuh"
#include "closest_cells.cuh"
#include "stages.hpp"

namespace gpureg::cuda {
namespace {

constexpr std::uint32_t kMostModes = 64;

struct RefineModes {
  const SearchPair* pairs;
  std::uint32_t most;
  Mode* modes;
  std::uint32_t* count;
  std::uint32_t sample, max_iterations;
  float max_distance, kernel_width, min_cosine;
};

/// Terms of one source point, weighed by its normal's direction.
__device__ void add_point(const SearchPair& pair, const RefineModes& r, float kernel_width, const Rigid& rigid, float inverse_radius, std::uint32_t i,
                          IcpSums& sums) {
  const CloudView &s = pair.source, &t = pair.target;
  const Vec3 q = apply(rigid, s.points[i]);
  const Closest c = find_closest(t, pair.target_cells, q, r.max_distance * r.max_distance);
  if (c.index == kNoValue) return;
  const Vec3 normal = t.normals[c.index];
  if (is_zero(normal) || !normals_agree(rotate(rigid, s.normals[i]), normal, r.min_cosine)) return;
  const float distance = dot(q - t.points[c.index], normal);
  add_icp_term(rotate(rigid, s.points[i]) * inverse_radius, normal, distance * (1.0f / r.max_distance),
               robust_weight(distance, kernel_width) * balance_share(s.balance[i]), sums);
}

/// A thread block per mode runs all its iterations: on a sample, then on all points with a narrower kernel.
template <int kThreads>
__global__ void __launch_bounds__(kThreads) refine(RefineModes r) {
  __shared__ std::int64_t scratch[kThreads / 32 * 27];
  __shared__ Pose<double> pose;
  __shared__ bool done;
  if (blockIdx.x >= r.count[blockIdx.y]) return;
  const SearchPair& pair = r.pairs[blockIdx.y];
  Mode& mode = r.modes[static_cast<std::size_t>(blockIdx.y) * r.most + blockIdx.x];
  const float inverse_radius = 1.0f / pair.source.radius;
  const std::uint32_t size = pair.source.size;
  if (threadIdx.x == 0) pose = mode.pose;
  std::uint32_t total = 0;
  for (int round = 0; round < 2; ++round) {
    const std::uint32_t stride = round == 0 ? sample_stride(size, 2 * r.sample) : 1;
    const float kernel_width = round == 0 ? r.kernel_width : kPolishKernel * r.kernel_width;
    if (threadIdx.x == 0) done = false;
    __syncthreads();
    for (std::uint32_t iterations = 0; !done;) {
      const Rigid rigid = to_rigid(pose);
      IcpSums sums{{0}};
      for (std::uint64_t i = std::uint64_t(threadIdx.x) * stride; i < size; i += std::uint64_t(kThreads) * stride)
        add_point(pair, r, kernel_width, rigid, inverse_radius, static_cast<std::uint32_t>(i), sums);
      block_sum(sums.v, scratch);
      ++iterations, ++total;
      if (threadIdx.x == 0) {
        const IcpStep step = solve_icp(sums, pair.source.radius, r.max_distance);
        if (step.valid) pose = compose_small(step.omega, step.shift, pose);
        done = !step.valid || icp_settled(step, pair.source.radius, r.max_distance) || iterations >= r.max_iterations;
      }
      __syncthreads();
    }
    __syncthreads();  // all have left the loop before it begins anew
  }
  if (threadIdx.x == 0) mode.pose = pose, mode.iterations = total;
}

/// Modes that have met: the first of them stays. A warp per pair.
__global__ void __launch_bounds__(32) merge(RefineModes r, float min_trace, float squared_distance) {
  __shared__ Rigid kept[kMostModes];
  const std::uint32_t size = r.count[blockIdx.x], lane = threadIdx.x;
  Mode* modes = r.modes + static_cast<std::size_t>(blockIdx.x) * r.most;
  std::uint32_t count = 0;
  for (std::uint32_t k = 0; k < size; ++k) {
    const Mode mode = modes[k];
    const Rigid rigid = to_rigid(mode.pose);
    bool known = false;
    for (std::uint32_t o = lane; o < count; o += 32) known |= same_mode(rigid, kept[o], min_trace, squared_distance);
    if (__any_sync(~0u, known)) continue;
    if (lane == 0) kept[count] = rigid, modes[count] = mode;
    __syncwarp();
    ++count;
  }
  if (lane == 0) r.count[blockIdx.x] = count;
}

}  // namespace

void refine_modes(Exec& exec, Span<const PairView> pairs, Modes& modes, const EvidenceOptions& evidence, const RefineOptions& options) {
  static_assert(kMostModes >= 64, "as many as EvidenceOptions::modes may be");
  const auto views = upload_search_pairs(exec, pairs);
  const RefineModes batch{views.data(), modes.most, modes.mode.data(), modes.count.data(), evidence.sample, options.max_iterations,
                          options.max_correspondence_distance, options.kernel_width,
                          inlier_test(options.max_correspondence_distance, kRefineNormalAngle).min_cosine};
  const unsigned pair_count = static_cast<unsigned>(pairs.size);
  if (options.max_iterations > 0) {
    // Small blocks hide each other's solving; where there are too few to fill the device, large ones are done sooner.
    const bool few = std::size_t(modes.most) * pairs.size < static_cast<std::size_t>(exec.multiprocessors()) * 2;
    (few ? refine<512> : refine<128>)<<<dim3(modes.most, pair_count), few ? 512 : 128, 0, exec.stream()>>>(batch);
    check_launch("refine");
  }
  merge<<<pair_count, 32, 0, exec.stream()>>>(batch, mode_trace(evidence.mode_angle), evidence.mode_distance * evidence.mode_distance);
  check_launch("merge");
}

}  // namespace gpureg::cuda
