// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

#include "gpureg/preparation/sensor_fixed.hpp"
#include "sensor_fixed/known.hpp"

namespace gpureg {
namespace {

/// Scans that are compared, evenly chosen, and rows of each: forty of a part of one per cent.
constexpr std::size_t kScans = 8, kRows = 4096;
constexpr std::size_t kRowJitter = 7919;
constexpr std::size_t kLeastScans = 3;
/// Cells in median ranges: 9 cm in rooms, 40 cm in streets. Neighbours of one surface are in
/// neighbouring cells.
/// Sparse parts have none; for them the cells are twice as wide.
constexpr float kCellRanges[] = {1.0f / 25, 1.0f / 12};
/// A cell is constant where so many of the scans have a point in it.
constexpr double kConstant = 0.8;
/// A part is a connected component of cells of which hardly any is not constant ...
constexpr double kPart = 0.9;
/// ... with this share of the points or more.
constexpr std::size_t kLeastPart = 500, kLeastRows = 8;
/// Scans whose far half is constant to this share were taken from one place (0.54 to 0.64 of scans
/// with other noise; 0.34 of three along a corridor, 0.21 of walks): in cells of so many median
/// ranges, of which a sample misses few.
constexpr double kMoved = 0.45;
constexpr float kGuardRanges = 3.0f / 25;

using PartCell = FixedParts::Cell;

struct CellHash {
  std::size_t operator()(const PartCell& c) const {
    std::uint64_t h = static_cast<std::uint32_t>(c[0]);
    h = h * 0x9E3779B97F4A7C15u + static_cast<std::uint32_t>(c[1]);
    h = h * 0x9E3779B97F4A7C15u + static_cast<std::uint32_t>(c[2]);
    return static_cast<std::size_t>(h ^ (h >> 29));
  }
};
using Counts = std::unordered_map<PartCell, std::size_t, CellHash>;
using CellSet = std::unordered_set<PartCell, CellHash>;

template <typename Action>
void around(const PartCell& c, const Action& action) {
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) action(PartCell{c[0] + x, c[1] + y, c[2] + z});
}

/// A row as seen from the first viewpoint of its cloud.
class SeenRows {
 public:
  explicit SeenRows(const PointCloudView& view) : view_(view) {
    if (view.viewpoint_count > 0)
      from_ = Eigen::Map<const Eigen::Vector3f>(view.viewpoints);
    else
      from_ = Eigen::Map<const Eigen::Vector3d>(view.origin).cast<float>() * -1.0f;
  }
  Eigen::Vector3f at(std::size_t row) const {
    return Eigen::Map<const Eigen::Vector3f>(view_.points + row * view_.point_stride) - from_;
  }

 private:
  const PointCloudView& view_;
  Eigen::Vector3f from_;
};

/// Coordinates beyond are far from any sensor's own parts.
constexpr float kLargest = 1e6f;
bool in_reach(const Eigen::Vector3f& p, float cell) {
  return p.cwiseAbs().maxCoeff() < kLargest * cell;  // not of NaN
}
PartCell cell_of(const Eigen::Vector3f& p, float cell) {
  return {static_cast<std::int32_t>(std::floor(p.x() / cell)),
          static_cast<std::int32_t>(std::floor(p.y() / cell)),
          static_cast<std::int32_t>(std::floor(p.z() / cell))};
}

float middle_of(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return values.empty() ? 0 : *middle;
}

/// A sample of a scan, and its cells.
struct SampledScan {
  std::vector<Eigen::Vector3f> points;
  float median = 0;  ///< range
  Counts rows;       ///< of each cell

  explicit SampledScan(const PointCloudView& view) {
    const SeenRows seen(view);
    const std::size_t step = std::max<std::size_t>(1, view.size / kRows);
    std::vector<float> ranges;
    for (std::size_t k = 0; k < view.size / step; ++k) {
      const Eigen::Vector3f p = seen.at(k * step + k * kRowJitter % step);
      if (!p.allFinite()) continue;
      points.push_back(p);
      ranges.push_back(p.norm());
    }
    median = middle_of(std::move(ranges));
  }
  void sort_into(float cell) {
    rows.clear();
    for (const Eigen::Vector3f& p : points)
      if (in_reach(p, cell)) ++rows[cell_of(p, cell)];
  }
};

/// Cells that are constant, and parts of a scan made of them.
class ConstantCells {
 public:
  ConstantCells(const std::vector<SampledScan>& scans, float cell) : cell_(cell) {
    Counts counts;
    for (const SampledScan& scan : scans)
      for (const auto& [at, rows] : scan.rows) ++counts[at];
    const double least = kConstant * static_cast<double>(scans.size());
    for (const auto& [at, count] : counts)
      if (static_cast<double>(count) >= least)
        around(at, [&](const PartCell& c) { cells_.insert(c); });
  }
  /// Calls action for the cells of parts that are isolated from everything that is not constant.
  template <typename Action>
  void for_parts(const SampledScan& scan, const Action& action) const {
    CellSet visited;
    for (const auto& [start, start_rows] : scan.rows) {
      if (cells_.count(start) == 0 || !visited.insert(start).second) continue;
      std::vector<PartCell> part{start};
      std::size_t constant = 0, rows = 0;
      bool near = true;
      for (std::size_t k = 0; k < part.size(); ++k) {
        const PartCell at = part[k];
        constant += cells_.count(at);
        rows += scan.rows.at(at);
        near &= Eigen::Vector3f(static_cast<float>(at[0]), static_cast<float>(at[1]),
                                static_cast<float>(at[2]))
                        .norm() *
                    cell_ <
                scan.median;
        around(at, [&](const PartCell& c) {
          if (scan.rows.count(c) != 0 && visited.insert(c).second) part.push_back(c);
        });
      }
      if (near && static_cast<double>(constant) >= kPart * static_cast<double>(part.size()) &&
          rows >= std::max(kLeastRows, scan.points.size() / kLeastPart))
        for (const PartCell& at : part) action(at);
    }
  }

 private:
  float cell_;
  CellSet cells_;
};

/// Share of the far halves of the scans that is at the same place in most of them.
double constant_share(const std::vector<SampledScan>& scans, float cell) {
  Counts counts;
  for (const SampledScan& scan : scans) {
    CellSet own;
    for (const Eigen::Vector3f& p : scan.points)
      if (in_reach(p, cell)) own.insert(cell_of(p, cell));
    for (const PartCell& at : own) ++counts[at];
  }
  const double least = kConstant * static_cast<double>(scans.size());
  std::size_t far = 0, constant = 0;
  for (const SampledScan& scan : scans)
    for (const Eigen::Vector3f& p : scan.points) {
      if (!in_reach(p, cell) || p.norm() < scan.median) continue;
      ++far;
      constant += static_cast<double>(counts[cell_of(p, cell)]) >= least ? 1 : 0;
    }
  return static_cast<double>(constant) / static_cast<double>(std::max<std::size_t>(1, far));
}

/// Parts in cells of an edge.
FixedParts parts_in(std::vector<SampledScan>& scans, float cell) {
  FixedParts out;
  out.cell = cell;
  for (SampledScan& scan : scans) scan.sort_into(cell);
  const ConstantCells constant(scans, cell);
  Counts votes;
  for (const SampledScan& scan : scans)
    constant.for_parts(scan, [&](const PartCell& at) { ++votes[at]; });
  for (const auto& [at, count] : votes)
    if (2 * count >= scans.size()) out.cells.push_back(at);
  std::sort(out.cells.begin(), out.cells.end());
  return out;
}

}  // namespace

FixedParts find_fixed_parts(const std::vector<PointCloudView>& clouds) {
  std::vector<const PointCloudView*> known;
  for (const PointCloudView& view : clouds) {
    view.validate();
    if (view.size > 0 && has_sensor_frame(view)) known.push_back(&view);
  }
  if (known.size() < kLeastScans) return {};
  std::vector<SampledScan> scans;
  std::vector<float> ranges;
  const std::size_t chosen = std::min(kScans, known.size());
  for (std::size_t k = 0; k < chosen; ++k) {
    scans.emplace_back(*known[k * known.size() / chosen]);
    ranges.push_back(scans.back().median);
  }
  const float range = middle_of(std::move(ranges));
  if (!(range > 0) || constant_share(scans, kGuardRanges * range) >= kMoved) return {};
  for (const float share : kCellRanges)
    if (FixedParts parts = parts_in(scans, share * range); !parts.cells.empty()) return parts;
  return {};
}

std::vector<std::uint32_t> rows_in(const FixedParts& parts, const PointCloudView& cloud) {
  cloud.validate();
  std::vector<std::uint32_t> out;
  if (parts.cells.empty() || !has_sensor_frame(cloud)) return out;
  CellSet cells;
  for (const PartCell& at : parts.cells) around(at, [&](const PartCell& c) { cells.insert(c); });
  const SeenRows seen(cloud);
  for (std::size_t i = 0; i < cloud.size; ++i) {
    const Eigen::Vector3f p = seen.at(i);
    if (in_reach(p, parts.cell) && cells.count(cell_of(p, parts.cell)) != 0)
      out.push_back(static_cast<std::uint32_t>(i));
  }
  return out;
}

}  // namespace gpureg
