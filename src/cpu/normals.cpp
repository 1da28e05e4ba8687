// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/normal.hpp"
#include "cpu/stages.hpp"

namespace gpureg::cpu {

std::vector<std::vector<Vec3>> estimate_normals(Exec& exec, const std::vector<DownsampledCloud>& clouds, const std::vector<Grid>& grids,
                                                const PrepareOptions& options) {
  std::vector<std::vector<Vec3>> normals(clouds.size());
  for (std::size_t c = 0; c < clouds.size(); ++c) normals[c].resize(clouds[c].points.size());
  exec.parallel_items(clouds.size(), [&](std::size_t c) { return clouds[c].points.size(); }, 256,
                      [&](std::size_t c, std::size_t begin, std::size_t end) {
                        const DownsampledCloud& cloud = clouds[c];
                        const GridView grid = grids[c].view();
                        for (std::size_t i = begin; i < end; ++i) {
                          const Vec3 p = cloud.points[i];
                          const Vec3 guide = cloud.guides.empty() ? Vec3{0, 0, 0} : cloud.guides[i];
                          normals[c][i] = orient_normal(plane_normal(grid, p, options.normal_radius), p, guide, span_of(cloud.viewpoints));
                        }
                      });
  return normals;
}

}  // namespace gpureg::cpu
