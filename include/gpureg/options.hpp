// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace gpureg {

/// How a raw cloud becomes a PreparedCloud. All lengths in metres (or the unit of the points).
struct PrepareOptions {
  /// edge of the downsampling voxel, one centroid each (paper: 0.05); 0: keep the points as they
  /// are
  float voxel_size = 0.05f;
  /// Neighbourhood of the normal's PCA (paper: 0.1). The wide FPFH describes normals of one that is
  /// wider by wide_feature_radius / feature_radius, at most 4 feature_radius.
  float normal_radius = 0.1f;
  float feature_radius = 0.25f;  ///< neighbourhood of FPFH, also of its SPFH (paper: 0.25)
  /// Cell of the closest-point look-up of alignment; derived from max_correspondence_distance, see
  /// RegistrationOptions. farthest neighbour that alignment will ever ask this cloud for
  float search_distance = 0.075f;
  /// Neighbourhood of a second FPFH, matched beside the first (only where the features are FPFH);
  /// 0: none (paper: none). Wide features find matches where small neighbourhoods look alike:
  /// floors, walls.
  float wide_feature_radius = 0.4f;
  /// Viewpoints that depth maps are made of for free-space tests, evenly chosen among the cloud's;
  /// 0: no maps, and given normals are never turned (PointCloudView::viewpoints). 110 KB each.
  std::uint32_t depth_maps = 10;
  /// How far from its surfaces a cloud tells their front, the side from which they were seen, from
  /// their back, for the evidence; 0: not at all (paper: 0). Half a byte for each cell of a tenth
  /// of it in the cloud's box, half a megabyte for a fragment of a room; a box of more than 2^26
  /// cells has none.
  float front_reach = 0.5f;

  /// Throws InvalidArgument naming field and value.
  void validate() const;
};

/// How candidate poses are found.
enum class Proposal : std::uint8_t {
  quadruples,  ///< uniform quadruples of matches, the winner by its inliers (paper, Algorithm 1)
  /// second-order spatial compatibility of matches (SC2-PCR, Chen et al. 2022), judged by evidence
  compatibility
};

const char* to_string(Proposal proposal);

/// Where hypotheses come from. All but proposal, smaller_as_source and seed are of
/// Proposal::quadruples: uniform quadruples of cached feature matches (paper, Algorithm 1).
struct HypothesisOptions {
  Proposal proposal = Proposal::compatibility;
  /// quadruples drawn per pair (paper: 4,000,000); at most 2^30
  std::uint32_t count = 4'000'000;
  std::uint32_t neighbors = 1;  ///< nearest features kept per source point, 1..16 (paper: 1)
  bool mutual = false;          ///< keep only matches that are nearest in both directions
  /// tau of the polygon test: sides may differ by this ratio, in (0, 1] (paper: 0.9)
  float edge_similarity = 0.9f;
  /// Of the quadruples that pass the polygon test, the first so many are scored. Real pairs stay
  /// far below (a hundred thousand where almost every match is right); two copies of one cloud
  /// would let millions through, each as good as the next. 1..2^22.
  std::uint32_t max_survivors = 1u << 18;
  /// sample and score the cloud with fewer points (Choi et al. 2015); the pose is turned back
  bool smaller_as_source = true;
  /// same seed, same bits, on any backend, thread count and batch split
  std::uint64_t seed = 1;

  void validate() const;
};

/// Candidate poses from matches that keep each other's distances and angles
/// (Proposal::compatibility).
struct CompatibilityOptions {
  /// kept per pair, chosen at random where there are more, 4..65536
  std::uint32_t max_matches = 8192;
  std::uint32_t seeds = 1024;       ///< matches whose neighbourhoods become candidates, 1..8192
  std::uint32_t max_members = 512;  ///< of a seed's compatible matches, those looked at, 3..1024
  /// tried per seed, each of the seed and two compatible members, 1..4096
  std::uint32_t triangles = 64;
  /// least-squares fits to the members that the best triangle brings together, 1..8
  std::uint32_t refits = 2;
  /// metres that the distances of compatible matches may differ by
  float tolerance = 0.05f;
  /// that the cosines of the angles of their normals may differ by, (0, 2]; 2: no test
  float max_turn = 0.5f;
  float consensus_distance = 0.1f;  ///< metres within which a pose brings a match together
  /// metres around a seed without a lesser one; shortest side of a triangle
  float seed_separation = 0.1f;

  void validate() const;
};

/// How candidates are judged (Proposal::compatibility): support by matches and by both clouds, and
/// free space.
struct EvidenceOptions {
  /// about so many points of each cloud judge a candidate at first, 64..65536
  std::uint32_t sample = 512;
  std::uint32_t modes = 24;        ///< distinct poses refined and judged by all points, 1..64
  float max_normal_angle = 30.0f;  ///< degrees between the normals of an inlier
  float mode_angle = 11.5f;        ///< degrees, and ...
  /// ... metres between the cloud's centres, within which two poses are one
  float mode_distance = 0.3f;
  /// Metres that the likeliest pose is slid, both ways, along the direction that its surfaces
  /// determine least (and by quarters of it, where it is open whether the pose is right):
  /// refinement ends anywhere along a bare wall, and the evidence then says where. What stays away
  /// from it is a rival. 0: not at all.
  float slide_distance = 0.4f;
  /// metres before a seen surface that a point may lie without contradicting it
  float free_space_margin = 0.12f;
  /// metres from a viewpoint, nearer than which nothing is judged
  float min_range = 0.3f;

  void validate() const;
};

/// What makes a point an inlier and a hypothesis a result. All but max_correspondence_distance is
/// of Proposal::quadruples.
struct ScoreOptions {
  float max_correspondence_distance = 0.075f;  ///< metres (paper: 0.075)
  /// Degrees between the normals of an inlier while hypotheses are compared, (0, 180]; 180 switches
  /// the test off (CZK: 30).
  float max_normal_angle = 30.0f;
  /// The same while the winner is judged. Normals of a coarse cloud turn by tens of degrees at
  /// edges and in clutter: under 30 degrees a true pose loses about a quarter of its overlap
  /// (measured at ground-truth poses of 5 cm clouds), a wrong one has little to gain.
  float max_judged_normal_angle = 70.0f;
  /// judged inlier ratio below which no alignment is reported, [0, 1] (CZK: 0.33)
  float min_inlier_ratio = 0.3f;

  void validate() const;
};

/// Robust point-to-plane ICP that polishes the winning hypothesis, or every mode.
struct RefineOptions {
  std::uint32_t max_iterations = 16;           ///< 0 switches the refinement off (paper: off)
  float max_correspondence_distance = 0.075f;  ///< metres, <= PrepareOptions::search_distance
  /// metres, width of the Geman-McClure kernel on the point-to-plane distance
  float kernel_width = 0.025f;

  void validate() const;
};

/// The steps of the dial between speed and recall: 0 is the fastest, 10 finds the most.
inline constexpr std::uint32_t kDefaultQuality = 5, kHighestQuality = 10;

/// All options of one registration. An aggregate with in-class defaults: set what you want to
/// change.
struct RegistrationOptions {
  PrepareOptions prepare;
  HypothesisOptions hypothesis;
  CompatibilityOptions compatibility;
  EvidenceOptions evidence;
  ScoreOptions score;
  RefineOptions refine;
  /// Proposal::compatibility: confidence below which no alignment is reported, [0, 1]
  double min_confidence = 0.5;

  /// Every length from the voxel size: normals 2 v, FPFH 5 v and 8 v, correspondence distance 1.5
  /// v, kernel 0.5 v, compatibility 1 v, free-space margin 2.4 v. quality, 0 to 10, sets how many
  /// candidates are looked at: compatibility.seeds and triangles, evidence.modes. Throws
  /// InvalidArgument unless v is finite and > 0 and quality at most 10.
  static RegistrationOptions from_voxel_size(float voxel_size,
                                             std::uint32_t quality = kDefaultQuality);

  /// A copy with quality's number of candidates, everything else as it is. Throws InvalidArgument
  /// where quality is above 10.
  RegistrationOptions with_quality(std::uint32_t quality) const;

  /// The paper's algorithm with the paper's numbers (Zhang and Chen, LoopSmart, section III):
  /// 4,000,000 quadruples, no refinement.
  static RegistrationOptions loopsmart();

  /// The paper's algorithm with its lengths scaled to another voxel size (the paper's own is 0.05).
  static RegistrationOptions loopsmart(float voxel_size);

  /// Throws InvalidArgument naming the first field that is out of range, and its value.
  void validate() const;
};

}  // namespace gpureg
