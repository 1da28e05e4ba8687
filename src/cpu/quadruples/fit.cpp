// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/fit.hpp"

#include "cpu/common/stages.hpp"

namespace gpureg::cpu {

std::vector<Hypotheses> fit_hypotheses(Exec& exec, const std::vector<Matches>& matches,
                                       const std::vector<std::vector<std::uint32_t>>& quadruples,
                                       const RegistrationSettings& options) {
  std::vector<std::vector<Pose<float>>> poses(matches.size());
  std::vector<std::vector<std::uint8_t>> valid(matches.size());
  for (std::size_t p = 0; p < matches.size(); ++p) {
    poses[p].resize(quadruples[p].size());
    valid[p].resize(quadruples[p].size());
  }
  constexpr std::size_t kGrain = 512;  // hypotheses per task: milliseconds of work
  exec.parallel_items(
      matches.size(), [&](std::size_t p) { return quadruples[p].size(); }, kGrain,
      [&](std::size_t p, std::size_t begin, std::size_t end) {
        const std::vector<MatchedPoints>& m = matches[p].pairs;
        for (std::size_t k = begin; k < end; ++k) {
          const Quadruple q =
              draw_quadruple(quadruples[p][k], options.seed, static_cast<std::uint32_t>(m.size()));
          Vec3 source[4], target[4];
          for (int c = 0; c < 4; ++c) {
            source[c] = m[q.match[c]].source;
            target[c] = m[q.match[c]].target;
          }
          valid[p][k] = fit_rigid(source, target, poses[p][k]);
        }
      });
  std::vector<Hypotheses> out(matches.size());
  for (std::size_t p = 0; p < matches.size(); ++p)
    for (std::size_t k = 0; k < quadruples[p].size(); ++k)
      if (valid[p][k]) {
        out[p].id.push_back(quadruples[p][k]);
        out[p].pose.push_back(poses[p][k]);
      }
  return out;
}

}  // namespace gpureg::cpu
