// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/normal.hpp"
#include "cpu/stages.hpp"

namespace gpureg::cpu {
namespace {

void turn_to_viewpoints(const DownsampledCloud& cloud, std::vector<Vec3>& normals) {
  if (!cloud.turns_normals) return;
  std::vector<std::uint32_t> away;
  for (std::uint32_t i = 0; i < normals.size(); ++i)
    if (faces_away(normals[i], cloud.points[i], span_of(cloud.viewpoints))) away.push_back(i);
  if (!turns_back(static_cast<std::uint32_t>(away.size()), static_cast<std::uint32_t>(normals.size()))) return;
  for (const std::uint32_t i : away) normals[i] = -normals[i];
}

}  // namespace

std::vector<std::vector<Vec3>> estimate_normals(Exec& exec, const std::vector<DownsampledCloud>& clouds, const std::vector<Grid>& grids, float radius) {
  std::vector<std::vector<Vec3>> normals(clouds.size());
  for (std::size_t c = 0; c < clouds.size(); ++c) normals[c].resize(clouds[c].points.size());
  exec.parallel_items(clouds.size(), [&](std::size_t c) { return clouds[c].points.size(); }, 256,
                      [&](std::size_t c, std::size_t begin, std::size_t end) {
                        const DownsampledCloud& cloud = clouds[c];
                        const GridView grid = grids[c].view();
                        for (std::size_t i = begin; i < end; ++i) {
                          const Vec3 p = cloud.points[i];
                          const Vec3 guide = cloud.guides.empty() ? Vec3{0, 0, 0} : cloud.guides[i];
                          normals[c][i] = orient_normal(plane_normal(grid, p, radius), p, guide, span_of(cloud.viewpoints));
                        }
                      });
  exec.parallel(clouds.size(), [&](std::size_t c) { turn_to_viewpoints(clouds[c], normals[c]); });
  return normals;
}

}  // namespace gpureg::cpu
