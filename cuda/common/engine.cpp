// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/engine.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "common/host_threads.hpp"
#include "cuda/common/plan_matcher.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/common/surface_matcher.hpp"
#include "gpureg/context.hpp"
#include "pipeline/align_by_compatibility.hpp"
#include "pipeline/align_by_quadruples.hpp"
#include "pipeline/prepare.hpp"
#include "pipeline/runs.hpp"
#include "pipeline/verify.hpp"

namespace gpureg::cuda {
namespace {

/// Raw points per chunk of a preparation: enough to fill the device, few enough for its memory and
/// for page-locked staging.
constexpr std::size_t kRawPointsPerChunk = std::size_t(1) << 22;
/// The same where both lanes work: one uploads while the other computes.
constexpr std::size_t kRawPointsPerLane = std::size_t(1) << 21;
constexpr std::size_t kCloudsPerChunk = 256;
constexpr std::size_t kPairsPerChunk = 512;
/// Memory for one bit per hypothesis of every pair of a chunk.
constexpr std::size_t kSampleBytes = std::size_t(256) << 20;
/// Memory for the neighbourhoods of the seeds, and for the matches, of every pair of a chunk.
constexpr std::size_t kNeighborhoodBytes = std::size_t(5) << 28;

/// Fewer pairs are not divided: their parts would not fill the device.
constexpr std::size_t kPairsOfLanes = 128;

/// Clouds of all CUDA engines are compatible: they share one owner, the memory of all devices.
const char kDeviceMemory = 0;

/// Prepared points that are copied to the host for a watcher: they go through page-locked memory.
constexpr std::size_t kMostWatched = std::size_t(1) << 20;

/// Waits for the points and the normals.
std::vector<EarlySurface> copy_surfaces(Exec& exec, const DownsampledClouds& clouds,
                                        const DeviceBuffer<Vec3>& normals) {
  const Segments& segments = clouds.segments;
  const Vec3* const points_on_host = exec.download(clouds.points.data(), segments.total());
  const Vec3* const normals_on_host = exec.download(normals.data(), segments.total());
  exec.synchronize();
  std::vector<EarlySurface> out(segments.entries());
  for (std::size_t c = 0; c < out.size(); ++c) {
    const std::uint32_t begin = segments.offset[c], end = segments.offset[c + 1];
    out[c].points.assign(points_on_host + begin, points_on_host + end);
    out[c].normals.assign(normals_on_host + begin, normals_on_host + end);
    std::copy(clouds.facts[c].origin, clouds.facts[c].origin + 3, out[c].origin);
  }
  return out;
}

/// @param first index of the first cloud for the watcher, which may be empty.
std::vector<std::shared_ptr<PreparedCloud>> prepare_chunk(Exec& exec, Span<const RawCloud> clouds,
                                                          const PrepareSettings& options,
                                                          const SurfaceWatcher& watcher,
                                                          std::size_t first) {
  exec.begin();
  std::vector<std::shared_ptr<PreparedCloud>> out;
  const auto watch = [&](Exec&, const DownsampledClouds& points,
                         const DeviceBuffer<Vec3>& normals) {
    if (watcher && points.segments.total() <= kMostWatched)
      watcher(first, copy_surfaces(exec, points, normals));
  };
  for (auto& cloud : pipeline::prepare(exec, clouds, options, watch)) {
    cloud->owner = &kDeviceMemory;
    out.push_back(std::make_shared<PreparedCloud>(std::move(cloud)));
  }
  return out;
}

/// Runs of clouds of at most so many raw points.
std::vector<pipeline::Run> chunks_of(Span<const RawCloud> clouds, std::size_t points) {
  return pipeline::runs_within(clouds.size, points, [&](std::size_t c) {
    return std::max<std::uint64_t>(clouds[c].size, points / kCloudsPerChunk);
  });
}

void align_views(Exec& exec, Span<const PairInput> pairs, Span<const PairView> views,
                 const RegistrationSettings& options, Span<PairOutcome> outcomes) {
  if (options.method == RegistrationMethod::compatibility)
    pipeline::align_by_compatibility(exec, pairs, views, options, outcomes);
  else
    pipeline::align_by_quadruples(exec, views, options, outcomes);
}

/// Lanes that run at the same time take the device for a share of their time each.
void share_time(Span<PairOutcome> outcomes) {
  constexpr double kShare = 1.0 / static_cast<double>(Lanes::kTogether);
  for (PairOutcome& outcome : outcomes) {
    StageTimings& ms = outcome.timings;
    for (double* stage : {&ms.match, &ms.propose, &ms.rank, &ms.refine, &ms.verify})
      *stage *= kShare;
  }
}

/// The same for the stages of a preparation.
void share_time(const std::vector<std::shared_ptr<PreparedCloud>>& clouds) {
  constexpr double kShare = 1.0 / static_cast<double>(Lanes::kTogether);
  for (const auto& cloud : clouds) {
    PrepareStatistics& ms = cloud->statistics;
    for (double* stage :
         {&ms.downsample, &ms.normals, &ms.features, &ms.grid, &ms.depth_maps, &ms.surface_sides})
      *stage *= kShare;
  }
}

}  // namespace

CudaEngine::CudaEngine(int device, std::size_t memory_budget)
    : lanes_(device), residence_(lanes_.exec(0), memory_budget) {
  cudaDeviceProp properties{};
  check(cudaGetDeviceProperties(&properties, device), "cudaGetDeviceProperties");
  description_ = "cuda:" + std::to_string(device) + ", " + properties.name;
  const DeviceScope scope(device);
  load_adoption();
}

Backend CudaEngine::backend() const { return Backend::cuda; }

unsigned CudaEngine::host_threads() const { return lanes_.exec(0).host_threads(); }

const void* CudaEngine::memory() const { return &kDeviceMemory; }

void CudaEngine::allow_copies_to(const CudaEngine& other) {
  if (other.device() == device()) return;
  for (std::size_t k = 0; k < Lanes::kLanes; ++k)
    lanes_.exec(k).memory()->allow_reading(other.device());
}

std::vector<DeviceMemoryUse> CudaEngine::device_memory() const {
  DeviceMemoryUse use{device(), 0, 0, residence_.evictions()};
  for (std::size_t k = 0; k < Lanes::kLanes; ++k) {
    use.bytes_in_use += lanes_.exec(k).memory()->bytes_in_use();
    use.bytes_reserved += lanes_.exec(k).memory()->bytes_reserved();
  }
  return {use};
}

void CudaEngine::trim() {
  const DeviceScope scope(device());
  lanes_.trim();
}

template <typename Work>
void CudaEngine::on_lanes(const Lanes::Held& held, std::size_t count, const Work& work) {
  // The lanes take the parts alternately. Parts of two sizes keep them from waiting for the host
  // at the same time.
  const std::size_t ends[] = {0, count / 6, count / 2, count * 5 / 6, count};
  on_threads(Lanes::kTogether, [&](std::size_t lane) {
    const DeviceScope scope(device());
    Exec& exec = held.exec(lane);
    for (std::size_t part = lane; part < 4; part += Lanes::kTogether) {
      exec.begin();
      work(exec, ends[part], ends[part + 1]);
    }
  });
}

// Memory of a pair: a bit per hypothesis, rounded up to chunks; a bit per seed and match, the sums
// of a fit, a pose and its evidence per seed, the columns, the row and the keys of each match, and
// the sampled points.
std::size_t CudaEngine::pairs_per_chunk(const RegistrationSettings& options) const {
  constexpr std::size_t kChunkBytes = 4096, kSeedBytes = 192, kMatchBytes = 160,
                        kSampleBytesPerPoint = 112;
  std::size_t fit = kSampleBytes / (options.quadruples.count / 8 + kChunkBytes);
  if (options.method == RegistrationMethod::compatibility) {
    const CompatibilitySettings& c = options.compatibility;
    fit = kNeighborhoodBytes / (std::size_t(c.seeds) * (c.max_matches / 8 + kSeedBytes) +
                                std::size_t(c.max_matches) * kMatchBytes +
                                std::size_t(options.evidence.sample) * kSampleBytesPerPoint);
  }
  return fit < 1 ? 1 : (fit < kPairsPerChunk ? fit : kPairsPerChunk);
}

CudaEngine::Clouds CudaEngine::prepare(Span<const RawCloud> clouds, const PrepareSettings& options,
                                       const SurfaceWatcher& watcher) {
  if (has_budget()) return prepare_within_budget(clouds, options, watcher);
  if (chunks_of(clouds, kRawPointsPerChunk).size() > 1)
    return prepare_on_lanes(clouds, chunks_of(clouds, kRawPointsPerLane), options, watcher);
  const Lanes::Held held = lanes_.any();
  const DeviceScope scope(device());
  const auto made = prepare_chunk(held.exec(), clouds, options, watcher, 0);
  return {made.begin(), made.end()};
}

CudaEngine::Clouds CudaEngine::prepare_on_lanes(Span<const RawCloud> clouds,
                                                const std::vector<pipeline::Run>& chunks,
                                                const PrepareSettings& options,
                                                const SurfaceWatcher& watcher) {
  const Lanes::Held held = lanes_.together();
  std::vector<std::vector<std::shared_ptr<PreparedCloud>>> made(chunks.size());
  on_threads(Lanes::kTogether, [&](std::size_t lane) {
    const DeviceScope scope(device());
    for (std::size_t k = lane; k < chunks.size(); k += Lanes::kTogether) {
      made[k] = prepare_chunk(held.exec(lane), {clouds.data + chunks[k].begin, chunks[k].size()},
                              options, watcher, chunks[k].begin);
      share_time(made[k]);
    }
  });
  Clouds out;
  for (auto& chunk : made) std::move(chunk.begin(), chunk.end(), std::back_inserter(out));
  return out;
}

CudaEngine::Clouds CudaEngine::prepare_within_budget(Span<const RawCloud> clouds,
                                                     const PrepareSettings& options,
                                                     const SurfaceWatcher& watcher) {
  const Lanes::Held held = lanes_.all();
  const DeviceScope scope(device());
  pipeline::RawPointBudget budget(residence_.budget(), kRawPointsPerChunk);
  Clouds out;
  for (std::size_t begin = 0, end; begin < clouds.size; begin = end) {
    std::size_t points = clouds[begin].size;
    for (end = begin + 1; end < clouds.size && end - begin < kCloudsPerChunk &&
                          points + clouds[end].size <= budget.most_points();
         ++end)
      points += clouds[end].size;
    std::size_t bytes = 0;
    for (auto& cloud :
         prepare_chunk(held.exec(), {clouds.data + begin, end - begin}, options, watcher, begin)) {
      bytes += cloud->bytes();
      residence_.add(*cloud);
      out.push_back(std::move(cloud));
    }
    residence_.make_room(0, {});
    budget.measured(points, bytes);
  }
  return out;
}

std::size_t CudaEngine::end_within_budget(Span<const PairInput> pairs, std::size_t begin) const {
  if (!has_budget()) return pairs.size;
  std::unordered_set<const PreparedState*> clouds;
  std::size_t bytes = 0, end = begin;
  for (; end < pairs.size; ++end) {
    for (const PreparedState* cloud : {pairs[end].source, pairs[end].target})
      if (clouds.insert(cloud).second) bytes += static_cast<const PreparedCloud*>(cloud)->bytes();
    if (bytes > residence_.budget() && end > begin) break;
  }
  return end;
}

CudaEngine::ResidentPairs CudaEngine::bring(Exec& exec, Span<const PairInput> pairs) {
  std::vector<const PreparedCloud*> clouds;
  std::unordered_map<const PreparedState*, std::size_t> place;
  for (const PairInput& pair : pairs)
    for (const PreparedState* cloud : {pair.source, pair.target})
      if (place.emplace(cloud, clouds.size()).second)
        clouds.push_back(static_cast<const PreparedCloud*>(cloud));
  ResidentPairs out{residence_.bring(exec, clouds), {}};
  for (const PairInput& pair : pairs)
    out.views.push_back({out.held[place[pair.source]]->view_on_device,
                         out.held[place[pair.target]]->view_on_device, pair.custom_source.data,
                         pair.custom_target.data,
                         static_cast<std::uint32_t>(pair.custom_source.size), pair.prior});
  return out;
}

template <typename Work>
void CudaEngine::for_runs_within_budget(Span<const PairInput> pairs, const Work& work) {
  for (std::size_t begin = 0, end; begin < pairs.size; begin = end) {
    end = end_within_budget(pairs, begin);
    work(begin, end);
  }
}

void CudaEngine::align(Span<const PairInput> pairs, const RegistrationSettings& options,
                       Span<PairOutcome> outcomes) {
  const bool large = pairs.size >= kPairsOfLanes;
  const Lanes::Held held = has_budget() ? lanes_.all() : large ? lanes_.together() : lanes_.any();
  const DeviceScope scope(device());
  for_runs_within_budget(pairs, [&](std::size_t begin, std::size_t end) {
    const Span<const PairInput> run{pairs.data + begin, end - begin};
    const Span<PairOutcome> out{outcomes.data + begin, run.size};
    if (run.size < kPairsOfLanes) return align_on(held, run, options, out);
    held.exec().begin();
    const ResidentPairs resident = bring(held.exec(), run);
    const WaitOnFailure wait(held);
    on_lanes(held, run.size, [&](Exec& exec, std::size_t from, std::size_t to) {
      align_views(exec, {run.data + from, to - from}, {resident.views.data() + from, to - from},
                  options, {out.data + from, to - from});
    });
    share_time(out);
  });
}

void CudaEngine::align_on(const Lanes::Held& held, Span<const PairInput> pairs,
                          const RegistrationSettings& options, Span<PairOutcome> outcomes) {
  held.exec().begin();
  const ResidentPairs resident = bring(held.exec(), pairs);
  const WaitOnFailure wait(held);
  align_views(held.exec(), pairs, span_of(resident.views), options, outcomes);
}

void CudaEngine::align_on_lane(std::size_t lane, Span<const PairInput> pairs,
                               const RegistrationSettings& options, Span<PairOutcome> outcomes) {
  const Lanes::Held held = lanes_.one(lane);
  const DeviceScope scope(device());
  align_on(held, pairs, options, outcomes);
  share_time(outcomes);
}

std::vector<FeatureMatches> CudaEngine::match(Span<const PairInput> pairs,
                                              const RegistrationSettings& options) {
  const Lanes::Held held = has_budget() ? lanes_.all() : lanes_.any();
  const DeviceScope scope(device());
  std::vector<FeatureMatches> out;
  for_runs_within_budget(pairs, [&](std::size_t begin, std::size_t end) {
    Exec& exec = held.exec();
    exec.begin();
    const ResidentPairs resident = bring(exec, {pairs.data + begin, end - begin});
    const WaitOnFailure wait(held);
    const MatchSets matches = merge_matches(exec, span_of(resident.views), options);
    const std::size_t room = matches.room.total();
    const std::uint32_t* const count = exec.download(matches.count.data(), end - begin);
    const std::uint32_t* const source = exec.download(matches.columns().source, room);
    const std::uint32_t* const target = exec.download(matches.columns().target, room);
    exec.synchronize();
    for (std::size_t p = 0; p < end - begin; ++p) {
      const std::uint32_t first = matches.room.offset[p], last = first + count[p];
      out.push_back({{source + first, source + last}, {target + first, target + last}});
    }
  });
  return out;
}

void CudaEngine::verify(Span<const PairInput> pairs, const std::vector<PosesOfPair>& poses,
                        const RegistrationSettings& options, bool refine,
                        Span<PairOutcome> outcomes) {
  const Lanes::Held held = has_budget() ? lanes_.all() : lanes_.any();
  const DeviceScope scope(device());
  for_runs_within_budget(pairs, [&](std::size_t begin, std::size_t end) {
    held.exec().begin();
    const ResidentPairs resident = bring(held.exec(), {pairs.data + begin, end - begin});
    const WaitOnFailure wait(held);
    const std::vector<PosesOfPair> part(poses.begin() + static_cast<std::ptrdiff_t>(begin),
                                        poses.begin() + static_cast<std::ptrdiff_t>(end));
    pipeline::verify(held.exec(), span_of(resident.views), part, options, refine,
                     {outcomes.data + begin, end - begin});
  });
}

std::unique_ptr<SurfaceMatcher> CudaEngine::match_surfaces(Span<const SurfaceArrays> surfaces) {
  return std::make_unique<CudaSurfaces>(lanes_, surfaces);
}

std::unique_ptr<PlanMatcher> CudaEngine::match_plan(const plan::Map& map) {
  return std::make_unique<CudaPlan>(lanes_, map);
}

}  // namespace gpureg::cuda
