// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/surface_sides.hpp"
#include "cpu/common/stages.hpp"

namespace gpureg::cpu {

std::vector<SurfaceSides> build_surface_sides(Exec& exec,
                                              const std::vector<DownsampledCloud>& clouds,
                                              const std::vector<std::vector<Vec3>>& normals,
                                              const PrepareSettings& options) {
  std::vector<SurfaceSides> out(clouds.size());
  exec.parallel(clouds.size(), [&](std::size_t c) {
    const std::vector<Vec3>& points = clouds[c].points;
    const SurfaceSideGrid box = out[c].box = surface_side_grid(
        clouds[c].lo, clouds[c].hi, options.surface_side_distance, !points.empty());
    std::vector<std::uint32_t>& words = out[c].words;
    words.assign(box.words(), 0);
    if (words.empty()) return;
    for (const Vec3& p : points) {
      const SurfaceSideCell cell = surface_side_cell(box, p);
      if (cell.word != kNoValue) words[cell.word] |= kOnSurface << cell.shift;
    }
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::uint32_t side = 0; side < 2; ++side)
        march_surface_side(box, words.data(), points[i], normals[c][i], side,
                           [&](std::uint32_t word, std::uint32_t bits) { words[word] |= bits; });
  });
  return out;
}

}  // namespace gpureg::cpu
