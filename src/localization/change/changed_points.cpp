// SPDX-License-Identifier: BSD-3-Clause
#include "localization/change/changed_points.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "common/host_threads.hpp"
#include "common/whole.hpp"
#include "localization/change/sight.hpp"
#include "math/exponential.hpp"

namespace gpureg::localization {
namespace {

using Cell = std::array<std::int64_t, 3>;

Cell cell_of(const Eigen::Vector3f& p, float edge) {
  return {cell_at(p[0], edge), cell_at(p[1], edge), cell_at(p[2], edge)};
}

/// Log odds at twice the tolerance.
constexpr double kSharpness = 4;

/// Probability that a distance exceeds the tolerance, .5 where they are equal.
float beyond(float distance, float tolerance) {
  const double excess = static_cast<double>(distance / tolerance) - 1;
  return static_cast<float>(portable::logistic(kSharpness * excess));
}

std::vector<float> distances(const Question& question, const Surface& other, unsigned threads) {
  const float largest = question.tolerances.empty() ? 1.0f
                                                    : *std::max_element(question.tolerances.begin(),
                                                                        question.tolerances.end());
  const SurfaceDistance surface(other, std::max(2 * largest, 2 * other.spacing));
  std::vector<float> out(question.points.size());
  const std::size_t workers = std::max(1u, threads);
  on_threads(workers, [&](std::size_t worker) {
    for (std::size_t k = worker; k < out.size(); k += workers)
      out[k] = surface.at(question.points[k]);
  });
  return out;
}

/// Where the surfaces of a block lie farther apart than the tolerance foresees, by errors of the
/// pose, of the map or of the sensor, the tolerance of the block grows, at most by half of it.
void widen(const Question& question, const std::vector<float>& distance,
           std::vector<float>& tolerances) {
  constexpr float kBlock = 20, kMedians = 1.5f, kMost = 1.5f;
  std::map<Cell, std::vector<std::size_t>> blocks;
  for (std::size_t k = 0; k < distance.size(); ++k) {
    if (distance[k] >= 2 * tolerances[k]) continue;
    blocks[cell_of(question.points[k], kBlock * question.spacing)].push_back(k);
  }
  for (const auto& [at, members] : blocks) {
    std::vector<float> near;
    for (const std::size_t k : members) near.push_back(distance[k]);
    const auto middle = near.begin() + static_cast<std::ptrdiff_t>(near.size() / 2);
    std::nth_element(near.begin(), middle, near.end());
    for (const std::size_t k : members)
      tolerances[k] = std::clamp(kMedians * *middle, tolerances[k], kMost * tolerances[k]);
  }
}

/// Groups of changed points that hang together, cells of a size wide.
class Groups {
 public:
  Groups(const std::vector<Eigen::Vector3f>& points, const std::vector<std::size_t>& members,
         float cell) {
    std::map<Cell, std::size_t> cells;
    for (const std::size_t k : members)
      cell_of_.push_back(cells.try_emplace(cell_of(points[k], cell), cells.size()).first->second);
    parent_.resize(cells.size());
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    for (const auto& [at, number] : cells)
      for (std::int64_t z = -1; z <= 1; ++z)
        for (std::int64_t y = -1; y <= 1; ++y)
          for (std::int64_t x = -1; x <= 1; ++x) {
            const auto beside = cells.find({at[0] + x, at[1] + y, at[2] + z});
            if (beside != cells.end()) parent_[root(number)] = root(beside->second);
          }
  }
  /// Group of member m.
  std::size_t of(std::size_t m) { return root(cell_of_[m]); }

 private:
  std::size_t root(std::size_t k) {
    while (parent_[k] != k) k = parent_[k] = parent_[parent_[k]];
    return k;
  }
  std::vector<std::size_t> cell_of_, parent_;
};

/// Takes back changes of less extent.
void drop_small(const Question& question, const std::vector<ChangeLabel>& otherwise,
                double min_extent, PointChanges& out) {
  std::vector<std::size_t> members;
  for (std::size_t k = 0; k < out.labels.size(); ++k)
    if (out.labels[k] == question.changed) members.push_back(k);
  Groups groups(question.points, members, question.spacing);
  std::map<std::size_t, Eigen::AlignedBox3f> boxes;
  for (std::size_t m = 0; m < members.size(); ++m)
    boxes[groups.of(m)].extend(question.points[members[m]]);
  for (std::size_t m = 0; m < members.size(); ++m) {
    const std::size_t k = members[m];
    if (static_cast<double>(boxes[groups.of(m)].diagonal().norm()) >= min_extent) continue;
    out.labels[k] = otherwise[k];
    out.probabilities[k] = 1 - out.probabilities[k];
  }
}

}  // namespace

PointChanges changed_points(const Question& question, const Surface& other, double min_extent,
                            unsigned threads) {
  const std::size_t size = question.points.size();
  const std::vector<float> distance = distances(question, other, threads);
  std::vector<float> tolerances = question.tolerances;
  widen(question, distance, tolerances);
  std::vector<float> open = tolerances;
  for (std::size_t k = 0; k < size; ++k)
    if (distance[k] <= open[k]) open[k] = 0;
  const std::vector<Sight> seen = sights(other, question.points, open, threads);
  // Several positions of one scan, of which nobody says which of them saw which point: what one of
  // them seems to have seen through, most of them have to know of.
  constexpr double kShare = 0.75;
  const std::size_t enough =
      other.horizons.empty() ? static_cast<std::size_t>(
                                   std::ceil(kShare * static_cast<double>(other.viewpoints.size())))
                             : 0;
  PointChanges out;
  std::vector<ChangeLabel> otherwise(size, ChangeLabel::same);
  for (std::size_t k = 0; k < size; ++k) {
    const float tolerance = tolerances[k], off = beyond(distance[k], tolerance);
    const Sight& sight = seen[k];
    if (open[k] == 0) {
      out.labels.push_back(ChangeLabel::same);
      out.probabilities.push_back(1 - off);
      continue;
    }
    otherwise[k] = sight.surface > 0   ? ChangeLabel::same
                   : sight.blocked > 0 ? ChangeLabel::occluded
                                       : ChangeLabel::not_observed;
    const bool seen_through = 2 * sight.free > sight.surface && sight.known() >= enough;
    const float through = seen_through ? beyond(sight.gap, tolerance) : 0.0f;
    const bool changed = through > 0;
    out.labels.push_back(changed ? question.changed : otherwise[k]);
    out.probabilities.push_back(changed                             ? off * through
                                : otherwise[k] == ChangeLabel::same ? 0.5f
                                                                    : off);
  }
  drop_small(question, otherwise, min_extent, out);
  return out;
}

}  // namespace gpureg::localization
