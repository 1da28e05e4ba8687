// SPDX-License-Identifier: BSD-3-Clause
#include <mutex>
#include <string>

#include "cpu/common/plan_matcher.hpp"
#include "cpu/common/stages.hpp"
#include "cpu/common/surface_matcher.hpp"
#include "gpureg/context.hpp"
#include "gpureg/error.hpp"
#include "pipeline/align_by_compatibility.hpp"
#include "pipeline/align_by_quadruples.hpp"
#include "pipeline/engine.hpp"
#include "pipeline/prepare.hpp"
#include "pipeline/verify.hpp"

namespace gpureg::cpu {
namespace {

/// Host memory has one owner: clouds of all CPU contexts are compatible.
const char kHostMemory = 0;

class CpuEngine final : public Engine {
 public:
  explicit CpuEngine(unsigned threads) : exec_(threads) {}

  Backend backend() const override { return Backend::cpu; }
  unsigned threads() const override { return exec_.threads(); }
  std::string description() const override {
    return "cpu, " + std::to_string(exec_.threads()) +
           (exec_.threads() == 1 ? " thread" : " threads");
  }
  const void* memory() const override { return &kHostMemory; }
  // Enough pairs to keep all threads busy at the end of a stage, few enough for prompt progress and
  // cancellation.
  std::size_t pairs_per_chunk(const RegistrationSettings&) const override {
    return 2 * exec_.threads() + 2;
  }

  std::vector<std::shared_ptr<PreparedState>> prepare(Span<const RawCloud> clouds,
                                                      const PrepareSettings& options,
                                                      const SurfaceWatcher&) override {
    std::lock_guard<std::mutex> lock(mutex_);
    auto prepared = pipeline::prepare(exec_, clouds, options);
    for (auto& cloud : prepared) cloud->owner = &kHostMemory;
    return {prepared.begin(), prepared.end()};
  }

  void align(Span<const PairInput> pairs, const RegistrationSettings& options,
             Span<PairOutcome> outcomes) override {
    std::lock_guard<std::mutex> lock(mutex_);
    const std::vector<PairView> views = views_of(pairs);
    if (options.method == RegistrationMethod::compatibility)
      pipeline::align_by_compatibility(exec_, pairs, span_of(views), options, outcomes);
    else
      pipeline::align_by_quadruples(exec_, span_of(views), options, outcomes);
  }

  std::vector<FeatureMatches> match(Span<const PairInput> pairs,
                                    const RegistrationSettings& options) override {
    std::lock_guard<std::mutex> lock(mutex_);
    const std::vector<PairView> views = views_of(pairs);
    std::vector<FeatureMatches> out;
    for (MatchSet& matches : merge_matches(exec_, span_of(views), options))
      out.push_back({std::move(matches.source), std::move(matches.target)});
    return out;
  }

  void verify(Span<const PairInput> pairs, const std::vector<PosesOfPair>& poses,
              const RegistrationSettings& options, bool refine,
              Span<PairOutcome> outcomes) override {
    std::lock_guard<std::mutex> lock(mutex_);
    const std::vector<PairView> views = views_of(pairs);
    pipeline::verify(exec_, span_of(views), poses, options, refine, outcomes);
  }

  std::unique_ptr<SurfaceMatcher> match_surfaces(Span<const SurfaceArrays> surfaces) override {
    return std::make_unique<CpuSurfaces>(exec_, mutex_, surfaces);
  }

  std::unique_ptr<PlanMatcher> match_plan(const plan::Map& map) override {
    return std::make_unique<CpuPlan>(exec_, mutex_, map);
  }

 private:
  static std::vector<PairView> views_of(Span<const PairInput> pairs) {
    std::vector<PairView> views(pairs.size);
    for (std::size_t p = 0; p < pairs.size; ++p)
      views[p] = {static_cast<const CpuCloud*>(pairs[p].source)->view(),
                  static_cast<const CpuCloud*>(pairs[p].target)->view(),
                  pairs[p].custom_source.data,
                  pairs[p].custom_target.data,
                  static_cast<std::uint32_t>(pairs[p].custom_source.size),
                  pairs[p].prior};
    return views;
  }

  std::mutex mutex_;
  Exec exec_;
};

}  // namespace
}  // namespace gpureg::cpu

namespace gpureg {

std::shared_ptr<Engine> make_cpu_engine(unsigned threads) {
#if defined(__AVX2__) && (defined(__GNUC__) || defined(__clang__))
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
    throw BackendUnavailable(
        "this processor has no AVX2 and FMA, which gpureg was compiled for: rebuild with "
        "-DGPUREG_CPU_ARCH=");
#endif
  return std::make_shared<cpu::CpuEngine>(threads);
}

}  // namespace gpureg
