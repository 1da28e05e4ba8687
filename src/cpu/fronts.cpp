// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/fronts.hpp"
#include "cpu/stages.hpp"

namespace gpureg::cpu {

std::vector<Fronts> build_fronts(Exec& exec, const std::vector<DownsampledCloud>& clouds,
                                 const std::vector<std::vector<Vec3>>& normals,
                                 const PrepareOptions& options) {
  std::vector<Fronts> out(clouds.size());
  exec.parallel(clouds.size(), [&](std::size_t c) {
    const std::vector<Vec3>& points = clouds[c].points;
    const FrontBox box = out[c].box =
        front_box(clouds[c].lo, clouds[c].hi, options.front_reach, !points.empty());
    std::vector<std::uint32_t>& words = out[c].words;
    words.assign(box.words(), 0);
    if (words.empty()) return;
    for (const Vec3& p : points) {
      const FrontCell cell = front_cell(box, p);
      if (cell.word != kNoValue) words[cell.word] |= kOnSurface << cell.shift;
    }
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::uint32_t side = 0; side < 2; ++side)
        march_front(box, words.data(), points[i], normals[c][i], side,
                    [&](std::uint32_t word, std::uint32_t bits) { words[word] |= bits; });
  });
  return out;
}

}  // namespace gpureg::cpu
