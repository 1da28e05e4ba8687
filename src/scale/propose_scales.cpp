// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "api/access.hpp"
#include "common/for_each_on.hpp"
#include "common/in_halves.hpp"
#include "scale/consensus.hpp"
#include "scale/scale_search.hpp"

namespace gpureg::scale {
namespace {

/// Scales that are tried with all the evidence, at most.
constexpr std::size_t kScales = 4;
/// Support of the last of them, as a share of that of the first.
constexpr double kLeastSupport = 0.4;
/// Proposals whose scales differ by less are one: refinement leads them to the same scale.
constexpr double kSame = 0.1;
/// By how much a proposal may lie outside the range that was asked for: its error.
constexpr double kOutside = 0.04;

struct Support {
  double scale;
  std::uint32_t places;
};

Matches oriented(const FeatureMatches& matches, const PointsAndNormals& source,
                 const PointsAndNormals& target) {
  Matches out;
  for (const std::uint32_t k : matches.source) {
    out.p.push_back(source.points[k]);
    out.m.push_back(source.normals[k]);
  }
  for (const std::uint32_t k : matches.target) {
    out.q.push_back(target.points[k]);
    out.n.push_back(target.normals[k]);
  }
  return out;
}

std::vector<double> distinct(std::vector<Support> all) {
  std::sort(all.begin(), all.end(), [](const Support& a, const Support& b) {
    return a.places != b.places ? a.places > b.places : a.scale < b.scale;
  });
  std::vector<double> out;
  std::vector<bool> taken(all.size(), false);
  for (std::size_t k = 0; k < all.size() && out.size() < kScales; ++k) {
    if (taken[k]) continue;
    if (static_cast<double>(all[k].places) < kLeastSupport * static_cast<double>(all[0].places))
      break;
    double sum = 0, weight = 0;
    for (std::size_t j = k; j < all.size(); ++j) {
      if (taken[j] || std::abs(all[j].scale / all[k].scale - 1) > kSame) continue;
      taken[j] = true;
      // Support that is half as large says little of the scale.
      const double places = static_cast<double>(all[j].places), w = places * places * places;
      sum += w * all[j].scale;
      weight += w;
    }
    out.push_back(sum / weight);
  }
  return out;
}

}  // namespace

std::vector<double> propose_scales(const Context& context, const PreparedLadder& source,
                                   const PreparedTarget& target, const ScaleRange& range,
                                   const RegistrationSettings& options) {
  struct Task {
    std::size_t rung;
    FeatureMatches matches;
    std::vector<Proposal> proposals;
  };
  Engine& engine = *Access::engine(context);
  const PreparedState& fixed = *Access::state(target.coarse);
  std::vector<Task> tasks;
  std::vector<PairInput> inputs;
  for (std::size_t r = 0; r < source.rungs().size(); ++r) {
    const PreparedState& moved = *Access::state(source.rungs()[r].cloud);
    if (moved.size == 0 || fixed.size == 0) continue;
    inputs.push_back({&moved, &fixed});
    tasks.push_back({r, {}, {}});
    // With both clouds turned over, matches would be the same.
    if (moved.other_sides)
      inputs.push_back({moved.other_sides.get(), &fixed});
    else if (fixed.other_sides)
      inputs.push_back({&moved, fixed.other_sides.get()});
    else
      continue;
    tasks.push_back({r, {}, {}});
  }
  in_halves(0, inputs.size(), [&](std::size_t begin, std::size_t end) {
    std::vector<FeatureMatches> found = engine.match({inputs.data() + begin, end - begin}, options);
    for (std::size_t k = begin; k < end; ++k) tasks[k].matches = std::move(found[k - begin]);
  });
  const float voxel = target.search.voxel_size;
  for_each_on(engine.host_threads(), tasks.size(), [&](std::size_t k) {
    Task& task = tasks[k];
    task.proposals =
        propose_factors(oriented(task.matches, source.rungs()[task.rung].points, target.points),
                        voxel, options.seed);
  });
  std::vector<Support> all;
  for (const Task& task : tasks)
    for (const Proposal& p : task.proposals) {
      const double scale = source.rungs()[task.rung].scale * p.factor;
      if (range.is_free() ||
          (scale > range.least * (1 - kOutside) && scale < range.most * (1 + kOutside)))
        all.push_back(
            {range.is_free() ? scale : std::clamp(scale, range.least, range.most), p.places});
    }
  return distinct(std::move(all));
}

}  // namespace gpureg::scale
