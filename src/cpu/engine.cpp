// SPDX-License-Identifier: BSD-3-Clause
#include <mutex>
#include <string>

#include "algorithm/balance.hpp"
#include "cpu/cell_summary.hpp"
#include "cpu/stages.hpp"
#include "gpureg/error.hpp"
#include "pipeline/align.hpp"
#include "pipeline/align_by_evidence.hpp"
#include "pipeline/backend.hpp"
#include "pipeline/prepare.hpp"

namespace gpureg::cpu {
namespace {

/// Host memory has one owner: clouds of any CPU context go with any other.
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
  // Enough that no thread waits at the end of a stage, few enough that progress and cancelling stay
  // lively.
  std::size_t pairs_per_chunk(const RegistrationOptions&) const override {
    return 2 * exec_.threads() + 2;
  }

  std::vector<std::shared_ptr<PreparedState>> prepare(Span<const RawCloud> clouds,
                                                      const PrepareOptions& options) override {
    std::lock_guard<std::mutex> lock(mutex_);
    auto prepared = pipeline::prepare(exec_, clouds, options);
    for (auto& cloud : prepared) cloud->owner = &kHostMemory;
    return {prepared.begin(), prepared.end()};
  }

  void align(Span<const PairInput> pairs, const RegistrationOptions& options,
             Span<PairOutcome> outcomes, const FurtherSearch& further) override {
    std::lock_guard<std::mutex> lock(mutex_);
    std::vector<PairView> views(pairs.size);
    for (std::size_t p = 0; p < pairs.size; ++p)
      views[p] = {static_cast<const CpuCloud*>(pairs[p].source)->view(),
                  static_cast<const CpuCloud*>(pairs[p].target)->view(),
                  pairs[p].custom_source.data,
                  pairs[p].custom_target.data,
                  static_cast<std::uint32_t>(pairs[p].custom_source.size),
                  pairs[p].prior};
    if (options.hypothesis.proposal == Proposal::compatibility)
      pipeline::align_by_evidence(exec_, pairs, span_of(views), options, further, outcomes);
    else
      pipeline::align(exec_, span_of(views), options, outcomes);
  }

 private:
  std::mutex mutex_;
  Exec exec_;
};

std::uint64_t balance_points(const std::vector<Vec3>& normals, std::vector<std::uint32_t>& weight) {
  std::uint32_t count[kBalanceBins] = {};
  weight.resize(normals.size());
  for (std::size_t i = 0; i < normals.size(); ++i) ++count[weight[i] = balance_bin(normals[i])];
  std::uint64_t total = 0;
  for (std::uint32_t& w : weight) total += w = balance_weight(count[w]);
  return total;
}

}  // namespace

CloudView CpuCloud::view() const {
  const bool wide = !wide_features.values.empty();
  return {points.data(),
          normals.data(),
          features.values.data(),
          features.valid.data(),
          size,
          feature_dimension,
          radius,
          closest.view(),
          this,
          wide ? wide_features.values.data() : nullptr,
          wide ? wide_features.valid.data() : nullptr,
          balance.data(),
          balance_total,
          visibility.view(),
          fronts.view()};
}

std::vector<std::shared_ptr<CpuCloud>> assemble(
    Exec& exec, std::vector<DownsampledCloud>& clouds, std::vector<std::vector<Vec3>>& normals,
    std::vector<Features>& features, std::vector<Features>& wide_features,
    std::vector<ClosestGrid>& closest, std::vector<Visibility>& visibility,
    std::vector<Fronts>& fronts, const PrepareOptions& options) {
  std::vector<std::shared_ptr<CpuCloud>> out(clouds.size());
  exec.parallel(clouds.size(), [&](std::size_t c) {
    auto cloud = std::make_shared<CpuCloud>();
    cloud->options = options;
    for (int k = 0; k < 3; ++k) cloud->origin[k] = clouds[c].origin[k];
    cloud->size = static_cast<std::uint32_t>(clouds[c].points.size());
    cloud->feature_dimension = features[c].dimension;
    cloud->radius = clouds[c].radius;
    cloud->viewpoints = std::move(clouds[c].viewpoints);
    cloud->statistics.input_points = clouds[c].input_points;
    cloud->statistics.invalid_points = clouds[c].invalid_points;
    cloud->statistics.points = cloud->size;
    for (const Vec3& n : normals[c]) cloud->statistics.points_without_normal += is_zero(n);
    for (const std::uint8_t v : features[c].valid) cloud->statistics.points_without_feature += !v;
    cloud->points = std::move(clouds[c].points);
    cloud->normals = std::move(normals[c]);
    cloud->features = std::move(features[c]);
    cloud->wide_features = std::move(wide_features[c]);
    cloud->visibility = std::move(visibility[c]);
    cloud->fronts = std::move(fronts[c]);
    cloud->balance_total = balance_points(cloud->normals, cloud->balance);
    cloud->closest = std::move(closest[c]);
    cloud->order = scoring_order(cloud->points, cloud->normals, options.search_distance);
    cloud->summaries = summarize_cells(cloud->closest, options.search_distance, cloud->radius,
                                       cloud->points, cloud->normals);
    out[c] = std::move(cloud);
  });
  return out;
}

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
