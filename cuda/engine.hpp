// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/device_engine.hpp"
#include "residence.hpp"

namespace gpureg::cuda {

/// Backend on one device. Clouds of all CUDA engines are compatible.
class CudaEngine final : public DeviceEngine {
 public:
  CudaEngine(int device, std::size_t memory_budget);

  int device() const { return exec_.device(); }
  Backend backend() const override;
  unsigned threads() const override { return 1; }
  unsigned host_threads() const override;
  std::string description() const override { return description_; }
  const void* memory() const override;
  std::vector<DeviceMemoryUse> device_memory() const override;
  void trim() override;
  std::size_t pairs_per_chunk(const RegistrationOptions& options) const override;
  std::vector<std::shared_ptr<PreparedState>> prepare(Span<const RawCloud> clouds,
                                                      const PrepareOptions& options) override;
  std::shared_ptr<AdoptedCloud> adopt(const RawCloud& cloud, const RowStreams& streams) override;
  std::vector<std::shared_ptr<PreparedState>> prepare_adopted(
      Span<const std::shared_ptr<AdoptedCloud>> clouds, const PrepareOptions& options) override;
  std::vector<float> copy_points(const AdoptedCloud& cloud) override;
  void align(Span<const PairInput> pairs, const RegistrationOptions& options,
             Span<PairOutcome> outcomes) override;
  void verify(Span<const PairInput> pairs, const std::vector<PosesOfPair>& poses,
              const RegistrationOptions& options, bool refine, Span<PairOutcome> outcomes) override;
  std::unique_ptr<SurfaceMatcher> match_surfaces(Span<const SurfaceArrays> surfaces) override;

 private:
  /// Calls work(views, begin, end) for runs of pairs whose clouds fit the memory budget together.
  template <typename Work>
  void for_resident_pairs(Span<const PairInput> pairs, const Work& work);
  /// Calls work(exec, begin, end) for all items at once, or for parts of them on both lanes.
  /// Returns the number of lanes at work.
  template <typename Work>
  std::size_t on_lanes(std::size_t count, bool both, const Work& work);
  std::vector<std::shared_ptr<PreparedState>> prepare_on_stream(Span<const RawCloud> clouds,
                                                                const PrepareOptions& options);
  /// Returns the memory of the prepared clouds.
  std::size_t prepare_chunk(Span<const RawCloud> clouds, const PrepareOptions& options,
                            std::vector<std::shared_ptr<PreparedState>>& out);

  std::mutex mutex_;
  /// Two lanes: while one waits for the host, or runs the last blocks of a kernel, the other uses
  /// the device. Small calls take the first one only.
  Exec exec_, second_;
  Residence residence_;
  std::string description_;
};

/// Distributes batches over several devices, with an engine and a thread for each. devices: at
/// least two; one may be repeated.
std::shared_ptr<Engine> make_engine_of_many(const std::vector<int>& devices,
                                            std::size_t memory_budget);

/// Device of the memory of a pointer; -1: not device memory.
int device_of(const void* pointer);
/// Throws InvalidArgument naming the field where a cloud's rows are not in host memory.
void check_on_host(const RawCloud& cloud);
/// Device that prepares an adopted cloud: the one that holds it.
int device_of(const AdoptedCloud& cloud);

/// Describes the devices by the status of the runtime and the driver.
std::string why_no_device(cudaError_t error, int driver, int runtime);

}  // namespace gpureg::cuda
