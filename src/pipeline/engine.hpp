// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pipeline/plan_matcher.hpp"
#include "pipeline/prepared_state.hpp"
#include "pipeline/surface_matcher.hpp"

namespace gpureg {

enum class Backend;

/// Points of both clouds whose features match, in pseudorandom order.
struct FeatureMatches {
  std::vector<std::uint32_t> source, target;
};

/// Private interface between the public API (src/api) and the backends (src/cpu, cuda).
/// Thread-safe: calls of several threads share the backend or wait for it.
class Engine {
 public:
  virtual ~Engine() = default;
  virtual Backend backend() const = 0;
  virtual unsigned threads() const = 0;
  /// Number of threads that may share the host's work on many results.
  virtual unsigned host_threads() const { return threads(); }
  /// True where align() leaves host_threads() idle while a device works.
  virtual bool leaves_host_idle() const { return false; }
  virtual std::string description() const = 0;
  virtual const void* memory() const = 0;  ///< owner of the clouds that this engine can align
  /// Number of pairs that go through the stages together.
  virtual std::size_t pairs_per_chunk(const RegistrationSettings& options) const = 0;
  /// Throws InvalidArgument for rows that the host cannot read.
  virtual void check_on_host(const RawCloud&) const {}
  /// The watcher, which may be empty, may get the surfaces of some of the clouds before the end.
  virtual std::vector<std::shared_ptr<PreparedState>> prepare(
      Span<const RawCloud> clouds, const PrepareSettings& options,
      const SurfaceWatcher& watcher = nullptr) = 0;
  virtual void align(Span<const PairInput> pairs, const RegistrationSettings& options,
                     Span<PairOutcome> outcomes) = 0;
  /// The feature matches that align() starts with (RegistrationMethod::compatibility).
  virtual std::vector<FeatureMatches> match(Span<const PairInput> pairs,
                                            const RegistrationSettings& options) = 0;
  /// Evidence of given poses, one entry for each pair; refine: they are refined before.
  virtual void verify(Span<const PairInput> pairs, const std::vector<PosesOfPair>& poses,
                      const RegistrationSettings& options, bool refine,
                      Span<PairOutcome> outcomes) = 0;
  /// Surfaces for comparisons in pairs. The arrays, in host memory, have to outlive the result.
  virtual std::unique_ptr<SurfaceMatcher> match_surfaces(Span<const SurfaceArrays> surfaces) = 0;
  /// The arrays of the map, in host memory, have to outlive the result.
  virtual std::unique_ptr<PlanMatcher> match_plan(const plan::Map& map) = 0;
};

/// threads > 0. Throws BackendUnavailable where this processor lacks instructions that the stages
/// were compiled for.
std::shared_ptr<Engine> make_cpu_engine(unsigned threads);
/// One line per CUDA device, or one line with the reason why there is none.
std::vector<std::string> describe_cuda_devices();

}  // namespace gpureg
