// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/residence.hpp"
#include "cuda/device/lanes.hpp"
#include "pipeline/device_engine.hpp"
#include "pipeline/runs.hpp"

namespace gpureg::cuda {

/// Backend on one device. Clouds of all CUDA engines are compatible.
///
/// Large calls work on two lanes, small ones on one that is free. With a memory budget every call
/// has all lanes, so that what it needs at once is known.
class CudaEngine final : public DeviceEngine {
 public:
  CudaEngine(int device, std::size_t memory_budget);

  int device() const { return residence_.device(); }
  bool has_budget() const { return residence_.budget() > 0; }
  Backend backend() const override;
  unsigned threads() const override { return 1; }
  unsigned host_threads() const override;
  std::string description() const override { return description_; }
  const void* memory() const override;
  /// Makes copies of clouds to the device of another engine faster.
  void allow_copies_to(const CudaEngine& other);
  std::vector<DeviceMemoryUse> device_memory() const override;
  void trim() override;
  std::size_t pairs_per_chunk(const RegistrationSettings& options) const override;
  void check_on_host(const RawCloud& cloud) const override;
  std::vector<std::shared_ptr<PreparedState>> prepare(
      Span<const RawCloud> clouds, const PrepareSettings& options,
      const SurfaceWatcher& watcher = nullptr) override;
  std::shared_ptr<AdoptedCloud> adopt(const RawCloud& cloud, const RowStreams& streams) override;
  std::vector<std::shared_ptr<PreparedState>> prepare_adopted(
      Span<const std::shared_ptr<AdoptedCloud>> clouds, const PrepareSettings& options) override;
  std::vector<float> copy_points(const AdoptedCloud& cloud) override;
  void align(Span<const PairInput> pairs, const RegistrationSettings& options,
             Span<PairOutcome> outcomes) override;
  /// On one lane; other threads may use the others at the same time. Requires !has_budget().
  void align_on_lane(std::size_t lane, Span<const PairInput> pairs,
                     const RegistrationSettings& options, Span<PairOutcome> outcomes);
  std::vector<FeatureMatches> match(Span<const PairInput> pairs,
                                    const RegistrationSettings& options) override;
  void verify(Span<const PairInput> pairs, const std::vector<PosesOfPair>& poses,
              const RegistrationSettings& options, bool refine,
              Span<PairOutcome> outcomes) override;
  std::unique_ptr<SurfaceMatcher> match_surfaces(Span<const SurfaceArrays> surfaces) override;
  std::unique_ptr<PlanMatcher> match_plan(const plan::Map& map) override;

 private:
  /// Pairs as the stages see them. The clouds stay on the device as long as they are held.
  struct ResidentPairs {
    std::vector<std::shared_ptr<const CudaCloud>> held;
    std::vector<PairView> views;
  };
  using Clouds = std::vector<std::shared_ptr<PreparedState>>;

  /// Calls work(exec, begin, end) for parts of the items on the lanes.
  template <typename Work>
  void on_lanes(const Lanes::Held& held, std::size_t count, const Work& work);
  /// End of the longest run of pairs from `begin` whose clouds are within the memory budget
  /// together; of one pair at least.
  std::size_t end_within_budget(Span<const PairInput> pairs, std::size_t begin) const;
  ResidentPairs bring(Exec& exec, Span<const PairInput> pairs);
  void align_on(const Lanes::Held& held, Span<const PairInput> pairs,
                const RegistrationSettings& options, Span<PairOutcome> outcomes);
  /// Calls work(begin, end) for runs of pairs whose clouds are within the memory budget together.
  template <typename Work>
  void for_runs_within_budget(Span<const PairInput> pairs, const Work& work);

  /// Chunk after chunk, each as large as the memory budget allows after those before it.
  Clouds prepare_within_budget(Span<const RawCloud> clouds, const PrepareSettings& options,
                               const SurfaceWatcher& watcher);
  /// Chunks on both lanes in turns: while one uploads, the other computes.
  Clouds prepare_on_lanes(Span<const RawCloud> clouds, const std::vector<pipeline::Run>& chunks,
                          const PrepareSettings& options, const SurfaceWatcher& watcher);

  Lanes lanes_;
  Residence residence_;
  std::string description_;
};

/// Distributes batches over several devices, with an engine and a thread for each. devices: at
/// least two; one may be repeated.
std::shared_ptr<Engine> make_engine_of_many(const std::vector<int>& devices,
                                            std::size_t memory_budget);

/// Device of the memory of a pointer; -1: not device memory.
int device_of(const void* pointer);
/// Device that prepares an adopted cloud: the one that holds it.
int device_of(const AdoptedCloud& cloud);

/// Loads the kernel of adopt() on the current device. CUDA loads a kernel at its first launch, and
/// may wait for the device then: for ever, where the program holds up the stream of that launch.
void load_adoption();

/// Describes the devices by the status of the runtime and the driver.
std::string why_no_device(cudaError_t error, int driver, int runtime);

}  // namespace gpureg::cuda
