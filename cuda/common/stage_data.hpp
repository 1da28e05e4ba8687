// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "algorithm/closest_build.hpp"
#include "algorithm/evidence.hpp"
#include "algorithm/grid.hpp"
#include "algorithm/moments.hpp"
#include "algorithm/quadruple.hpp"
#include "cuda/device/cell_range.hpp"
#include "cuda/device/segments.hpp"
#include "pipeline/engine.hpp"
#include "pipeline/runs.hpp"

/// Data between the CUDA stages: arrays on the device, one for the whole batch, and metadata on the
/// host.
namespace gpureg::cuda {

/// Metadata of one cloud on the host.
struct CloudFacts {
  float origin[3] = {0, 0, 0};
  float radius = 1;               ///< of the points about the origin, see CloudView
  Vec3 lo{0, 0, 0}, hi{0, 0, 0};  ///< corners of the raw points' box, local
  std::uint64_t input_points = 0, invalid_points = 0;
  std::vector<Vec3> viewpoints;         ///< local, at least one
  bool turns_normals = false;           ///< input normals that face away are flipped
  std::uint32_t feature_dimension = 0;  ///< of the input; 0: none
  bool has_guides = false;
  std::size_t feature_offset = 0;  ///< floats before this cloud's input features
};

/// One raw cloud on the device, rows tight.
struct RawSlot {
  const Vec3* points;
  const Vec3* normals;    ///< null: none
  const float* features;  ///< null: none
  std::uint32_t dimension;
  Vec3 origin;
};

/// Raw points, for the later stages that read them.
struct RawClouds {
  DeviceBuffer<float> rows;  ///< of clouds that came from host memory
  Segments segments;
  DeviceBuffer<RawSlot> slots;
};

struct DownsampledClouds {
  std::vector<CloudFacts> facts;
  Segments segments;
  /// local, in voxel order (z, y, x), or input order without downsampling
  DeviceBuffer<Vec3> points;
  DeviceBuffer<Vec3> guides;     ///< mean input normal of each point, zero where unknown
  DeviceBuffer<float> features;  ///< mean input features, cloud by cloud
  RawClouds raw;                 ///< empty where no depth maps are asked for
};

/// Grids of a batch; views are on the device, one per cloud.
struct Grids {
  DeviceBuffer<CellEntry> table;
  DeviceBuffer<std::uint32_t> cell_start;
  DeviceBuffer<Vec3> points;
  DeviceBuffer<std::uint32_t> index;
  DeviceBuffer<GridView> views;
};

struct Features {
  std::vector<std::uint32_t> dimension;  ///< per cloud; 0: none
  std::vector<std::size_t> offset;       ///< floats before each cloud's rows, and all floats
  DeviceBuffer<float> values;
  DeviceBuffer<std::uint8_t> valid;  ///< by point
};

/// Depth maps of a batch, see algorithm/visibility.hpp.
struct DepthMaps {
  std::vector<std::uint32_t> offset;  ///< maps before each cloud's, and all
  float step = 1;
  DeviceBuffer<std::uint16_t> depth;  ///< maps x kMapCells
  DeviceBuffer<Vec3> viewpoints;      ///< one per map, local
};

/// SurfaceSides of a batch, see algorithm/surface_sides.hpp.
struct SurfaceSides {
  std::vector<SurfaceSideGrid> boxes;  ///< per cloud
  std::vector<std::size_t> offset;     ///< words before each cloud's, and all
  DeviceBuffer<std::uint32_t> words;
};

/// Sizes of the closest-point grid of a cloud.
struct ClosestGridSize {
  std::uint32_t blocks = 0;
  std::uint32_t bricks = 0;       ///< with candidates, see bricks.cuh
  std::uint64_t candidates = 0;   ///< of all cells
  std::uint64_t near_points = 0;  ///< candidates of all blocks, see candidate_lists.hpp
  std::uint64_t list_units = 0;   ///< of the lists of the cells there
};

struct ClosestGrids {
  std::vector<ClosestGeometry> geometry;      ///< per cloud
  std::vector<CellRange> block_range;         ///< per cloud: no block is outside
  Segments blocks;                            ///< per cloud
  DeviceBuffer<Cell> block;                   ///< ascending by key within a cloud
  DeviceBuffer<std::uint32_t> cell_start;     ///< blocks x 513, relative to the cloud's candidates
  std::vector<std::size_t> candidate_offset;  ///< before each cloud's, and all
  DeviceBuffer<std::uint32_t> candidates;
  /// entries before each cloud's, and all; powers of two in between
  std::vector<std::size_t> table_offset;
  DeviceBuffer<CellEntry> table;
  std::vector<ClosestGridSize> size;       ///< per cloud
  DeviceBuffer<std::uint32_t> near_start;  ///< per block, and all: offsets into near
  DeviceBuffer<std::uint32_t> near;        ///< the candidates of each block once, ascending
  DeviceBuffer<std::uint32_t> list_start;  ///< per block: first unit of the lists of its cells
};

/// Summaries of the cells of a closest-point grid, see algorithm/cell_summary.hpp and bricks.cuh.
/// Arrays on the device.
struct CellSummaries {
  float inverse_cell_size = 1;
  Vec3 offset{0, 0, 0};                 ///< in cells: cell = p * inverse_cell_size + offset
  std::int32_t nx = 0, ny = 0, nz = 0;  ///< blocks; 0: none, the cloud is too wide for a table
  /// rows z, rows y, words x: 32 bricks along x, the first in the highest bit, and 16 times the
  /// number of bricks up to the last of them; then (0, all bricks)
  uint2* run = nullptr;
  std::uint32_t* brick = nullptr;  ///< bricks x 16 (z, y): codes of eight cells along x
  /// bricks x 128 (z, y, x): summary, and candidates by candidate_lists.hpp
  uint2* cell = nullptr;
  uint2* block = nullptr;               ///< bricks: lists of the block of each, packed
  std::uint32_t* positions = nullptr;   ///< the lists of all cells
  float4* near = nullptr;               ///< the near lists of all blocks: x, y, z, packed normal
  std::uint32_t* near_index = nullptr;  ///< of these points in the cloud

  /// A brick is a quarter of a block; one block more on each side.
  GPUREG_HD std::uint32_t brick_words_x() const {
    return (static_cast<std::uint32_t>(nx) + 2 + 31) / 32;
  }
  GPUREG_HD std::uint32_t brick_rows_y() const { return 2 * (static_cast<std::uint32_t>(ny) + 2); }
  GPUREG_HD std::uint32_t brick_rows_z() const { return 2 * (static_cast<std::uint32_t>(nz) + 2); }
  GPUREG_HD std::uint32_t brick_runs() const {
    return brick_words_x() * brick_rows_y() * brick_rows_z();
  }
};

/// Points in groups of 32 neighbours; the groups spread over the cloud, so the first few represent
/// all of it.
struct ScoringOrder {
  /// x, y, z, NaN where the last group has no more; w: the normal's class, see directions.hpp
  float4* point = nullptr;
  std::uint32_t* normal = nullptr;  ///< packed, see packed_normal.cuh
  std::uint32_t* index = nullptr;   ///< of the point in the cloud
  std::uint32_t groups = 0;
};

/// Content of the binary16 copies of features: the values themselves, or centred FPFH in the basis
/// of nearest_feature.hpp.
enum class HalfCopy : std::uint8_t { plain, turned };

/// Search data beside the features, see nearest_feature.hpp. Arrays on the device.
struct FeatureAids {
  /// rounded to binary16, times *scale; null where the dimension or a length (over 1e15) forbids it
  std::uint16_t* half = nullptr;
  /// bounds of the squared length; infinite for rows outside the search
  float2* square = nullptr;
  float* error = nullptr;           ///< half of the distance of the bounds
  float* scale = nullptr;           ///< one for the cloud, a power of two
  HalfCopy copy = HalfCopy::plain;  ///< content of all arrays
};

/// Arrays of a prepared cloud: pointers into one piece of memory, and their metadata.
struct CloudArrays {
  /// Host struct of device pointers; executor_data is the CudaCloud. The rows of features have
  /// row_stride() floats. The closest-point grid has arrays only where `summaries` has no table.
  CloudView view_on_device{};
  CellSummaries summaries;
  ScoringOrder order;
  FeatureAids narrow_aids, wide_aids;

  /// The same arrays in a copy of the memory: moves every pointer. A new array needs a line there.
  CloudArrays moved(const char* from, char* to) const;
};

/// A prepared cloud in the memory of one device.
struct CudaCloud : PreparedState, CloudArrays {
  DeviceBuffer<char> data;
  std::vector<Vec3> copy_points() const override;
  std::vector<Vec3> copy_normals() const override;
  std::vector<float> copy_features() const override;
  PointsAndNormals copy_points_and_normals() const override;
};

struct Matches {
  /// where each pair's matches lie; as many as there could be
  Segments room;
  DeviceBuffer<MatchedPoints> pairs;
  DeviceBuffer<std::uint32_t> count;  ///< per pair
};

/// Quadruples drawn for all pairs, as bits; survivors_of() lists those that passed.
struct Samples {
  std::uint32_t chunks = 0;              ///< of quadruples, per pair
  DeviceBuffer<std::uint32_t> words;     ///< pairs x chunks x words: one bit per quadruple
  DeviceBuffer<std::uint32_t> before;    ///< pairs x chunks + 1: survivors in earlier chunks
  std::vector<std::uint32_t> survivors;  ///< per pair, at most max_survivors
};

/// Survivors of a run of pairs.
struct Quadruples {
  std::size_t first_pair = 0;      ///< of the run, in the batch of the matches
  Segments segments;               ///< survivors of each pair
  DeviceBuffer<std::uint32_t> id;  ///< ascending within a pair
};

struct Hypotheses {
  const Segments* segments;  ///< of the quadruples that they were fitted to
  const std::uint32_t* id;
  DeviceBuffer<Pose<float>> pose;     ///< one per survivor
  DeviceBuffer<std::uint8_t> valid;   ///< 0: no rigid motion fits
  DeviceBuffer<std::uint32_t> count;  ///< valid ones per pair
};

struct BestPose {
  std::uint32_t found;
  std::uint32_t iterations;
  Support support;
  Pose<double> pose;
};

struct Verification {
  Support support;
  Moments source, target;
};

/// A match side by side: two sectors of memory instead of one for each value. Points, sum of the
/// weights; normals.
struct MatchRow {
  float4 points[2];   ///< p.xyz q.x, q.yz, bits of the sum of both weights, unused
  float4 normals[2];  ///< m.xyz n.x, n.yz, unused
};

/// Matches of a batch in device memory, a column for each value; see cpu::MatchSet. Real, Integer:
/// constant for those who read.
template <typename Real, typename Integer>
struct MatchColumns {
  static constexpr std::size_t kReals = 12, kIntegers = 4;
  Real *px, *py, *pz, *qx, *qy, *qz;  ///< local points of source and target
  Real *mx, *my, *mz, *nx, *ny, *nz;  ///< their normals
  Integer *source, *target;           ///< their indices
  /// Normal-space weights over the matches of the pair.
  Integer *source_weight, *target_weight;

  /// Columns of n values, one after the other.
  void set(Real* reals, Integer* integers, std::size_t n) {
    Real** const of_reals[kReals] = {&px, &py, &pz, &qx, &qy, &qz, &mx, &my, &mz, &nx, &ny, &nz};
    for (Real** column : of_reals) *column = std::exchange(reals, reals + n);
    Integer** const of_integers[kIntegers] = {&source, &target, &source_weight, &target_weight};
    for (Integer** column : of_integers) *column = std::exchange(integers, integers + n);
  }
};

struct MatchSetView : MatchColumns<const float, const std::uint32_t> {
  const MatchRow* rows;  ///< the same for access in any order
};

struct MatchSets {
  using Columns = MatchColumns<float, std::uint32_t>;
  /// where each pair's matches lie; as many as there could be
  Segments room;
  /// of Columns, each as long as the room for all pairs
  DeviceBuffer<float> reals;
  DeviceBuffer<std::uint32_t> integers;
  DeviceBuffer<MatchRow> rows;
  DeviceBuffer<std::uint32_t> count;  ///< per pair
  /// per pair: weight of all source points, of all target points
  DeviceBuffer<std::uint64_t> total;

  Columns columns() const {
    Columns columns;
    columns.set(reals.data(), integers.data(), room.total());
    return columns;
  }
  MatchSetView view() const {
    MatchSetView view;
    view.set(reals.data(), integers.data(), room.total());
    view.rows = rows.data();
    return view;
  }
};

/// Seeds of a batch, with space for the largest possible number per pair.
struct Seeds {
  std::uint32_t most = 0;             ///< per pair
  DeviceBuffer<std::uint32_t> match;  ///< pairs x most
  DeviceBuffer<std::uint32_t> count;  ///< per pair
};

/// Candidate poses in the order of their seeds, with space for the largest possible number per
/// pair.
struct Candidates {
  std::uint32_t most = 0;
  DeviceBuffer<Pose<float>> pose;
  DeviceBuffer<std::uint32_t> seed;  ///< index of the seed match
  DeviceBuffer<MatchEvidence> matches;
  DeviceBuffer<float> coarse_score;
  DeviceBuffer<std::uint32_t> count;  ///< per pair
};

/// A distinct pose.
struct Mode {
  Pose<double> pose;
  std::uint32_t seed, iterations;
};

struct Modes {
  std::uint32_t most = 0;
  DeviceBuffer<Mode> mode;            ///< pairs x most
  DeviceBuffer<std::uint32_t> count;  ///< per pair
};

}  // namespace gpureg::cuda
