// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <functional>
#include <tuple>

#include "common/host_threads.hpp"
#include "engine.hpp"
#include "gpureg/context.hpp"

namespace gpureg::cuda {
namespace {

/// Distributes runs of elements: large ones first, small ones at the end, so that all devices
/// finish together.
class Runs {
 public:
  Runs(std::size_t items, std::size_t least, std::size_t most, std::size_t takers)
      : items_(items), least_(least), most_(most), takers_(takers) {}

  /// [begin, end), empty where nothing is left.
  std::pair<std::size_t, std::size_t> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::size_t left = items_ - next_;
    const std::size_t size =
        std::min(left, std::max(least_, std::min(most_, left / (2 * takers_))));
    next_ += size;
    return {next_ - size, next_};
  }
  void stop() {
    const std::lock_guard<std::mutex> lock(mutex_);
    next_ = items_;
  }

 private:
  std::mutex mutex_;
  std::size_t next_ = 0, items_, least_, most_, takers_;
};

constexpr std::size_t kMinPairs = 32;  ///< of a run: fewer pairs do not fill a device
constexpr std::size_t kMinClouds = 4;
constexpr std::size_t kMaxClouds = 32;
/// Chunks per call: the devices wait for each other only at its end.
constexpr std::size_t kChunksPerDevice = 16;

class EngineOfMany final : public DeviceEngine {
 public:
  EngineOfMany(const std::vector<int>& devices, std::size_t memory_budget) {
    for (const int device : devices)
      engines_.push_back(std::make_unique<CudaEngine>(device, memory_budget));
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
  std::size_t pairs_per_chunk(const RegistrationOptions& options) const override {
    return engines_[0]->pairs_per_chunk(options) * kChunksPerDevice * engines_.size();
  }

  std::vector<std::shared_ptr<PreparedState>> prepare(Span<const RawCloud> clouds,
                                                      const PrepareOptions& options) override {
    std::vector<std::shared_ptr<PreparedState>> out(clouds.size);
    Runs runs(clouds.size, kMinClouds, kMaxClouds, engines_.size());
    on_all(runs, clouds.size > kMinClouds,
           [&](CudaEngine& engine, std::size_t begin, std::size_t end) {
             auto made = engine.prepare({clouds.data + begin, end - begin}, options);
             std::move(made.begin(), made.end(), out.begin() + static_cast<std::ptrdiff_t>(begin));
           });
    return out;
  }

  std::shared_ptr<AdoptedCloud> adopt(const RawCloud& cloud, void* stream) override {
    return on(device_of(cloud.points)).adopt(cloud, stream);
  }
  std::vector<float> copy_points(const AdoptedCloud& cloud) override {
    return on(device_of(cloud)).copy_points(cloud);
  }
  std::shared_ptr<PreparedState> prepare_adopted(const AdoptedCloud& cloud,
                                                 const PrepareOptions& options) override {
    return on(device_of(cloud)).prepare_adopted(cloud, options);
  }

  void align(Span<const PairInput> pairs, const RegistrationOptions& options,
             Span<PairOutcome> outcomes) override {
    // Less than the share of a device: the first runs wait for clouds of other devices.
    Runs runs(pairs.size, kMinPairs, engines_[0]->pairs_per_chunk(options) * 3 / 4,
              engines_.size());
    on_all(runs, pairs.size > kMinPairs,
           [&](CudaEngine& engine, std::size_t begin, std::size_t end) {
             engine.align({pairs.data + begin, end - begin}, options,
                          {outcomes.data + begin, end - begin});
           });
  }

  void verify(Span<const PairInput> pairs, const std::vector<PosesOfPair>& poses,
              const RegistrationOptions& options, bool refine,
              Span<PairOutcome> outcomes) override {
    Runs runs(pairs.size, kMinPairs, engines_[0]->pairs_per_chunk(options), engines_.size());
    on_all(runs, pairs.size > kMinPairs,
           [&](CudaEngine& engine, std::size_t begin, std::size_t end) {
             const std::vector<PosesOfPair> part(poses.begin() + static_cast<std::ptrdiff_t>(begin),
                                                 poses.begin() + static_cast<std::ptrdiff_t>(end));
             engine.verify({pairs.data + begin, end - begin}, part, options, refine,
                           {outcomes.data + begin, end - begin});
           });
  }

 private:
  /// The engine of a device, or the first one, which reports the error.
  CudaEngine& on(int device) const {
    for (const auto& engine : engines_)
      if (engine->device() == device) return *engine;
    return *engines_[0];
  }

  /// Processes the runs with a thread per engine, or with the first engine alone. Rethrows the
  /// exception of the first engine that fails.
  void on_all(Runs& runs, bool spread,
              const std::function<void(CudaEngine&, std::size_t, std::size_t)>& work) {
    on_threads(spread ? engines_.size() : 1, [&](std::size_t e) {
      try {
        for (auto [begin, end] = runs.take(); begin < end; std::tie(begin, end) = runs.take())
          work(*engines_[e], begin, end);
      } catch (...) {
        runs.stop();
        throw;
      }
    });
  }

  std::vector<std::unique_ptr<CudaEngine>> engines_;
};

}  // namespace

std::shared_ptr<Engine> make_engine_of_many(const std::vector<int>& devices,
                                            std::size_t memory_budget) {
  return std::make_shared<EngineOfMany>(devices, memory_budget);
}

}  // namespace gpureg::cuda
