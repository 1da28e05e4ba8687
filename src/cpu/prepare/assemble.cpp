// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/normal_weight.hpp"
#include "cpu/common/cell_summary.hpp"
#include "cpu/common/stages.hpp"

namespace gpureg::cpu {
namespace {

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
  v.closest = closest->view();
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
    std::vector<std::shared_ptr<const ClosestGrid>>& closest, std::vector<Visibility>& visibility,
    std::vector<SurfaceSides>& surface_sides, const PrepareSettings& options) {
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
    cloud->summaries = summarize_cells(*cloud->closest, options.max_correspondence_distance,
                                       cloud->radius, cloud->points, cloud->normals);
    out[c] = std::move(cloud);
  });
  return out;
}

}  // namespace gpureg::cpu
