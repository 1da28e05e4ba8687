// SPDX-License-Identifier: BSD-3-Clause
#include <mutex>
#include <string>

#include "algorithm/normal_weight.hpp"
#include "cpu/cell_summary.hpp"
#include "cpu/stages.hpp"
#include "cpu/surface_matcher.hpp"
#include "gpureg/context.hpp"
#include "gpureg/error.hpp"
#include "pipeline/align.hpp"
#include "pipeline/align_by_evidence.hpp"
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
             Span<PairOutcome> outcomes) override {
    std::lock_guard<std::mutex> lock(mutex_);
    const std::vector<PairView> views = views_of(pairs);
    if (options.method == RegistrationMethod::compatibility)
      pipeline::align_by_evidence(exec_, pairs, span_of(views), options, outcomes);
    else
      pipeline::align(exec_, span_of(views), options, outcomes);
  }

  void verify(Span<const PairInput> pairs, const std::vector<PosesOfPair>& poses,
              const RegistrationOptions& options, bool refine,
              Span<PairOutcome> outcomes) override {
    std::lock_guard<std::mutex> lock(mutex_);
    const std::vector<PairView> views = views_of(pairs);
    pipeline::verify(exec_, span_of(views), poses, options, refine, outcomes);
  }

  std::unique_ptr<SurfaceMatcher> match_surfaces(Span<const SurfaceArrays> surfaces) override {
    return std::make_unique<CpuSurfaces>(exec_, mutex_, surfaces);
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

std::uint64_t weight_by_normals(const std::vector<Vec3>& normals,
                                std::vector<std::uint32_t>& weight) {
  std::uint32_t count[kNormalBins] = {};
  weight.resize(normals.size());
  for (std::size_t i = 0; i < normals.size(); ++i) ++count[weight[i] = normal_bin(normals[i])];
  std::uint64_t total = 0;
  for (std::uint32_t& w : weight) total += w = normal_weight_in_bin(count[w]);
  return total;
}

}  // namespace

CloudView CpuCloud::view() const {
  const bool wide = !wide_features.values.empty();
  CloudView v{};
  v.points = points.data();
  v.normals = normals.data();
  v.features = features.values.data();
  v.has_feature = features.valid.data();
  v.size = size;
  v.feature_dimension = feature_dimension;
  v.radius = radius;
  v.closest = closest.view();
  v.executor_data = this;
  v.wide_features = wide ? wide_features.values.data() : nullptr;
  v.has_wide_feature = wide ? wide_features.valid.data() : nullptr;
  v.normal_weight = normal_weight.data();
  v.normal_weight_total = normal_weight_total;
  v.visibility = visibility.view();
  v.surface_sides = surface_sides.view();
  return v;
}

std::vector<std::shared_ptr<CpuCloud>> assemble(
    Exec& exec, std::vector<DownsampledCloud>& clouds, std::vector<std::vector<Vec3>>& normals,
    std::vector<Features>& features, std::vector<Features>& wide_features,
    std::vector<ClosestGrid>& closest, std::vector<Visibility>& visibility,
    std::vector<SurfaceSides>& surface_sides, const PrepareOptions& options) {
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
    cloud->surface_sides = std::move(surface_sides[c]);
    cloud->normal_weight_total = weight_by_normals(cloud->normals, cloud->normal_weight);
    cloud->closest = std::move(closest[c]);
    cloud->order =
        scoring_order(cloud->points, cloud->normals, options.max_correspondence_distance);
    cloud->summaries = summarize_cells(cloud->closest, options.max_correspondence_distance,
                                       cloud->radius, cloud->points, cloud->normals);
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
