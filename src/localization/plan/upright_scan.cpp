// SPDX-License-Identifier: BSD-3-Clause
#include "localization/plan/upright_scan.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "math/atan2.hpp"

namespace gpureg::localization {
namespace {

/// Directions of a scan that are tried as the vertical.
constexpr std::size_t kAxes = 3;
/// Walls of a scan, and points for the height.
constexpr std::size_t kWalls = 512, kPoints = 512;

/// Cells. No column of a plan reaches a point that is farther above or below the middle of its
/// scan.
constexpr float kFarthest = 2 << FloorPlan::kHeightBits;

template <typename T>
std::vector<T> some_of(const std::vector<T>& all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<T> out;
  for (std::size_t k = 0; k < most; ++k) out.push_back(all[k * all.size() / most]);
  return out;
}

/// A cell and what faces it, as one number; a scan reaches less than 2^14 cells, but for heights.
std::uint64_t key_of(int x, int y, int z, std::uint32_t faces) {
  const auto part = [](int value, int bits) {
    return static_cast<std::uint64_t>(value) & ((std::uint64_t{1} << bits) - 1);
  };
  return part(x, 16) << 48 | part(y, 16) << 32 | part(z, 14) << 18 | faces;
}

/// One wall per cell and direction.
std::vector<plan::Wall> walls_in_cells(const std::vector<plan::Wall>& walls, float cell,
                                       std::size_t most) {
  std::unordered_set<std::uint64_t> seen;
  std::vector<plan::Wall> out;
  for (const plan::Wall& wall : walls) {
    const plan::Wall scaled{wall.x / cell, wall.y / cell, wall.direction};
    if (seen.insert(key_of(static_cast<int>(std::floor(scaled.x)),
                           static_cast<int>(std::floor(scaled.y)),
                           static_cast<int>(std::lround(wall.direction)), 0))
            .second)
      out.push_back(scaled);
  }
  return some_of(out, most);
}

/// Floors of the map may be what faces the axis or what faces the opposite.
bool faces_both(const Axis& axis) { return 4 * axis.opposite >= axis.facing; }

std::vector<Axis> possible_axes(const std::vector<Eigen::Vector3f>& normals) {
  std::vector<Axis> axes = frequent_axes(normals, kAxes);
  if (axes.size() < 2) return axes;
  Axis third;
  third.direction = axes[0].direction.cross(axes[1].direction).normalized();
  const auto is_known = [&](const Axis& axis) {
    return std::abs(axis.direction.dot(third.direction)) > kSameAxis;
  };
  if (std::none_of(axes.begin(), axes.end(), is_known)) axes.push_back(third);
  return axes;
}

}  // namespace

std::vector<Eigen::Vector3f> possible_verticals(const ScanSurface& scan, const FloorPlan& plan,
                                                bool has_sides) {
  std::vector<Eigen::Vector3f> out;
  for (const Axis& axis : possible_axes(scan.normals)) {
    out.push_back(axis.direction);
    if (plan.has_ceiling || !has_sides || faces_both(axis)) out.push_back(-axis.direction);
  }
  return out;
}

Upright stand(const ScanSurface& scan, const Eigen::Vector3f& up, float cell) {
  Upright out;
  out.turn = upright(up);
  const float reach = FloorPlan::kReach / FloorPlan::kCell * cell;
  constexpr float kPerRadian = plan::kDirections / (2 * kPi);
  std::vector<plan::Wall> walls;
  std::vector<Upright::Point> points;
  std::unordered_set<std::uint64_t> seen;
  float farthest = 0;
  for (std::size_t k = 0; k < scan.points.size(); ++k) {
    const Eigen::Vector3f normal = out.turn * scan.normals[k];
    const std::uint32_t faces = facing::of(normal, true);
    const Eigen::Vector3f at = out.turn * scan.points[k];
    const float distance = at.head<2>().norm();
    if (faces == 0 || distance > reach) continue;
    const Eigen::Vector3f in = at / cell;
    if (!(std::abs(in[2]) < kFarthest)) continue;
    const Eigen::Vector3i whole = in.array().floor().cast<int>();
    const bool is_wall = (faces & facing::kWalls) != 0;
    const float direction = is_wall ? exact_atan2(normal[1], normal[0]) * kPerRadian : 0;
    if (seen.insert(key_of(whole[0], whole[1], whole[2], faces)).second)
      points.push_back({{in[0], in[1], direction}, whole[2], is_wall ? 0 : faces});
    if (!is_wall) continue;
    farthest = std::max(farthest, distance);
    walls.push_back({at[0], at[1], direction});
  }
  out.walls = walls_in_cells(walls, cell, kWalls);
  out.coarse_walls = walls_in_cells(walls, 2 * cell, plan::kCoarseWalls);
  out.points = some_of(points, kPoints);
  // A step moves the farthest wall by 1.4 coarse cells.
  out.headings = std::max(16, static_cast<int>(std::ceil(2 * kPi * 0.7f * farthest / (2 * cell))));
  return out;
}

}  // namespace gpureg::localization
