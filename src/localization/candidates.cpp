// SPDX-License-Identifier: BSD-3-Clause
#include "localization/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "math/trigonometry.hpp"

namespace gpureg::localization {
namespace {

/// Beyond it, differences of confidences do not tell which of two places it is.
constexpr double kMostCertain = 0.999;

/// Cells of a box at least as wide as the distance: what is near a point is in its cell or in a
/// neighbour.
class Cells {
 public:
  Cells(const Eigen::AlignedBox3d& box, double distance) : corner_(box.min()) {
    const auto cells = [&] { return ((box.sizes() / edge_).array() + 4).prod(); };
    for (edge_ = distance; cells() > kMost;) edge_ *= 2;
    for (int axis = 0; axis < 3; ++axis)
      size_[axis] = static_cast<std::int64_t>(box.sizes()[axis] / edge_) + 3;
    own_.assign(static_cast<std::size_t>(size_.prod()), false);
    near_ = own_;
  }

  /// A point of the box.
  void add(const Eigen::Vector3d& p) {
    const Cell at = cell(p);
    if (own_[index(at)]) return;  // many points share a cell
    own_[index(at)] = true;
    for (std::int64_t k = 0; k < 27; ++k)
      near_[index(at + Cell(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1))] = true;
  }
  bool has(const Eigen::Vector3d& p) const {
    const Cell at = cell(p);
    return (at.array() >= 0).all() && (at.array() < size_.array()).all() && near_[index(at)];
  }

 private:
  using Cell = Eigen::Matrix<std::int64_t, 3, 1>;
  static constexpr double kMost = 1 << 24;

  Cell cell(const Eigen::Vector3d& p) const {
    return ((p - corner_) / edge_).array().floor().cast<std::int64_t>() + 1;
  }
  std::size_t index(const Cell& at) const {
    return static_cast<std::size_t>((at[2] * size_[1] + at[1]) * size_[0] + at[0]);
  }

  Eigen::Vector3d corner_;
  double edge_ = 0;
  Cell size_;
  std::vector<bool> own_, near_;
};

}  // namespace

bool same_place(const UnalignedIsometry3d& a, const UnalignedIsometry3d& b,
                const Eigen::Vector3d& middle, const EvidenceSettings& options) {
  const double trace = (a.linear().transpose() * b.linear()).trace();
  const double least =
      1 + 2 * portable::cos(static_cast<double>(options.mode_angle) * portable::kRadiansPerDegree);
  return trace >= least &&
         (a * middle - b * middle).norm() <= static_cast<double>(options.mode_distance);
}

std::vector<Candidate> distinct(std::vector<Candidate> candidates, const Eigen::Vector3d& middle,
                                const EvidenceSettings& options, std::size_t most) {
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
  std::vector<Eigen::Vector3d> moved;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : scan) {
    moved.push_back(map_from_scan * point - map.origin);
    box.extend(moved.back());
  }
  if (moved.empty()) return {};
  Cells cells(box, distance);
  for (const Eigen::Vector3d& point : moved) cells.add(point);
  box.min().array() -= distance;
  box.max().array() += distance;
  return map.cut(box, [&](const Eigen::Vector3f& p) { return cells.has(p.cast<double>()); });
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
