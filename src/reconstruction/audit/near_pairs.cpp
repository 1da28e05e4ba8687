// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "reconstruction/audit/near_pairs.hpp"

#include "common/stop_scope.hpp"

namespace gpureg::reconstruction {
namespace {

struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d high = -low;
  bool empty() const { return !(low.x() <= high.x()); }
  Eigen::Vector3d middle() const { return (low + high) / 2; }
  void add(const Eigen::Vector3d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  bool meets(const Box& other) const {
    return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
  }
};

/// Of a scan and what it saw through, in the world.
Box box_of(const PreparedCloud& cloud, const UnalignedIsometry3d& world_from_scan) {
  Box box;
  if (!cloud.valid() || !world_from_scan.matrix().allFinite()) return box;
  const Eigen::Vector3d origin = cloud.origin();
  for (const auto& rows : {cloud.points(), cloud.viewpoints()})
    for (const Eigen::Vector3f& row : rows)
      if (row.allFinite()) box.add(world_from_scan * (origin + row.cast<double>()));
  return box;
}

using Cell = std::array<std::int64_t, 3>;

/// Half of the boxes are larger than a cell in no direction; a large box takes up many.
double cell_size(const std::vector<Box>& boxes) {
  std::vector<double> sizes;
  for (const Box& box : boxes)
    if (!box.empty()) sizes.push_back((box.high - box.low).maxCoeff());
  if (sizes.empty()) return 1;
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2),
                   sizes.end());
  return std::max(sizes[sizes.size() / 2], 1e-3);
}

/// A scan that is larger than so many cells in one direction is as if it were in the middle ones.
constexpr std::int64_t kMostCells = 16;

template <typename Function>
void for_each_cell(const Box& box, double size, const Function& function) {
  Cell low, high;
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    low[at] = static_cast<std::int64_t>(std::floor(std::clamp(box.low[axis] / size, -1e15, 1e15)));
    high[at] =
        static_cast<std::int64_t>(std::floor(std::clamp(box.high[axis] / size, -1e15, 1e15)));
    const std::int64_t more = high[at] - low[at] + 1 - kMostCells;
    if (more > 0) {
      low[at] += more / 2;
      high[at] = low[at] + kMostCells - 1;
    }
  }
  for (std::int64_t x = low[0]; x <= high[0]; ++x)
    for (std::int64_t y = low[1]; y <= high[1]; ++y)
      for (std::int64_t z = low[2]; z <= high[2]; ++z) function(Cell{x, y, z});
}

/// Scans of one cell that a scan is compared with: next to it in number, and others evenly chosen.
/// Right poses keep to it; poses in other units put all scans into one cell.
constexpr std::size_t kMostOfCell = 2048;

template <typename Function>
void for_each_other(const std::vector<std::uint32_t>& scans, std::uint32_t scan,
                    const Function& function) {
  std::size_t begin = 0, end = scans.size();
  if (scans.size() > kMostOfCell) {
    const auto place = static_cast<std::size_t>(std::lower_bound(scans.begin(), scans.end(), scan) -
                                                scans.begin());
    begin = place - std::min(place, kMostOfCell / 4);
    end = std::min(place + kMostOfCell / 4, scans.size());
    for (std::size_t k = 0; k < kMostOfCell / 2; ++k)
      function(scans[k * scans.size() / (kMostOfCell / 2)]);
  }
  for (std::size_t k = begin; k < end; ++k) function(scans[k]);
}

/// The nearest half of the pairs that a scan may have, and others evenly chosen: revisits of a
/// place are as many as steps of the path.
std::vector<std::uint32_t> chosen_partners(std::uint32_t scan, std::vector<std::uint32_t> partners,
                                           const std::vector<Box>& boxes, std::uint32_t most) {
  if (partners.size() <= most) return partners;
  const Eigen::Vector3d middle = boxes[scan].middle();
  std::stable_sort(partners.begin(), partners.end(), [&](std::uint32_t a, std::uint32_t b) {
    return (boxes[a].middle() - middle).squaredNorm() < (boxes[b].middle() - middle).squaredNorm();
  });
  const std::size_t nearest = most / 2, rest = most - nearest, others = partners.size() - nearest;
  for (std::size_t k = 0; k < rest; ++k)
    partners[nearest + k] = partners[nearest + k * others / rest];
  partners.resize(most);
  return partners;
}

}  // namespace

std::vector<Pair> near_pairs(const std::vector<PreparedCloud>& clouds,
                             const std::vector<UnalignedIsometry3d>& world_from_scan,
                             const std::vector<std::uint32_t>& islands, std::uint32_t most) {
  const auto scans = static_cast<std::uint32_t>(clouds.size());
  std::vector<Box> boxes;
  for (std::uint32_t k = 0; k < scans; ++k) {
    StopScope::poll();
    boxes.push_back(box_of(clouds[k], world_from_scan[k]));
  }
  const double size = cell_size(boxes);
  std::map<Cell, std::vector<std::uint32_t>> cells;
  for (std::uint32_t k = 0; k < scans; ++k)
    if (!boxes[k].empty())
      for_each_cell(boxes[k], size, [&](const Cell& cell) { cells[cell].push_back(k); });
  std::vector<std::pair<std::uint32_t, std::uint32_t>> chosen;
  std::vector<std::uint32_t> seen_by(scans, scans);
  for (std::uint32_t k = 0; k < scans; ++k) {
    if (boxes[k].empty()) continue;
    StopScope::poll();
    std::vector<std::uint32_t> partners;
    seen_by[k] = k;
    for_each_cell(boxes[k], size, [&](const Cell& cell) {
      for_each_other(cells[cell], k, [&](std::uint32_t other) {
        if (seen_by[other] == k) return;
        seen_by[other] = k;
        if ((islands.empty() || islands[other] == islands[k]) && boxes[k].meets(boxes[other]))
          partners.push_back(other);
      });
    });
    std::sort(partners.begin(), partners.end());
    for (const std::uint32_t other : chosen_partners(k, std::move(partners), boxes, most))
      chosen.push_back(std::minmax(k, other));
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  std::vector<Pair> pairs;
  // The later scan moves, as for the pairs of a folder.
  for (const auto& [low, high] : chosen) pairs.push_back({high, low});
  return pairs;
}

}  // namespace gpureg::reconstruction
