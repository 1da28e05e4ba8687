// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "algorithm/closest.hpp"
#include "algorithm/grid.hpp"
#include "algorithm/moments.hpp"
#include "algorithm/quadruple.hpp"
#include "algorithm/support.hpp"
#include "algorithm/surface_sides.hpp"
#include "pipeline/engine.hpp"

/// Data between the CPU stages: values, one entry per cloud or pair of the batch.
namespace gpureg::cpu {

struct DownsampledCloud {
  float origin[3] = {0, 0, 0};
  float radius = 1;               ///< of the points about the origin
  Vec3 lo{0, 0, 0}, hi{0, 0, 0};  ///< corners of the raw points' box, local
  std::uint64_t input_points = 0, invalid_points = 0;
  /// Local, in voxel order (z, y, x), or in input order without downsampling.
  std::vector<Vec3> points;
  /// Empty, or the mean input normal of each point, zero where unknown.
  std::vector<Vec3> guides;
  std::vector<float> features;  ///< empty, or the mean input feature of each point
  std::uint32_t feature_dimension = 0;
  std::vector<Vec3> viewpoints;  ///< local, at least one
  bool turns_normals = false;    ///< input normals that face away are flipped
  bool matched_only = false;     ///< see RawCloud
};

struct CellTable {
  std::vector<CellEntry> entries;
  /// Makes room for that many keys.
  void reset(std::size_t keys);
  void insert(std::uint64_t key, std::uint32_t value);
};

struct Grid {
  float cell_size = 1;
  CellTable table;
  std::vector<std::uint32_t> cell_start;
  std::vector<Vec3> points;
  std::vector<std::uint32_t> index;
  GridView view() const;
};

struct Features {
  std::vector<float> values;
  std::vector<std::uint8_t> valid;
  std::uint32_t dimension = 0;
};

/// See cell_summary.hpp.
struct ScoringOrder {
  std::vector<float> x, y, z, nx, ny, nz;
  std::vector<std::uint32_t> index;      ///< of the point, kNoValue for padding
  std::vector<std::uint32_t> remaining;  ///< per group of 64: points in the groups after it
};

/// See cell_summary.hpp. Empty for a cloud too wide for the table.
struct CellSummaries {
  float inverse_cell_size = 1;
  Vec3 offset{0, 0, 0};                 ///< in cells: cell = p * inverse_cell_size + offset
  std::int32_t nx = 0, ny = 0, nz = 0;  ///< blocks
  std::vector<std::int32_t> block;      ///< 1 + index of the block, or 0
  std::vector<std::uint32_t> summary;   ///< (1 + blocks) x 512
};

/// Depth maps of a cloud's viewpoints, see visibility.hpp.
struct Visibility {
  std::vector<std::uint16_t> depth;  ///< viewpoints x kMapCells
  std::vector<Vec3> viewpoints;      ///< local
  float step = 1;
  VisibilityView view() const {
    return {depth.data(), viewpoints.data(), static_cast<std::uint32_t>(viewpoints.size()), step};
  }
};

/// See surface_sides.hpp.
struct SurfaceSides {
  SurfaceSideGrid box;
  std::vector<std::uint32_t> words;
  SurfaceSideView view() const { return {box, words.empty() ? nullptr : words.data()}; }
};

struct ClosestGrid {
  float cell_size = 1;
  CellTable table;
  std::vector<std::uint32_t> cell_start;
  std::vector<std::uint32_t> candidates;
  std::vector<Cell> blocks;  ///< in order of their index
  ClosestGridView view() const;
};

struct FeatureRows {
  const float* values;
  const std::uint8_t* valid;
  std::uint32_t size, dimension;
};
struct FeatureIndex;

/// Index of a cloud's features. The first search makes it, and later ones use it: it takes about as
/// long as a search. Thread-safe.
class KeptIndex {
 public:
  const FeatureIndex& of(FeatureRows rows) const;

 private:
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const FeatureIndex> index_;
};

/// The data of a PreparedCloud.
struct CpuCloud : PreparedState {
  std::vector<Vec3> points, normals;
  Features features, wide_features;
  KeptIndex index, wide_index;  ///< of the features
  std::vector<std::uint32_t> normal_weight;
  Visibility visibility;
  SurfaceSides surface_sides;
  std::shared_ptr<const ClosestGrid> closest;  ///< one for both sides of a cloud
  ScoringOrder order;
  CellSummaries summaries;
  std::vector<Vec3> copy_points() const override { return points; }
  std::vector<Vec3> copy_normals() const override { return normals; }
  std::vector<float> copy_features() const override { return features.values; }
  CloudView view() const;
};

inline const CpuCloud& executor_data(const CloudView& cloud) {
  return *static_cast<const CpuCloud*>(cloud.executor_data);
}

struct Matches {
  std::vector<MatchedPoints> pairs;
};

/// Matches of a pair for the candidates, one array per coordinate, in pseudorandom order.
struct MatchSet {
  std::vector<float> px, py, pz, qx, qy, qz;  ///< local points of source and target
  std::vector<float> mx, my, mz, nx, ny, nz;  ///< their normals
  std::vector<std::uint32_t> source, target;  ///< their indices
  /// Normal-space weights over all matches of the set.
  std::vector<std::uint32_t> source_weight, target_weight;
  std::uint64_t source_total = 0, target_total = 0;
  std::uint32_t found = 0;  ///< number of distinct matches before the limit
  std::uint32_t size() const { return static_cast<std::uint32_t>(source.size()); }
};

/// Candidate poses of a pair, in the order of their seeds.
struct Candidates {
  std::vector<Pose<float>> pose;
  std::vector<std::uint32_t> seed;  ///< index of the seed match
  std::vector<MatchEvidence> matches;
  std::vector<float> coarse_score;
};

/// A distinct pose.
struct Mode {
  Pose<double> pose = identity_pose<double>();
  std::uint32_t seed = 0, iterations = 0;
};

struct Hypotheses {
  std::vector<std::uint32_t> id;  ///< index among all drawn, ascending
  std::vector<Pose<float>> pose;
};

/// Best hypothesis of a pair, or none (found false).
struct BestPose {
  bool found = false;
  Pose<double> pose = identity_pose<double>();
  Support support{0, 0, 0};
  std::uint32_t iterations = 0;
};

/// Verification of the final pose: its support under the verification normal test, and the moments
/// of all points within the distance.
struct Verification {
  Support support{0, 0, 0};
  Moments source{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
  Moments target{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
};

}  // namespace gpureg::cpu
