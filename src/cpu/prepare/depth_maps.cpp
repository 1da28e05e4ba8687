// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/visibility.hpp"
#include "cpu/common/stages.hpp"

namespace gpureg::cpu {
namespace {

void erode(std::uint16_t* map) {
  std::vector<std::uint16_t> copy(map, map + kMapCells);
  for (std::uint32_t cell = 0; cell < kMapCells; ++cell)
    map[cell] = eroded_depth(copy.data(), cell);
}

}  // namespace

std::vector<Visibility> build_depth_maps(Exec& exec, Span<const RawCloud> raw,
                                         const std::vector<DownsampledCloud>& clouds,
                                         const PrepareSettings& options) {
  std::vector<Visibility> out(clouds.size());
  for (std::size_t c = 0; c < clouds.size(); ++c) {
    const std::size_t known = clouds[c].points.empty() ? 0 : clouds[c].viewpoints.size();
    const std::size_t count =
        map_count(known, options.depth_maps, raw[c].viewpoint_count > 0, raw[c].normals != nullptr);
    for (std::size_t k = 0; k < count; ++k)
      out[c].viewpoints.push_back(clouds[c].viewpoints[chosen_viewpoint(k, count, known)]);
    out[c].step = depth_step(options.voxel_size > 0 ? options.voxel_size
                                                    : options.max_correspondence_distance);
    out[c].depth.assign(count * kMapCells, kUnknownDepth);
  }
  exec.parallel_items(
      clouds.size(), [&](std::size_t c) { return out[c].viewpoints.size(); }, 1,
      [&](std::size_t c, std::size_t k, std::size_t) {
        const Vec3 origin{clouds[c].origin[0], clouds[c].origin[1], clouds[c].origin[2]};
        std::uint16_t* map = out[c].depth.data() + k * kMapCells;
        const Vec3 viewpoint = out[c].viewpoints[k];
        const float inverse_step = 1.0f / out[c].step;
        for (std::size_t i = 0; i < raw[c].size; ++i) {
          const float* p = raw[c].points + i * raw[c].point_stride;
          const Vec3 d = Vec3{p[0], p[1], p[2]} - origin - viewpoint;
          if (!all_finite(d) || is_zero(d)) continue;
          const MapRay ray = map_ray(d);
          const std::uint16_t depth = map_depth(ray.depth, inverse_step);
          if (depth < map[ray.cell]) map[ray.cell] = depth;
        }
        erode(map);
      });
  return out;
}

}  // namespace gpureg::cpu
