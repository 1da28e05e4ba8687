// SPDX-License-Identifier: BSD-3-Clause
#include "io/meshes/one_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace gpureg::io {
namespace {

/// Smallest share of the area that shows the origin its front.
constexpr double kFront = 0.97;
/// Cells of a direction: so many across each face of a cube, some 1.4 degrees.
constexpr double kCells = 64;
/// A point farther than this multiple of the nearest one of its cell is behind it. A floor that is
/// seen at ten degrees stays below.
constexpr double kBehind = 1.25;
/// Largest share of the area behind other surfaces: edges of objects run through some cells. Of an
/// open model it is a third and more.
constexpr double kHidden = 0.15;

std::uint32_t cell_of(const Eigen::Vector3d& direction) {
  int axis = 0;
  const double largest = direction.cwiseAbs().maxCoeff(&axis);
  const auto at = [&](int other) {
    const double place = 0.5 * (direction[(axis + other) % 3] / largest + 1);
    return static_cast<std::uint32_t>(std::min(kCells * place, kCells - 1));
  };
  const std::uint32_t face = static_cast<std::uint32_t>(2 * axis + (direction[axis] < 0 ? 1 : 0));
  return (face << 16) | (at(1) << 8) | at(2);
}

}  // namespace

bool is_one_view(const SurfaceMesh& mesh, const std::vector<Eigen::Vector3d>& points,
                 const std::vector<Eigen::Vector3f>& normals) {
  if (mesh.open_edges == 0) return false;
  std::size_t front = 0;
  std::unordered_map<std::uint32_t, double> nearest;
  for (std::size_t k = 0; k < points.size(); ++k) {
    front += normals[k].cast<double>().dot(points[k]) < 0;
    double& range = nearest.try_emplace(cell_of(points[k]), points[k].norm()).first->second;
    range = std::min(range, points[k].norm());
  }
  const auto count = static_cast<double>(points.size());
  if (static_cast<double>(front) < kFront * count) return false;
  const auto behind = std::count_if(points.begin(), points.end(), [&](const Eigen::Vector3d& p) {
    return p.norm() > kBehind * nearest.at(cell_of(p));
  });
  return static_cast<double>(behind) <= kHidden * count;
}

}  // namespace gpureg::io
