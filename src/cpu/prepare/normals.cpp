// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "algorithm/normal.hpp"
#include "cpu/common/stages.hpp"

namespace gpureg::cpu {
namespace {

void turn_to_viewpoints(const std::vector<std::uint8_t>& away, std::vector<Vec3>& normals) {
  const auto count = static_cast<std::uint32_t>(std::count(away.begin(), away.end(), 1));
  if (!turns_back(count, static_cast<std::uint32_t>(normals.size()))) return;
  for (std::size_t i = 0; i < away.size(); ++i)
    if (away[i]) normals[i] = -normals[i];
}

}  // namespace

std::vector<std::vector<Vec3>> estimate_normals(Exec& exec,
                                                const std::vector<DownsampledCloud>& clouds,
                                                const std::vector<Grid>& grids, float radius) {
  std::vector<std::vector<Vec3>> normals(clouds.size());
  std::vector<std::vector<std::uint8_t>> away(clouds.size());
  for (std::size_t c = 0; c < clouds.size(); ++c) {
    normals[c].resize(clouds[c].points.size());
    if (clouds[c].turns_normals) away[c].resize(clouds[c].points.size());
  }
  exec.parallel_items(
      clouds.size(), [&](std::size_t c) { return clouds[c].points.size(); }, 256,
      [&](std::size_t c, std::size_t begin, std::size_t end) {
        const DownsampledCloud& cloud = clouds[c];
        const GridView grid = grids[c].view();
        for (std::size_t i = begin; i < end; ++i) {
          const Vec3 p = cloud.points[i];
          const Vec3 guide = cloud.guides.empty() ? Vec3{0, 0, 0} : cloud.guides[i];
          normals[c][i] =
              orient_normal(plane_normal(grid, p, radius), p, guide, span_of(cloud.viewpoints));
          if (cloud.turns_normals)
            away[c][i] = faces_away(normals[c][i], p, span_of(cloud.viewpoints));
        }
      });
  exec.parallel(clouds.size(), [&](std::size_t c) { turn_to_viewpoints(away[c], normals[c]); });
  return normals;
}

}  // namespace gpureg::cpu
