// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/types.hpp"

namespace gpureg {

enum class Backend;

/// What a PreparedCloud holds: facts on the host, data wherever the engine keeps it.
struct PreparedState {
  virtual ~PreparedState() = default;
  /// Host copies, relative to the local origin.
  virtual std::vector<Vec3> copy_points() const = 0;
  virtual std::vector<Vec3> copy_normals() const = 0;
  virtual std::vector<float> copy_features() const = 0;

  /// identifies the memory that the data lives in: clouds of one owner can be aligned
  const void* owner = nullptr;
  PrepareOptions options;
  PrepareStatistics statistics;
  float origin[3] = {0, 0, 0};  ///< local origin in the cloud's frame
  std::uint32_t size = 0;
  std::uint32_t feature_dimension = 0;
  std::uint64_t balance_total = 0;  ///< see CloudView
  float radius = 1;                 ///< see CloudView
  std::vector<Vec3> viewpoints;     ///< relative to the local origin
};

/// A pair of clouds for the engine, and optionally the caller's own correspondences.
struct PairInput {
  const PreparedState* source;
  const PreparedState* target;
  Span<const std::uint32_t> custom_source{};
  Span<const std::uint32_t> custom_target{};
  PriorTest prior{};
};

/// Poses to try beside the modes of each pair, which have their evidence by then. Only who knows
/// what evidence is worth can say where to look further, so the backends ask the public door.
struct FurtherPoses {
  std::uint32_t family;  ///< the mode that they belong to
  /// in local coordinates of both clouds; at most kMostFurtherPoses
  std::vector<Pose<double>> poses;
};
constexpr std::uint32_t kMostFurtherPoses = 8;
using FurtherSearch =
    std::function<std::vector<FurtherPoses>(Span<const PairInput>, Span<const PairOutcome>)>;

/// Private interface between the public door (src/api) and the backends (src/cpu, cuda). Calls are
/// serialised inside.
class Engine {
 public:
  virtual ~Engine() = default;
  virtual Backend backend() const = 0;
  virtual unsigned threads() const = 0;
  /// Threads that may share what the host has to do for many results.
  virtual unsigned host_threads() const { return threads(); }
  virtual std::string description() const = 0;
  virtual const void* memory() const = 0;  ///< owner of the clouds that this engine can align
  /// How many pairs go through the stages together.
  virtual std::size_t pairs_per_chunk(const RegistrationOptions& options) const = 0;
  virtual std::vector<std::shared_ptr<PreparedState>> prepare(Span<const RawCloud> clouds,
                                                              const PrepareOptions& options) = 0;
  virtual void align(Span<const PairInput> pairs, const RegistrationOptions& options,
                     Span<PairOutcome> outcomes, const FurtherSearch& further) = 0;
};

/// threads > 0. Throws BackendUnavailable where this processor lacks instructions that the stages
/// were compiled for.
std::shared_ptr<Engine> make_cpu_engine(unsigned threads);
/// Throws BackendUnavailable.
std::shared_ptr<Engine> make_cuda_engine(int device);
/// One line per CUDA device, or one line that says why there is none.
std::vector<std::string> describe_cuda_devices();

}  // namespace gpureg
