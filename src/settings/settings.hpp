// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/options.hpp"

/// What an alignment works with: every length in the unit of the points, every number that users
/// have no reason to change. resolve() makes it of the options, once, at the entrance.
namespace gpureg {

/// How a raw cloud becomes a PreparedCloud. All lengths in metres (or the unit of the points).
struct PrepareSettings {
  /// Edge of the downsampling voxel, one centroid each (paper: 0.05); 0: keep the points as they
  /// are.
  float voxel_size = 0.05f;
  float unit = 0.05f;  ///< RegistrationOptions::voxel_size, also of points that stay as they are
  /// Neighbourhood of the normal's PCA (paper: 0.1). The wide FPFH is computed from normals of a
  /// radius that is larger by wide_feature_radius / feature_radius, at most 4 feature_radius.
  float normal_radius = 0.1f;
  float feature_radius = 0.25f;  ///< neighbourhood of FPFH, also of its SPFH (paper: 0.25)
  /// Neighbourhood of a second FPFH, matched beside the first (only if the features are FPFH);
  /// 0: none (paper: none). Wide features find matches on floors and walls, where small
  /// neighbourhoods look alike.
  float wide_feature_radius = 0.4f;
  /// Largest distance of an inlier and of a correspondence of the refinement (paper: 0.075). It
  /// sets the cell size of the closest-point grid, so clouds are prepared with it. An alignment may
  /// use a smaller one than its clouds were prepared with, never a larger one.
  float max_correspondence_distance = 0.075f;
  /// Number of viewpoints that get a depth map for free-space tests, evenly chosen among the
  /// cloud's; 0: no maps, and given normals are never turned (PointCloudView::viewpoints). A map
  /// takes 110 KB.
  std::uint32_t depth_maps = 10;
  /// Range in front of and behind its surfaces within which a cloud tells the two sides apart, for
  /// the evidence; 0: not at all (paper: 0). Takes half a byte for each cell of a tenth of it in
  /// the cloud's box; a box of more than 2^26 cells gets none.
  float surface_side_distance = 0.5f;
  /// Keep points at the smallest and the largest range of the sensor: a tank scanned from its
  /// centre has its wall there. Otherwise they are left out, because they are fixed to the sensor
  /// and support no other pose than that at which it did not move
  /// (gpureg/preparation/sensor_fixed.hpp).
  bool keep_range_limits = false;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Candidate poses from matches that keep each other's distances and angles
/// (RegistrationMethod::compatibility).
struct CompatibilitySettings {
  /// Matches kept per pair, chosen at random if there are more, 4..65536.
  std::uint32_t max_matches = 4096;
  std::uint32_t seeds = 512;  ///< matches whose neighbourhoods become candidates, 1..8192
  /// Compatible matches of a seed that take part, 3..1024.
  std::uint32_t max_members = 256;
  /// Triangles tried per seed, each of the seed and two compatible members, 1..4096.
  std::uint32_t triangles = 32;
  /// Least-squares fits to the consensus set of the best triangle, 1..8.
  std::uint32_t refits = 2;
  /// Metres that the distances of compatible matches may differ by.
  float tolerance = 0.05f;
  /// Largest difference of the cosines between their normals, (0, 2]; 2: no test.
  float max_turn = 0.5f;
  /// Metres within which a pose brings a match together.
  float consensus_distance = 0.1f;
  /// Metres around a seed without a weaker seed; shortest side of a triangle.
  float seed_separation = 0.1f;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// The paper's hypotheses (RegistrationMethod::quadruples): uniform quadruples of cached feature
/// matches, scored by their inliers (LoopSmart, Algorithm 1).
struct QuadrupleSettings {
  std::uint32_t count = 4'000'000;  ///< quadruples drawn per pair (paper: 4,000,000); at most 2^30
  /// Nearest features kept per source point, 1..16 (paper: 1).
  std::uint32_t neighbors = 1;
  bool mutual = false;  ///< keep only matches that are nearest in both directions
  /// tau of the polygon test: smallest ratio between corresponding sides, in (0, 1] (paper: 0.9).
  float edge_similarity = 0.9f;
  /// Number of quadruples that are scored, the first ones that pass the polygon test, 1..2^22. The
  /// paper scores all of them: 2^18 does so for real pairs. 4,096 keep recall and precision within
  /// the difference of two seeds (bench/notes/experiments.md). The quadruples are drawn at random,
  /// so those that are left out are like those that are scored.
  std::uint32_t max_survivors = 4096;
  /// Degrees between the normals of an inlier while hypotheses are compared, (0, 180]; 180: no test
  /// (CZK: 30).
  float max_normal_angle = 30.0f;
  /// The same while the winner is verified. Normals of a coarse cloud turn by tens of degrees at
  /// edges and in clutter: under 30 degrees a true pose loses about a quarter of its overlap
  /// (measured at ground-truth poses of 5 cm clouds), a false one gains little.
  float max_verification_normal_angle = 70.0f;
  /// Verified inlier ratio below which no alignment is reported, [0, 1] (CZK: 0.33).
  float min_inlier_ratio = 0.3f;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Robust point-to-plane ICP that refines the winning hypothesis, or every mode.
struct RefineSettings {
  std::uint32_t max_iterations = 16;  ///< 0 switches the refinement off (paper: off)
  /// Width of the Geman-McClure kernel on the point-to-plane distance, metres.
  float kernel_width = 0.025f;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// How candidates are scored and verified (RegistrationMethod::compatibility): support by matches,
/// overlap of both clouds, free space.
struct EvidenceSettings {
  /// Approximate number of points of each cloud that score a candidate, 64..65536.
  std::uint32_t sample = 512;
  std::uint32_t modes = 24;  ///< distinct poses that are refined and verified by all points, 1..64
  float max_normal_angle = 30.0f;  ///< degrees between the normals of an inlier
  /// Two poses are one mode if their rotations differ by less than this, degrees, ...
  float mode_angle = 11.5f;
  float mode_distance = 0.3f;  ///< ... and the cloud's centre by less than this, metres.
  /// Range of the degeneracy search, metres: the most likely mode is perturbed along its weakest
  /// direction by up to this far, both ways, and refined and verified again. Refinement may stop
  /// anywhere along a bare wall; the evidence then tells where. A perturbed pose that stays away
  /// counts as a mode of its own. 0: no search.
  float degeneracy_search_distance = 0.4f;
  /// Metres in front of an observed surface within which a point does not violate free space.
  float free_space_margin = 0.12f;
  float min_range = 0.3f;  ///< metres from a viewpoint below which nothing counts as observed

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

struct RegistrationSettings {
  std::uint64_t seed = 1;
  double min_confidence = 0.5;
  RegistrationMethod method = RegistrationMethod::compatibility;
  /// Move the cloud with fewer points (Choi et al. 2015). The result refers to the given source and
  /// target either way.
  bool smaller_as_source = true;
  bool accept_symmetry = false;
  ConfidenceCalibration calibration;
  PrepareSettings prepare;
  CompatibilitySettings compatibility;
  QuadrupleSettings quadruples;
  RefineSettings refine;
  EvidenceSettings evidence;

  /// A copy with the number of candidates of a quality, everything else as it is.
  /// @throws InvalidArgument if quality is above 10.
  RegistrationSettings with_quality(std::uint32_t quality) const;

  /// @throws InvalidArgument naming the first field that is out of range, and its value.
  void validate() const;
};

}  // namespace gpureg
