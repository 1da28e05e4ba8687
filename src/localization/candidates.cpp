// SPDX-License-Identifier: BSD-3-Clause
#include "localization/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <unordered_set>

#include "math/trigonometry.hpp"

namespace gpureg::localization {
namespace {

/// Beyond it, differences of confidences do not tell which of two places it is.
constexpr double kMostCertain = 0.999;

/// Cells as wide as the distance: what is near a point is in its cell or in a neighbour.
class Cells {
 public:
  explicit Cells(double edge) : edge_(edge) {}

  void add(const Eigen::Vector3d& p) {
    const auto [x, y, z] = cell(p);
    if (!own_.insert(key(x, y, z)).second) return;  // many points share a cell
    for (std::int64_t dx = -1; dx <= 1; ++dx)
      for (std::int64_t dy = -1; dy <= 1; ++dy)
        for (std::int64_t dz = -1; dz <= 1; ++dz) keys_.insert(key(x + dx, y + dy, z + dz));
  }
  bool has(const Eigen::Vector3d& p) const {
    const auto [x, y, z] = cell(p);
    return keys_.count(key(x, y, z)) > 0;
  }

 private:
  std::array<std::int64_t, 3> cell(const Eigen::Vector3d& p) const {
    const auto at = [&](int axis) {
      return static_cast<std::int64_t>(std::floor(p[axis] / edge_));
    };
    return {at(0), at(1), at(2)};
  }
  /// Cells of one key are 2^21 cells apart: farther than a cut is wide.
  static std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z) {
    constexpr std::uint64_t kMask = (std::uint64_t{1} << 21) - 1;
    return (static_cast<std::uint64_t>(x) & kMask) << 42 |
           (static_cast<std::uint64_t>(y) & kMask) << 21 | (static_cast<std::uint64_t>(z) & kMask);
  }

  double edge_;
  std::unordered_set<std::uint64_t> own_, keys_;
};

}  // namespace

bool same_place(const UnalignedIsometry3d& a, const UnalignedIsometry3d& b,
                const Eigen::Vector3d& middle, const EvidenceOptions& options) {
  const double trace = (a.linear().transpose() * b.linear()).trace();
  const double least =
      1 + 2 * portable::cos(static_cast<double>(options.mode_angle) * portable::kRadiansPerDegree);
  return trace >= least &&
         (a * middle - b * middle).norm() <= static_cast<double>(options.mode_distance);
}

std::vector<Candidate> distinct(std::vector<Candidate> candidates, const Eigen::Vector3d& middle,
                                const EvidenceOptions& options, std::size_t most) {
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::tuple(-a.confidence, a.tile, a.mode) < std::tuple(-b.confidence, b.tile, b.mode);
  });
  std::vector<Candidate> out;
  for (const Candidate& candidate : candidates) {
    if (out.size() == most) break;
    if (std::none_of(out.begin(), out.end(), [&](const Candidate& kept) {
          return same_place(kept.map_from_scan, candidate.map_from_scan, middle, options);
        }))
      out.push_back(candidate);
  }
  return out;
}

PointCloud neighborhood(const MapState& map, const std::vector<Eigen::Vector3d>& scan,
                        const UnalignedIsometry3d& map_from_scan, double distance) {
  Cells cells(distance);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : scan) {
    const Eigen::Vector3d p = map_from_scan * point - map.origin;
    cells.add(p);
    box.extend(p);
  }
  box.min().array() -= distance;
  box.max().array() += distance;
  PointCloud out =
      map.cut(box, [&](const Eigen::Vector3f& p) { return cells.has(p.cast<double>()); });
  if (map.sides_inferred) out.normals.clear();
  return out;
}

double odds_of(double confidence) {
  const double c = std::clamp(confidence, 0.0, kMostCertain);
  return c / (1 - c);
}

std::vector<double> shared_probability(const std::vector<double>& alone) {
  std::vector<double> out;
  double sum = 1;
  for (const double confidence : alone) {
    out.push_back(odds_of(confidence));
    sum += out.back();
  }
  for (double& odds : out) odds /= sum;
  out.push_back(1 / sum);
  return out;
}

}  // namespace gpureg::localization
