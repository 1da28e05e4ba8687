// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "gpureg/loop_consistency.hpp"
#include "gpureg/pose_graph.hpp"
#include "gpureg/registration.hpp"

/// A map of scans as a plain value, and the options of its making.
namespace gpureg::reconstruction {

/// Noise of a registered pose, for the information matrices of the pose graph. A registration is
/// never more certain than this, however many points it aligns: their errors are correlated.
struct EdgeNoiseOptions {
  double translation = 0.6;  ///< standard deviation at the centre of the overlap, voxels, > 0
  double rotation = 0.7;     ///< standard deviation, degrees, > 0
  /// Standard deviation along a direction that the geometry does not hold at all, voxels, >=
  /// translation. Between the two, it grows with the root of the ratio of the information
  /// eigenvalues.
  double max_translation = 8;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Options of reconstruct() and reconstruct_from_poses(). Lengths are in voxels.
struct Options {
  /// Of the clouds, in the unit of the points: also of `consistency`. A call that has options of
  /// the registration takes theirs.
  float voxel_size = 0.05f;
  LoopConsistencyOptions consistency = {};
  EdgeNoiseOptions noise = {};
  /// Noise of odometry without an information matrix.
  pose_graph::DriftOptions drift = {};
  /// Length in which PoseEvidence::information_eigenvalues count rotations, > 0.
  double information_unit = 20;
  /// Confidence, after loop consistency, from which a pair takes part, (0, 1].
  double min_edge_confidence = 0.1;
  /// Probability from which the connection between two parts of the map counts, (0, 1]: that one of
  /// the accepted edges between them is correct, in view of the rejected ones. Edges that share a
  /// scan count once, unless that scan is one of the parts.
  double min_connection_confidence = 0.9;
  std::uint32_t modes = 4;       ///< number of modes of a pair that take part, 1..16
  std::uint32_t min_island = 2;  ///< scans of an island, >= 2; smaller ones are left out
  int threads = 0;               ///< 0: one per core. Results do not depend on it.

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Why a scan is left out.
enum class ScanReason {
  none,               ///< placed
  odometry_only,      ///< placed by odometry; no accepted edge confirms it
  not_tried,          ///< no pair of the scan was aligned
  too_few_points,     ///< every alignment found too few points in the scan
  no_confident_pair,  ///< no pair of the scan reaches min_edge_confidence
  contradicted,       ///< its pairs contradict those of other scans
  unconfirmed,        ///< its pairs do not reach min_connection_confidence together
  small_island        ///< the scans that it is connected to are fewer than min_island
};
const char* to_string(ScanReason reason);  ///< "not_tried", ...
/// The reason as one sentence for people.
const char* describe(ScanReason reason);

/// Why an edge is rejected.
enum class EdgeReason {
  none,          ///< accepted
  inconsistent,  ///< contradicts the map that the other edges make
  unconfirmed    ///< the only connections between two parts, and not confident enough together
};
const char* to_string(EdgeReason reason);
/// The reason as one sentence for people.
const char* describe(EdgeReason reason);

/// A relative pose of two scans that is trusted: of wheels, a tracker or scan matching.
struct Odometry {
  std::uint32_t source = 0, target = 0;  ///< scans
  /// p_target = target_from_source * p_source, metres.
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  /// As pose_graph::Edge::information. None: Options::drift.
  std::optional<pose_graph::UnalignedMatrix6d> information = std::nullopt;
  /// Probability that the pose is correct up to its noise, (0, 1]: enters Scan::confidence only.
  double confidence = 0.99;
};

/// Odometry between consecutive scans of those whose pose is known.
/// @param world_from_scan one per scan; not finite: not known.
std::vector<Odometry> odometry_of_poses(const std::vector<UnalignedIsometry3d>& world_from_scan);

/// One scan of the map.
struct Scan {
  bool placed = false;
  /// Index into Reconstruction::islands if placed.
  std::uint32_t island = 0;
  /// Product of the confidences along the most confident path of accepted edges from the best
  /// connected scan of the island, [0, 1]: a lower bound, as other paths confirm it. Of a scan that
  /// is left out, the largest confidence of its pairs.
  double confidence = 0;
  ScanReason reason = ScanReason::not_tried;
  /// p_island = island_from_scan * p_scan, metres; NaN if the scan is left out. The smallest
  /// scan of an island has the identity.
  UnalignedIsometry3d island_from_scan = no_pose();
};

/// One pair that took part in the pose graph.
struct Edge {
  std::uint32_t source = 0, target = 0;  ///< scans
  std::size_t pair = 0;                  ///< index into the pairs given
  std::uint32_t mode = 0;                ///< index into RegistrationResult::modes
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  /// Centre of the overlap in the source's frame; the origin if it is not known.
  Eigen::Vector3d overlap_centre = Eigen::Vector3d::Zero();
  /// Covariance of the overlap's points in the source's frame, metres^2; 0 if it is not known.
  Eigen::Matrix<double, 3, 3, Eigen::DontAlign> overlap_spread =
      Eigen::Matrix<double, 3, 3, Eigen::DontAlign>::Zero();
  double confidence = 0;       ///< of this mode, after loop consistency
  double pair_confidence = 0;  ///< of this mode, by the pair alone
  /// Of this mode, in view of the finished map and its audit: reconstruct(). Of
  /// reconstruct_from_poses(), confidence.
  double map_confidence = 0;
  double weight = 0;  ///< in the pose graph, [0, 1]
  bool accepted = false;
  EdgeReason reason = EdgeReason::inconsistent;
  /// As pose_graph::Edge::information.
  pose_graph::UnalignedMatrix6d information = pose_graph::UnalignedMatrix6d::Identity();
};

/// Scans that accepted edges connect; ascending.
struct Island {
  std::vector<std::uint32_t> scans;
};

/// How far the pairs of a set agree, before connections that are too weak are cut.
struct Agreement {
  /// Of the evidence of all edges, -log(1 - pair_confidence), the share of edges that contradict
  /// the others.
  double contradicted = 0;
  double edges_per_scan = 0;  ///< edges that agree, for each scan that has an edge
  /// Share of the steps between scans of consecutive numbers that are longer than steps of
  /// confident pairs; 0 where the numbers are not known to follow a path. Of reconstruct() alone.
  double jumps = 0;
};

/// A map: a plain value.
struct Reconstruction {
  pose_graph::Status status = pose_graph::Status::no_nodes;  ///< of the last optimisation
  Agreement agreement;                                       ///< of the pairs
  std::vector<Scan> scans;                                   ///< in their order
  std::vector<Edge> edges;                                   ///< in the order of the pairs
  std::vector<Island> islands;  ///< the largest first, then by smallest scan
  /// As given, each with its information matrix.
  std::vector<Odometry> odometry;

  std::size_t placed() const;  ///< number of placed scans
};

/// A map of poses that are known, without edges: of another program, or of files.
/// @param island_from_scan one per scan, in the frame of its island; not finite: left out.
/// @param islands of each scan, counted from 0; empty: all are of one.
/// @throws InvalidArgument if islands are neither none nor one per scan, or out of range.
Reconstruction map_of_poses(const std::vector<UnalignedIsometry3d>& island_from_scan,
                            const std::vector<std::uint32_t>& islands = {});

}  // namespace gpureg::reconstruction
