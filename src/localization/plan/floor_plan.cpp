// SPDX-License-Identifier: BSD-3-Clause
#include "localization/plan/floor_plan.hpp"

#include <algorithm>
#include <cmath>

#include "api/access.hpp"
#include "common/for_each_on.hpp"
#include "common/radix_sort.hpp"
#include "common/whole.hpp"
#include "localization/sides.hpp"
#include "math/atan2.hpp"

namespace gpureg::localization {
namespace {

/// Normals that are looked at, and the cosines within which they agree and belong to an axis.
constexpr std::size_t kNormals = 1024;
constexpr float kAgree = 0.985f, kBelong = 0.98f;
/// Sines of the slope of a wall, at most, and of a floor, at least.
constexpr float kWall = 0.4f, kFloor = 0.8f;
/// Share of an axis that its opposite has at least where a map has ceilings.
constexpr double kCeilings = 0.1;
constexpr std::uint32_t kMostHeight = (1u << FloorPlan::kHeightBits) - 1;
/// A map of so many coarse cells, or of twice as many as it has points, has far stray points: its
/// plan would be empty nearly everywhere, and a search through it would take too long.
constexpr double kAnyCells = 1 << 17, kCellsOfPoint = 2;

using Entry = FloorPlan::Entry;

void merge(std::vector<Entry>& entries) {
  radix_sort(entries, [](const Entry& e) { return e.key; });
  std::size_t kept = 0;
  for (const Entry& entry : entries) {
    if (kept > 0 && entries[kept - 1].key == entry.key)
      entries[kept - 1].facing |= entry.facing;
    else
      entries[kept++] = entry;
  }
  entries.resize(kept);
}

/// The map's normals. Those of tiles without sides are estimated.
class Normals {
 public:
  Normals(const MapState& map, unsigned threads) : map_(map), estimated_(map.tiles.size()) {
    const Context context = Context::cpu(threads);
    for (std::size_t tile = 0; tile < map.tiles.size(); ++tile) {
      if (knows(tile)) continue;
      estimated_[tile] = tile_normals(context, map, tile);
      has_sides_ = false;
    }
  }
  bool has_sides() const { return has_sides_; }

  Eigen::Vector3f at(std::size_t tile, std::size_t point) const {
    if (!estimated_[tile].empty()) return estimated_[tile][point - map_.tiles[tile].begin];
    const Side& side = map_.sides[point];
    const Eigen::Vector3f normal = Eigen::Vector3i(side[0], side[1], side[2]).cast<float>();
    return side == Side{} ? normal : Eigen::Vector3f(normal.normalized());
  }
  std::vector<Eigen::Vector3f> some() const {
    std::vector<Eigen::Vector3f> out;
    const std::size_t step = map_.points.size() / (4 * kNormals) + 1;
    for (std::size_t tile = 0; tile < map_.tiles.size(); ++tile)
      for (std::size_t k = map_.tiles[tile].begin; k < map_.tiles[tile].end; k += step)
        out.push_back(at(tile, k));
    return out;
  }

 private:
  bool knows(std::size_t tile) const {
    if (map_.sides.empty()) return false;
    const std::size_t begin = map_.tiles[tile].begin, end = map_.tiles[tile].end;
    std::size_t known = 0;
    for (std::size_t k = begin; k < end; ++k) known += map_.sides[k] != Side{};
    return 2 * known > end - begin;
  }

  const MapState& map_;
  std::vector<std::vector<Eigen::Vector3f>> estimated_;
  bool has_sides_ = true;
};

}  // namespace

std::vector<Axis> frequent_axes(const std::vector<Eigen::Vector3f>& normals, std::size_t most) {
  std::vector<Eigen::Vector3f> sample;
  for (std::size_t k = 0; k < normals.size(); k += normals.size() / kNormals + 1)
    if (normals[k].squaredNorm() > 0.5f) sample.push_back(normals[k]);
  std::vector<Axis> axes;
  while (axes.size() < most && !sample.empty()) {
    std::size_t best = 0, agreeing = 0;
    for (std::size_t a = 0; a < sample.size(); ++a) {
      std::size_t count = 0;
      for (const Eigen::Vector3f& other : sample) count += std::abs(sample[a].dot(other)) > kAgree;
      if (count > agreeing) best = a, agreeing = count;
    }
    Axis axis;
    axis.direction = sample[best];
    for (int round = 0; round < 3; ++round) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      axis.facing = axis.opposite = 0;
      for (const Eigen::Vector3f& normal : sample) {
        const float along = normal.dot(axis.direction);
        if (std::abs(along) <= kBelong) continue;
        sum += along > 0 ? normal : Eigen::Vector3f(-normal);
        ++(along > 0 ? axis.facing : axis.opposite);
      }
      axis.direction = sum.normalized();
    }
    if (axis.facing < axis.opposite) {
      axis.direction = -axis.direction;
      std::swap(axis.facing, axis.opposite);
    }
    axes.push_back(axis);
    sample.erase(std::remove_if(sample.begin(), sample.end(),
                                [&](const Eigen::Vector3f& normal) {
                                  return std::abs(normal.dot(axis.direction)) > kSameAxis;
                                }),
                 sample.end());
  }
  return axes;
}

Eigen::Matrix3f upright(const Eigen::Vector3f& direction) {
  // Any rotation about the axis will do: a basis from the coordinate that is the smallest.
  Eigen::Index least = 0;
  direction.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3f x = direction.cross(Eigen::Vector3f::Unit(least)).normalized();
  Eigen::Matrix3f rotation;
  rotation << x.transpose(), direction.cross(x).transpose(), direction.transpose();
  return rotation;
}

namespace facing {

std::uint32_t of(const Eigen::Vector3f& normal, bool exact) {
  if (normal.squaredNorm() < 0.5f) return 0;
  if (std::abs(normal[2]) >= localization::kFloor) return normal[2] > 0 ? kFloor : kCeiling;
  if (std::abs(normal[2]) > kWall) return 0;
  constexpr float kPerRadian = kDirections / (2 * kPi);
  const int nearest = static_cast<int>(std::lround(exact_atan2(normal[1], normal[0]) * kPerRadian));
  const auto bit = [](int direction) {
    return 1u << ((direction + 2 * kDirections) % kDirections);
  };
  return exact ? bit(nearest) : bit(nearest - 1) | bit(nearest) | bit(nearest + 1);
}

std::uint32_t both_sides(std::uint32_t facing) {
  const std::uint32_t walls = facing & kWalls;
  const std::uint32_t turned = (walls << kDirections / 2 | walls >> kDirections / 2) & kWalls;
  const bool flat = (facing & ~kWalls) != 0;
  return walls | turned | (flat ? kFloor | kCeiling : 0);
}

}  // namespace facing

FloorPlan::FloorPlan(const MapState& map, unsigned threads) {
  const Normals normals(map, threads);
  has_sides = normals.has_sides();
  const std::vector<Axis> axes = frequent_axes(normals.some(), 1);
  if (axes.empty()) return;
  turn = upright(axes.front().direction);
  has_ceiling = !has_sides || static_cast<double>(axes.front().opposite) >
                                  kCeilings * static_cast<double>(axes.front().facing);
  cell = kCell * map.options.prepare.voxel_size;
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& point : map.points) box.extend(turn * point);
  const auto coarse_cells = [&](int axis) {
    return std::floor(static_cast<double>(box.sizes()[axis]) / (2 * static_cast<double>(cell))) + 2;
  };
  const double with_margin =
      (coarse_cells(0) + 2 * kCoarseMargin) * (coarse_cells(1) + 2 * kCoarseMargin);
  if (with_margin > kAnyCells + kCellsOfPoint * static_cast<double>(map.points.size())) return;
  corner = box.min().array() - cell / 2;
  width = 2 * static_cast<int>(coarse_cells(0));
  height = 2 * static_cast<int>(coarse_cells(1));

  std::vector<std::vector<Entry>> of_tiles(map.tiles.size());
  for_each_on(threads, map.tiles.size(), [&](std::size_t tile) {
    std::vector<Entry>& entries = of_tiles[tile];
    for (std::size_t k = map.tiles[tile].begin; k < map.tiles[tile].end; ++k) {
      std::uint32_t faces = facing::of(turn * normals.at(tile, k), false);
      if (!has_sides) faces = facing::both_sides(faces);
      if (faces == 0) continue;
      const Eigen::Vector3f at = (turn * map.points[k] - corner) / cell;
      const auto up = whole(at[2], std::uint32_t{0}, kMostHeight);
      // A scan's points fall into a neighbouring cell, too, up to a quarter of a cell away.
      const Eigen::Array2f across = at.head<2>();
      const auto low = (across - 0.25f).cast<std::int32_t>().eval(),
                 high = (across + 0.25f).cast<std::int32_t>().eval();
      for (std::int32_t y = low[1]; y <= high[1]; ++y)
        for (std::int32_t x = low[0]; x <= high[0]; ++x) {
          const std::uint64_t number =
              static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(width) +
              static_cast<std::uint64_t>(x);
          entries.push_back({number << kHeightBits | up, faces});
        }
    }
    merge(entries);
  });
  fill_columns(of_tiles, threads);
  fill_coarse(threads);
}

plan::Map FloorPlan::view() const {
  plan::Map out{};
  out.coarse = coarse.data();
  out.walls = walls.data();
  out.coarse_rows = coarse_height() + 2 * kCoarseMargin;
  out.coarse_words = (coarse_width() + 2 * kCoarseMargin) / 32 + 3;
  out.rows = height + 2 * kMargin;
  out.stride = width + 2 * kMargin;
  out.coarse_margin = kCoarseMargin;
  out.margin = kMargin;
  return out;
}

void FloorPlan::fill_columns(const std::vector<std::vector<Entry>>& of_tiles, unsigned threads) {
  const auto row = static_cast<std::uint64_t>(width);
  const std::size_t cells = static_cast<std::size_t>(row) * static_cast<std::size_t>(height);
  walls.assign(static_cast<std::size_t>(width + 2 * kMargin) *
                   static_cast<std::size_t>(height + 2 * kMargin),
               0);
  column_begin.assign(cells + 1, 0);
  // Tiles overlap by a cell at their borders. Bands of rows are merged side by side.
  constexpr std::size_t kRows = 32;
  const std::size_t bands = (static_cast<std::size_t>(height) + kRows - 1) / kRows;
  std::vector<std::vector<Entry>> of_bands(bands);
  for_each_on(threads, bands, [&](std::size_t band) {
    std::vector<Entry>& entries = of_bands[band];
    const auto first_of = [&](const std::vector<Entry>& of_tile, std::size_t number) {
      const std::uint64_t key = number * kRows * row << kHeightBits;
      return std::lower_bound(of_tile.begin(), of_tile.end(), key,
                              [](const Entry& e, std::uint64_t k) { return e.key < k; });
    };
    for (const std::vector<Entry>& of_tile : of_tiles)
      entries.insert(entries.end(), first_of(of_tile, band), first_of(of_tile, band + 1));
    if (of_tiles.size() > 1) merge(entries);
    for (const Entry& entry : entries) {
      const std::uint64_t number = entry.key >> kHeightBits;
      walls[place_of(static_cast<int>(number % row), static_cast<int>(number / row))] |=
          static_cast<std::uint16_t>(entry.facing & facing::kWalls);
      ++column_begin[number + 1];
    }
  });
  for (std::size_t k = 0; k < cells; ++k) column_begin[k + 1] += column_begin[k];
  columns.resize(column_begin.back());
  for_each_on(threads, bands, [&](std::size_t band) {
    std::uint32_t* out = columns.data() + column_begin[band * kRows * row];
    for (const Entry& entry : of_bands[band])
      *out++ = static_cast<std::uint32_t>(entry.key) << facing::kBits | entry.facing;
    of_bands[band] = {};
  });
}

void FloorPlan::fill_coarse(unsigned threads) {
  const plan::Map map = view();
  const auto rows = static_cast<std::size_t>(map.coarse_rows),
             words = static_cast<std::size_t>(map.coarse_words);
  coarse.assign(plan::kPlanes * rows * words, 0);
  for_each_on(threads, static_cast<std::size_t>(height / 2), [&](std::size_t coarse_row) {
    const std::size_t row = coarse_row + kCoarseMargin;
    for (int k = 0; k < 2 * width; ++k) {
      const int x = k / 2;
      const std::uint32_t faces = walls_of(x, 2 * static_cast<int>(coarse_row) + k % 2);
      if (faces == 0) continue;
      const std::uint32_t either = facing::both_sides(faces);
      const auto column = static_cast<std::size_t>(x / 2 + kCoarseMargin);
      const auto set = [&](std::size_t plane) {
        coarse[(plane * rows + row) * words + column / 32] |= 1u << column % 32;
      };
      for (std::size_t d = 0; d < facing::kDirections; ++d) {
        if (faces >> d & 1) set(d);
        if (d < facing::kDirections / 2 && either >> d & 1) set(facing::kDirections + d);
      }
    }
  });
}

const FloorPlan& MapState::plan(unsigned threads) const {
  std::call_once(planned_, [&] { plan_ = std::make_shared<const FloorPlan>(*this, threads); });
  return *plan_;
}

std::shared_ptr<PlanMatcher> MapState::plan_matcher(const Context& context) const {
  const FloorPlan& of_map = plan(host_threads(context));
  const std::shared_ptr<Engine>& engine = Access::engine(context);
  const std::lock_guard<std::mutex> lock(mutex_);
  matchers_.erase(std::remove_if(matchers_.begin(), matchers_.end(),
                                 [](const auto& m) { return m.first.expired(); }),
                  matchers_.end());
  for (const auto& [of_engine, matcher] : matchers_)
    if (of_engine.lock() == engine) return matcher;
  matchers_.emplace_back(engine, engine->match_plan(of_map.view()));
  return matchers_.back().second;
}

}  // namespace gpureg::localization
