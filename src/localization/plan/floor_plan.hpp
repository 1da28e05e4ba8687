// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "algorithm/plan.hpp"
#include "localization/map_state.hpp"

namespace gpureg::localization {

/// A direction that many normals have, and how many face it and its opposite.
struct Axis {
  Eigen::Vector3f direction{0, 0, 1};  ///< at least as many face it as its opposite
  std::size_t facing = 0, opposite = 0;
};

constexpr float kSameAxis = 0.87f;  ///< cosine of 30 degrees

/// The most frequent directions of normals, up to the sign, farther apart than kSameAxis.
std::vector<Axis> frequent_axes(const std::vector<Eigen::Vector3f>& normals, std::size_t most);

/// The rotation that turns a direction to z.
Eigen::Matrix3f upright(const Eigen::Vector3f& direction);

/// What faces a point of a surface, as bits: 16 directions of walls, floor and ceiling.
namespace facing {
constexpr int kDirections = plan::kDirections, kBits = kDirections + 2;
constexpr std::uint32_t kWalls = (1u << kDirections) - 1, kFloor = 1u << 16, kCeiling = 1u << 17;
/// Bits of a normal, upright; 0 for a slope. exact: for walls the nearest direction alone, without
/// both neighbours.
std::uint32_t of(const Eigen::Vector3f& normal, bool exact);
/// The same surfaces seen from either side.
std::uint32_t both_sides(std::uint32_t facing);
}  // namespace facing

/// A map seen along its most frequent normal, which is the vertical nearly everywhere: its walls by
/// the direction that they face, in cells of two voxels and of four, and what is in the column of
/// each cell.
struct FloorPlan {
  /// Cells of the search, in voxels.
  static constexpr float kCell = 2;
  static constexpr int kHeightBits = 32 - facing::kBits;
  /// Walls of a scan farther from its middle, in voxels, do not decide: a step of the heading moves
  /// them too far.
  static constexpr float kReach = 100;
  /// Empty cells around the coarse planes, and around the walls, as far as the walls of a scan
  /// reach.
  static constexpr int kCoarseMargin = static_cast<int>(kReach / (2 * kCell)) + 2;
  static constexpr int kMargin = 2 * kCoarseMargin + 2 * plan::kAround + 2;

  Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();  ///< of the map's rows
  bool has_sides = false;                              ///< false: every surface faces both sides
  bool has_ceiling = false;  ///< some surfaces face the opposite of the axis
  float cell = 0;            ///< metres
  Eigen::Vector3f corner{0, 0, 0};
  int width = 0,
      height = 0;  ///< cells, even; 0: no plan, the map has no normals or far stray points
  /// See plan::Map.
  std::vector<std::uint16_t> walls;
  std::vector<std::uint32_t> coarse;
  /// The entries of each cell: height over `corner` in cells << facing::kBits | what faces.
  std::vector<std::uint32_t> column_begin, columns;

  FloorPlan(const MapState& map, unsigned threads);

  /// Of a cell: its number << kHeightBits | a height, and what faces.
  struct Entry {
    std::uint64_t key;
    std::uint32_t facing;
  };

  int coarse_width() const { return width / 2; }
  int coarse_height() const { return height / 2; }
  plan::Map view() const;
  /// What walls of a cell face, as bits.
  std::uint16_t walls_of(int x, int y) const { return walls[place_of(x, y)]; }

 private:
  std::size_t place_of(int x, int y) const {
    return static_cast<std::size_t>(y + kMargin) * static_cast<std::size_t>(width + 2 * kMargin) +
           static_cast<std::size_t>(x + kMargin);
  }
  /// @param of_tiles sorted by key, without duplicates.
  void fill_columns(const std::vector<std::vector<Entry>>& of_tiles, unsigned threads);
  void fill_coarse(unsigned threads);
};

}  // namespace gpureg::localization
