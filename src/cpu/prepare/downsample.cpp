// SPDX-License-Identifier: BSD-3-Clause
#include <limits>

#include "algorithm/normal.hpp"
#include "algorithm/voxel.hpp"
#include "common/radix_sort.hpp"
#include "cpu/common/stages.hpp"
#include "pipeline/checks.hpp"

namespace gpureg::cpu {
namespace {

Vec3 row(const float* values, std::size_t stride, std::size_t i) {
  const float* v = values + i * stride;
  return {v[0], v[1], v[2]};
}

void find_origin(const RawCloud& raw, float voxel_size, DownsampledCloud& out,
                 std::vector<std::uint32_t>& finite) {
  constexpr float inf = std::numeric_limits<float>::infinity();
  float lo[3] = {inf, inf, inf}, hi[3] = {-inf, -inf, -inf};
  finite.reserve(raw.size);
  for (std::size_t i = 0; i < raw.size; ++i) {
    const Vec3 p = row(raw.points, raw.point_stride, i);
    if (!all_finite(p)) continue;
    finite.push_back(static_cast<std::uint32_t>(i));
    const float c[3] = {p.x, p.y, p.z};
    for (int k = 0; k < 3; ++k) {
      lo[k] = c[k] < lo[k] ? c[k] : lo[k];
      hi[k] = c[k] > hi[k] ? c[k] : hi[k];
    }
  }
  out.input_points = raw.size;
  out.matched_only = raw.matched_only;
  out.invalid_points = raw.size - finite.size();
  if (finite.empty()) return;
  for (int k = 0; k < 3; ++k) out.origin[k] = local_origin(lo[k], hi[k], voxel_size);
  const Vec3 origin{out.origin[0], out.origin[1], out.origin[2]};
  out.lo = Vec3{lo[0], lo[1], lo[2]} - origin, out.hi = Vec3{hi[0], hi[1], hi[2]} - origin;
}

void downsample_one(const RawCloud& raw, const PrepareSettings& options, DownsampledCloud& out) {
  std::vector<std::uint32_t> finite;
  find_origin(raw, options.voxel_size, out, finite);
  const Vec3 origin{out.origin[0], out.origin[1], out.origin[2]};

  for (std::size_t k = 0; k < raw.viewpoint_count; ++k)
    out.viewpoints.push_back(row(raw.viewpoints, 3, k) - origin);
  out.turns_normals =
      turns_normals(raw.normals != nullptr, raw.viewpoint_count, options.depth_maps);
  if (out.viewpoints.empty()) out.viewpoints.push_back(-origin);

  std::vector<Vec3> local(finite.size());
  float largest = 0;
  for (std::size_t k = 0; k < finite.size(); ++k) {
    local[k] = row(raw.points, raw.point_stride, finite[k]) - origin;
    const float d2 = squared_norm(local[k]);
    largest = d2 > largest ? d2 : largest;
  }
  pipeline::check_extent(sqrtf(largest), options);

  // Groups of points that share a voxel, in order of its key; without downsampling every point is a
  // group.
  std::vector<KeyIndex> order(finite.size());
  const float inverse = options.voxel_size > 0 ? 1.0f / options.voxel_size : 0.0f;
  for (std::size_t k = 0; k < finite.size(); ++k)
    order[k] = {options.voxel_size > 0 ? cell_key(voxel_of(local[k], inverse)) : k,
                static_cast<std::uint32_t>(k)};
  if (options.voxel_size > 0) radix_sort(order);

  const std::size_t dimension = raw.features ? raw.feature_dimension : 0;
  out.feature_dimension = static_cast<std::uint32_t>(dimension);
  std::vector<float> mean(dimension);
  for (std::size_t begin = 0, end; begin < order.size(); begin = end) {
    for (end = begin + 1; end < order.size() && order[end].key == order[begin].key;) ++end;
    const float inverse_count = 1.0f / static_cast<float>(end - begin);
    Vec3 sum{0, 0, 0}, guide{0, 0, 0};
    std::fill(mean.begin(), mean.end(), 0.0f);
    for (std::size_t k = begin; k < end; ++k) {
      const std::uint32_t i = order[k].index;
      sum = sum + local[i];
      if (raw.normals)
        guide = guide + normalized_or_zero(row(raw.normals, raw.normal_stride, finite[i]));
      for (std::size_t d = 0; d < dimension; ++d)
        mean[d] += raw.features[finite[i] * raw.feature_stride + d];
    }
    out.points.push_back(end - begin == 1 ? local[order[begin].index] : sum * inverse_count);
    if (raw.normals) out.guides.push_back(guide);
    for (std::size_t d = 0; d < dimension; ++d) out.features.push_back(mean[d] * inverse_count);
  }
  float radius2 = 0;
  for (const Vec3& p : out.points) radius2 = squared_norm(p) > radius2 ? squared_norm(p) : radius2;
  // Slightly longer, so that |point| / radius is at most 1 in float; 1 for a cloud without extent.
  out.radius = radius2 > 0 ? sqrtf(radius2) * kRadiusMargin : 1.0f;
}

}  // namespace

std::vector<DownsampledCloud> downsample(Exec& exec, Span<const RawCloud> clouds,
                                         const PrepareSettings& options) {
  std::vector<DownsampledCloud> out(clouds.size);
  exec.parallel(clouds.size, [&](std::size_t k) { downsample_one(clouds[k], options, out[k]); });
  return out;
}

}  // namespace gpureg::cpu
