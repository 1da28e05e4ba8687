// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <functional>

#include "common/host_threads.hpp"
#include "cuda/common/engine.hpp"
#include "gpureg/context.hpp"
#include "pipeline/runs.hpp"

namespace gpureg::cuda {
namespace {

using pipeline::Run;
using pipeline::SharedRuns;

constexpr std::size_t kMinPairs = 32;  ///< of a run: fewer pairs do not fill a device
/// Runs of a lane in the pairs that a device aligns at once: they are short enough for all lanes to
/// end together.
constexpr std::size_t kRunsPerChunk = 4;
/// A run has at least kMinClouds clouds, in large batches kMostMinClouds, and at most kMaxClouds.
constexpr std::size_t kMinClouds = 4, kMostMinClouds = 32, kMaxClouds = 128;
/// Chunks per call: the devices wait for each other only at its end.
constexpr std::size_t kChunksPerDevice = 16;

/// The surfaces on every device; each adds up runs of the pairs.
class SurfacesOfMany final : public SurfaceMatcher {
 public:
  explicit SurfacesOfMany(std::vector<std::unique_ptr<SurfaceMatcher>> parts)
      : parts_(std::move(parts)) {}

  void add_up(Span<const SurfacePairInput> pairs, const SurfaceTerms& terms,
              Span<SurfaceSums> sums) override {
    const std::size_t share = (pairs.size + parts_.size() - 1) / parts_.size();
    on_threads(parts_.size(), [&](std::size_t part) {
      const std::size_t begin = std::min(part * share, pairs.size),
                        end = std::min(begin + share, pairs.size);
      parts_[part]->add_up({pairs.data + begin, end - begin}, terms,
                           {sums.data + begin, end - begin});
    });
  }

 private:
  std::vector<std::unique_ptr<SurfaceMatcher>> parts_;
};

class EngineOfMany final : public DeviceEngine {
 public:
  EngineOfMany(const std::vector<int>& devices, std::size_t memory_budget)
      : bounded_(memory_budget > 0) {
    for (const int device : devices)
      engines_.push_back(std::make_unique<CudaEngine>(device, memory_budget));
    for (const auto& from : engines_)
      for (const auto& to : engines_) from->allow_copies_to(*to);
  }

  Backend backend() const override { return Backend::cuda; }
  unsigned threads() const override { return static_cast<unsigned>(engines_.size()); }
  unsigned host_threads() const override { return engines_[0]->host_threads(); }
  std::string description() const override {
    std::string text;
    for (const auto& engine : engines_) text += (text.empty() ? "" : "; ") + engine->description();
    return text;
  }
  const void* memory() const override { return engines_[0]->memory(); }
  std::vector<DeviceMemoryUse> device_memory() const override {
    std::vector<DeviceMemoryUse> out;
    for (const auto& engine : engines_) out.push_back(engine->device_memory()[0]);
    return out;
  }
  void trim() override {
    for (const auto& engine : engines_) engine->trim();
  }
  std::size_t pairs_per_chunk(const RegistrationSettings& options) const override {
    return engines_[0]->pairs_per_chunk(options) * kChunksPerDevice * engines_.size();
  }

  void check_on_host(const RawCloud& cloud) const override { engines_[0]->check_on_host(cloud); }
  std::vector<std::shared_ptr<PreparedState>> prepare(Span<const RawCloud> clouds,
                                                      const PrepareSettings& options,
                                                      const SurfaceWatcher&) override {
    std::vector<std::shared_ptr<PreparedState>> out(clouds.size);
    const std::size_t share = clouds.size / engines_.size();
    SharedRuns runs(clouds.size, std::clamp(share, kMinClouds, kMostMinClouds), kMaxClouds,
                    engines_.size());
    on_all(runs, clouds.size > kMinClouds,
           [&](CudaEngine& engine, std::size_t begin, std::size_t end) {
             auto made = engine.prepare({clouds.data + begin, end - begin}, options);
             std::move(made.begin(), made.end(), out.begin() + static_cast<std::ptrdiff_t>(begin));
           });
    return out;
  }

  std::shared_ptr<AdoptedCloud> adopt(const RawCloud& cloud, const RowStreams& streams) override {
    return on(device_of(cloud.points)).adopt(cloud, streams);
  }
  std::vector<float> copy_points(const AdoptedCloud& cloud) override {
    return engines_[index_of(device_of(cloud))]->copy_points(cloud);
  }
  // Each device prepares the clouds that it holds.
  std::vector<std::shared_ptr<PreparedState>> prepare_adopted(
      Span<const std::shared_ptr<AdoptedCloud>> clouds, const PrepareSettings& options) override {
    std::vector<std::vector<std::shared_ptr<AdoptedCloud>>> share(engines_.size());
    std::vector<std::vector<std::size_t>> place(engines_.size());
    for (std::size_t k = 0; k < clouds.size; ++k) {
      const std::size_t e = index_of(device_of(*clouds[k]));
      share[e].push_back(clouds[k]);
      place[e].push_back(k);
    }
    std::vector<std::size_t> used;
    for (std::size_t e = 0; e < share.size(); ++e)
      if (!share[e].empty()) used.push_back(e);
    std::vector<std::shared_ptr<PreparedState>> out(clouds.size);
    on_threads(used.size(), [&](std::size_t worker) {
      const std::size_t e = used[worker];
      auto made = engines_[e]->prepare_adopted(span_of(share[e]), options);
      for (std::size_t k = 0; k < made.size(); ++k) out[place[e][k]] = std::move(made[k]);
    });
    return out;
  }

  void align(Span<const PairInput> pairs, const RegistrationSettings& options,
             Span<PairOutcome> outcomes) override {
    const std::size_t most = engines_[0]->pairs_per_chunk(options);
    if (bounded_) {
      SharedRuns runs(pairs.size, kMinPairs, most, engines_.size());
      return on_all(runs, pairs.size > kMinPairs,
                    [&](CudaEngine& engine, std::size_t begin, std::size_t end) {
                      engine.align({pairs.data + begin, end - begin}, options,
                                   {outcomes.data + begin, end - begin});
                    });
    }
    if (pairs.size <= kMinPairs) return engines_[0]->align(pairs, options, outcomes);
    // Every lane of every device takes runs: none waits for another one but at the end.
    const std::size_t lanes = engines_.size() * Lanes::kTogether;
    SharedRuns runs(pairs.size, kMinPairs, most / kRunsPerChunk, lanes);
    take_all(runs, lanes, [&](std::size_t k, std::size_t begin, std::size_t end) {
      engines_[k % engines_.size()]->align_on_lane(k / engines_.size(),
                                                   {pairs.data + begin, end - begin}, options,
                                                   {outcomes.data + begin, end - begin});
    });
  }

  /// On the first device: the matches of a few pairs take a millisecond.
  std::vector<FeatureMatches> match(Span<const PairInput> pairs,
                                    const RegistrationSettings& options) override {
    return engines_[0]->match(pairs, options);
  }

  void verify(Span<const PairInput> pairs, const std::vector<PosesOfPair>& poses,
              const RegistrationSettings& options, bool refine,
              Span<PairOutcome> outcomes) override {
    SharedRuns runs(pairs.size, kMinPairs, engines_[0]->pairs_per_chunk(options), engines_.size());
    on_all(runs, pairs.size > kMinPairs,
           [&](CudaEngine& engine, std::size_t begin, std::size_t end) {
             const std::vector<PosesOfPair> part(poses.begin() + static_cast<std::ptrdiff_t>(begin),
                                                 poses.begin() + static_cast<std::ptrdiff_t>(end));
             engine.verify({pairs.data + begin, end - begin}, part, options, refine,
                           {outcomes.data + begin, end - begin});
           });
  }

  std::unique_ptr<SurfaceMatcher> match_surfaces(Span<const SurfaceArrays> surfaces) override {
    std::vector<std::unique_ptr<SurfaceMatcher>> parts(engines_.size());
    on_threads(parts.size(),
               [&](std::size_t e) { parts[e] = engines_[e]->match_surfaces(surfaces); });
    return std::make_unique<SurfacesOfMany>(std::move(parts));
  }
  /// On the first device: the search of a scan takes milliseconds.
  std::unique_ptr<PlanMatcher> match_plan(const plan::Map& map) override {
    return engines_[0]->match_plan(map);
  }

 private:
  /// The engine of a device, or the first one, which reports the error.
  std::size_t index_of(int device) const {
    for (std::size_t e = 0; e < engines_.size(); ++e)
      if (engines_[e]->device() == device) return e;
    return 0;
  }
  CudaEngine& on(int device) const { return *engines_[index_of(device)]; }

  /// Processes the runs with a thread per engine, or with the first engine alone.
  void on_all(SharedRuns& runs, bool spread,
              const std::function<void(CudaEngine&, std::size_t, std::size_t)>& work) {
    take_all(
        runs, spread ? engines_.size() : 1,
        [&](std::size_t e, std::size_t begin, std::size_t end) { work(*engines_[e], begin, end); });
  }

  /// Calls work(taker, begin, end) for the runs, with a thread for each of the takers. Rethrows the
  /// exception of the first taker that fails.
  template <typename Work>
  static void take_all(SharedRuns& runs, std::size_t takers, const Work& work) {
    on_threads(takers, [&](std::size_t taker) {
      try {
        for (Run run = runs.take(); run.size() > 0; run = runs.take())
          work(taker, run.begin, run.end);
      } catch (...) {
        runs.stop();
        throw;
      }
    });
  }

  bool bounded_;  ///< a memory budget
  std::vector<std::unique_ptr<CudaEngine>> engines_;
};

}  // namespace

std::shared_ptr<Engine> make_engine_of_many(const std::vector<int>& devices,
                                            std::size_t memory_budget) {
  return std::make_shared<EngineOfMany>(devices, memory_budget);
}

}  // namespace gpureg::cuda
