// SPDX-License-Identifier: BSD-3-Clause
#include "engine.hpp"

#include <algorithm>
#include <string>
#include <thread>
#include <unordered_map>

#include "common/host_threads.hpp"
#include "gpureg/context.hpp"
#include "pipeline/align.hpp"
#include "pipeline/align_by_evidence.hpp"
#include "pipeline/prepare.hpp"
#include "pipeline/runs.hpp"
#include "pipeline/verify.hpp"
#include "stages.hpp"
#include "surface_matcher.hpp"

namespace gpureg::cuda {
namespace {

/// Raw points per chunk of a preparation: enough to fill the device, few enough for its memory and
/// for page-locked staging.
constexpr std::size_t kRawPointsPerChunk = std::size_t(1) << 22;
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

/// Lanes that run at the same time take the device for a share of their time each.
void share_time(StageTimings& ms, double share) {
  for (double* stage : {&ms.match, &ms.propose, &ms.rank, &ms.refine, &ms.verify}) *stage *= share;
}

}  // namespace

CudaEngine::CudaEngine(int device, std::size_t memory_budget)
    : exec_(device), second_(device), residence_(exec_, memory_budget) {
  exec_.memory()->take_from(second_.memory().get());
  second_.memory()->take_from(exec_.memory().get());
  cudaDeviceProp properties{};
  check(cudaGetDeviceProperties(&properties, device), "cudaGetDeviceProperties");
  description_ = "cuda:" + std::to_string(device) + ", " + properties.name;
}

Backend CudaEngine::backend() const { return Backend::cuda; }

unsigned CudaEngine::host_threads() const { return exec_.host_threads(); }

const void* CudaEngine::memory() const { return &kDeviceMemory; }

std::vector<DeviceMemoryUse> CudaEngine::device_memory() const {
  const DeviceMemory &first = *exec_.memory(), &second = *second_.memory();
  return {{device(), first.bytes_in_use() + second.bytes_in_use(),
           first.bytes_reserved() + second.bytes_reserved(), residence_.evictions()}};
}

void CudaEngine::trim() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const DeviceScope scope(device());
  exec_.trim();
  second_.trim();
}

// Memory of a pair: a bit per hypothesis, rounded up to chunks; a bit per seed and match, the sums
// of a fit, a pose and its evidence per seed, the columns, the row and the keys of each match, and
// the sampled points.
std::size_t CudaEngine::pairs_per_chunk(const RegistrationOptions& options) const {
  constexpr std::size_t kChunkBytes = 4096, kSeedBytes = 192, kMatchBytes = 160,
                        kSampleBytesPerPoint = 112;
  std::size_t fit = kSampleBytes / (options.quadruples.count / 8 + kChunkBytes);
  if (options.method == RegistrationMethod::compatibility) {
    const CompatibilityOptions& c = options.compatibility;
    fit = kNeighborhoodBytes / (std::size_t(c.seeds) * (c.max_matches / 8 + kSeedBytes) +
                                std::size_t(c.max_matches) * kMatchBytes +
                                std::size_t(options.evidence.sample) * kSampleBytesPerPoint);
  }
  return fit < 1 ? 1 : (fit < kPairsPerChunk ? fit : kPairsPerChunk);
}

template <typename Work>
std::size_t CudaEngine::on_lanes(std::size_t count, bool both, const Work& work) {
  if (!both) {
    work(exec_, 0, count);
    return 1;
  }
  // The lanes take the parts alternately. Parts of two sizes keep them from waiting for the host
  // at the same time.
  const std::size_t ends[] = {0, count / 6, count / 2, count * 5 / 6, count};
  on_threads(2, [&](std::size_t lane) {
    const DeviceScope scope(device());
    Exec& exec = lane == 0 ? exec_ : second_;
    for (std::size_t part = lane; part < 4; part += 2) {
      exec.begin();
      work(exec, ends[part], ends[part + 1]);
    }
  });
  return 2;
}

std::size_t CudaEngine::prepare_chunk(Span<const RawCloud> clouds, const PrepareOptions& options,
                                      std::vector<std::shared_ptr<PreparedState>>& out) {
  exec_.begin();
  std::size_t bytes = 0;
  for (auto& cloud : pipeline::prepare(exec_, clouds, options)) {
    cloud->owner = memory();
    auto fragment = std::make_shared<Fragment>(std::move(cloud));
    bytes += fragment->bytes();
    residence_.add(*fragment);
    out.push_back(std::move(fragment));
  }
  residence_.make_room(0, {});
  return bytes;
}

std::vector<std::shared_ptr<PreparedState>> CudaEngine::prepare(Span<const RawCloud> clouds,
                                                                const PrepareOptions& options) {
  const DeviceScope scope(device());
  for (const RawCloud& cloud : clouds) check_on_host(cloud);
  const std::lock_guard<std::mutex> lock(mutex_);
  return prepare_on_stream(clouds, options);
}

std::vector<std::shared_ptr<PreparedState>> CudaEngine::prepare_on_stream(
    Span<const RawCloud> clouds, const PrepareOptions& options) {
  pipeline::RawPointBudget budget(residence_.budget(), kRawPointsPerChunk);
  std::vector<std::shared_ptr<PreparedState>> out;
  for (std::size_t begin = 0, end; begin < clouds.size; begin = end) {
    std::size_t points = clouds[begin].size;
    for (end = begin + 1; end < clouds.size && end - begin < kCloudsPerChunk &&
                          points + clouds[end].size <= budget.most_points();
         ++end)
      points += clouds[end].size;
    budget.measured(points, prepare_chunk({clouds.data + begin, end - begin}, options, out));
  }
  return out;
}

template <typename Work>
void CudaEngine::for_resident_pairs(Span<const PairInput> pairs, const Work& work) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const DeviceScope scope(device());
  const std::size_t budget = residence_.budget();
  for (std::size_t begin = 0, end; begin < pairs.size; begin = end) {
    // As many pairs as keep their clouds within the budget, but at least one.
    std::vector<const Fragment*> fragments;
    std::unordered_map<const PreparedState*, std::size_t> place;
    std::size_t bytes = 0;
    for (end = begin; end < pairs.size; ++end) {
      const PreparedState* both[2] = {pairs[end].source, pairs[end].target};
      std::size_t more = 0;
      for (int k = 0; k < 2; ++k)
        if (place.count(both[k]) == 0 && (k == 0 || both[0] != both[1]))
          more += static_cast<const Fragment*>(both[k])->bytes();
      if (budget > 0 && end > begin && bytes + more > budget) break;
      bytes += more;
      for (const PreparedState* cloud : both)
        if (place.emplace(cloud, fragments.size()).second)
          fragments.push_back(static_cast<const Fragment*>(cloud));
    }
    exec_.begin();
    const auto held = residence_.bring(fragments);
    std::vector<PairView> views;
    for (std::size_t p = begin; p < end; ++p)
      views.push_back({held[place[pairs[p].source]]->view_on_device,
                       held[place[pairs[p].target]]->view_on_device, pairs[p].custom_source.data,
                       pairs[p].custom_target.data,
                       static_cast<std::uint32_t>(pairs[p].custom_source.size), pairs[p].prior});
    work(span_of(views), begin, end);
  }
}

void CudaEngine::align(Span<const PairInput> pairs, const RegistrationOptions& options,
                       Span<PairOutcome> outcomes) {
  for_resident_pairs(pairs, [&](Span<const PairView> views, std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    const std::size_t lanes =
        on_lanes(count, count >= kPairsOfLanes, [&](Exec& exec, std::size_t from, std::size_t to) {
          const Span<const PairView> part{views.data + from, to - from};
          const Span<PairOutcome> out{outcomes.data + begin + from, to - from};
          if (options.method == RegistrationMethod::compatibility)
            pipeline::align_by_evidence(exec, {pairs.data + begin + from, to - from}, part, options,
                                        out);
          else
            pipeline::align(exec, part, options, out);
        });
    for (std::size_t p = begin; p < end; ++p)
      share_time(outcomes[p].timings, 1.0 / static_cast<double>(lanes));
  });
}

void CudaEngine::verify(Span<const PairInput> pairs, const std::vector<PosesOfPair>& poses,
                        const RegistrationOptions& options, bool refine,
                        Span<PairOutcome> outcomes) {
  for_resident_pairs(pairs, [&](Span<const PairView> views, std::size_t begin, std::size_t end) {
    const std::vector<PosesOfPair> part(poses.begin() + static_cast<std::ptrdiff_t>(begin),
                                        poses.begin() + static_cast<std::ptrdiff_t>(end));
    pipeline::verify(exec_, views, part, options, refine, {outcomes.data + begin, end - begin});
  });
}

std::unique_ptr<SurfaceMatcher> CudaEngine::match_surfaces(Span<const SurfaceArrays> surfaces) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const DeviceScope scope(device());
  exec_.begin();
  return std::make_unique<CudaSurfaces>(exec_, mutex_, surfaces);
}

}  // namespace gpureg::cuda
