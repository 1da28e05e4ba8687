// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <unordered_map>
#include <vector>

#include "gpureg/loop_consistency.hpp"
#include "gpureg/pose_graph.hpp"
#include "gpureg/registration.hpp"

/// Component `reconstruction`: from registered pairs of unordered scans to one map. Every function
/// is deterministic and thread-safe.
namespace gpureg::reconstruction {

/// Noise of a registered pose, for the information matrices of the pose graph. A registration is
/// never more certain than this, however many points it aligns: their errors are correlated.
struct EdgeNoiseOptions {
  double translation = 0.03;  ///< standard deviation at the centre of the overlap, metres, > 0
  double rotation = 0.7;      ///< standard deviation, degrees, > 0
  /// Standard deviation along a direction that the geometry does not hold at all, metres, >=
  /// translation. Between the two, it grows with the root of the ratio of the information
  /// eigenvalues.
  double max_translation = 0.4;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Options of reconstruct(). The lengths are for voxels of 5 cm.
struct Options {
  LoopConsistencyOptions consistency;
  EdgeNoiseOptions noise;
  /// Noise of odometry without an information matrix.
  pose_graph::DriftOptions drift;
  /// Length in which PoseEvidence::information_eigenvalues count rotations, metres, > 0: twenty
  /// voxels.
  double information_unit = 1.0;
  /// Confidence, after loop consistency, from which a pair takes part, (0, 1].
  double min_edge_confidence = 0.1;
  /// Probability from which the connection between two parts of the map counts, (0, 1]: that one of
  /// the accepted edges between them is correct, in view of the rejected ones. Edges that share a
  /// scan count once, unless that scan is one of the parts.
  double min_connection_confidence = 0.9;
  std::uint32_t modes = 4;       ///< number of modes of a pair that take part, 1..16
  std::uint32_t min_island = 2;  ///< scans of an island, >= 2; smaller ones are left out
  int threads = 0;               ///< 0: one per core. Results do not depend on it.

  /// Every length from the voxel size of the registration.
  /// @throws InvalidArgument unless voxel_size is finite and > 0.
  static Options from_voxel_size(float voxel_size);

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
  /// Index into Reconstruction::islands where placed.
  std::uint32_t island = 0;
  /// Product of the confidences along the most confident path of accepted edges from the best
  /// connected scan of the island, [0, 1]: a lower bound, as other paths confirm it. Of a scan that
  /// is left out, the largest confidence of its pairs.
  double confidence = 0;
  ScanReason reason = ScanReason::not_tried;
  /// p_island = island_from_scan * p_scan, metres; NaN where the scan is left out. The smallest
  /// scan of an island has the identity.
  UnalignedIsometry3d island_from_scan = no_pose();
};

/// One pair that took part in the pose graph.
struct Edge {
  std::uint32_t source = 0, target = 0;  ///< scans
  std::size_t pair = 0;                  ///< index into the pairs given
  std::uint32_t mode = 0;                ///< index into RegistrationResult::modes
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  /// Centre of the overlap in the source's frame; the origin where it is not known.
  Eigen::Vector3d overlap_centre = Eigen::Vector3d::Zero();
  /// Covariance of the overlap's points in the source's frame, metres^2; 0 where it is not known.
  Eigen::Matrix<double, 3, 3, Eigen::DontAlign> overlap_spread =
      Eigen::Matrix<double, 3, 3, Eigen::DontAlign>::Zero();
  double confidence = 0;       ///< of this mode, after loop consistency
  double pair_confidence = 0;  ///< of this mode, by the pair alone
  /// Of this mode, in view of the finished map and its audit: reconstruct_audited(). Of
  /// reconstruct(), confidence.
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

/// A map: a plain value.
struct Reconstruction {
  pose_graph::Status status = pose_graph::Status::no_nodes;  ///< of the last optimisation
  std::vector<Scan> scans;                                   ///< in their order
  std::vector<Edge> edges;                                   ///< in the order of the pairs
  std::vector<Island> islands;  ///< the largest first, then by smallest scan
  /// As given, each with its information matrix.
  std::vector<Odometry> odometry;

  std::size_t placed() const;  ///< number of placed scans
};

/// Places scans by the results of their pairs: loop consistency, a pose graph over the modes of
/// each pair with graduated non-convexity, islands.
///
/// @param scans number of scans.
/// @param pairs indices below scans, as for align_batch().
/// @param results results[k] belongs to pairs[k], as align_batch() returns them.
/// @param odometry relative poses that are known. They connect scans whatever the pairs say; pairs
///   that contradict them by more than their drift are rejected.
/// @return the map. Scans that cannot be placed are no error. Independent of the number of threads.
/// @throws InvalidArgument for options out of range, an index out of range, a pair of a scan with
///   itself, a repeated pair, as loop_consistency(), and as pose_graph::Graph::validate().
Reconstruction reconstruct(std::size_t scans, const std::vector<Pair>& pairs,
                           const std::vector<RegistrationResult>& results,
                           const Options& options = {}, const std::vector<Odometry>& odometry = {});

/// The inverse of CorrespondenceMoments::information_redwood(), for results that were read from a
/// file.
CorrespondenceMoments moments_of_information(const Eigen::Matrix<double, 6, 6>& redwood);

/// The placed scans with their poses, the odometry between them, and the accepted edges. Node ids
/// are indices of scans, or `ids` of them where given.
/// @throws InvalidArgument where ids are neither none nor one per scan.
pose_graph::Graph graph_of(const Reconstruction& map, const std::vector<std::int64_t>& ids = {});

/// A place where an island would fall into two parts if fewer edges were correct.
struct Link {
  std::vector<std::uint32_t> scans;  ///< the smaller part, ascending
  /// Probability that one of the accepted edges between the parts is correct, in view of the
  /// rejected ones.
  double confidence = 0;
  std::size_t accepted = 0, rejected = 0;  ///< edges between the parts
};

/// The connections along the most confident spanning tree of each island: where a map is weakest.
/// Odometry counts as accepted edges of its confidence.
/// @return scans - 1 links for each island, in the order of the islands; within one, by the first
///   scan of the part that the tree's root is not in.
std::vector<Link> weakest_links(const Reconstruction& map);

/// Points of a scan with their normals, in the scan's frame.
struct Surface {
  std::vector<Eigen::Vector3f> points;
  std::vector<Eigen::Vector3f> normals;  ///< one per point, unit length; (0,0,0): not used
  /// Sensor positions in the scan's frame, for RefineOptions::noise_range; may be empty.
  std::vector<Eigen::Vector3f> viewpoints = {};
};

/// Options of prepare() for the points of a Surface: half the voxel size, and nothing that only
/// registration needs.
PrepareOptions surface_options(PrepareOptions registration);

/// The points of a cloud that prepare() made with surface_options(), and its viewpoints if the
/// caller gave them.
Surface surface_of(const PreparedCloud& cloud);

/// The same from a raw cloud. Features of the cloud are not used, and none are computed.
/// @param registration options of the registration of the pairs.
/// @throws InvalidArgument as prepare().
Surface surface_of(const Context& context, PointCloudView cloud,
                   const PrepareOptions& registration);

/// Options of refine(). The lengths are for voxels of 5 cm.
struct RefineOptions {
  /// Largest distance of a correspondence in the first iterations, metres, > 0.
  double initial_distance = 0.15;
  double final_distance = 0.05;  ///< the same in the last ones, metres, > 0, <= initial_distance
  double max_normal_angle = 45;  ///< degrees between the normals of a correspondence, (0, 90]
  /// Width of the Geman-McClure kernel on the point-to-plane distance in the last iterations,
  /// metres, > 0; it shrinks with the distance.
  double kernel_width = 0.02;
  int iterations = 10;  ///< >= 1
  /// RMS distance between the measured and the refined pose over the overlap from which an edge is
  /// rejected in the end, metres, > 0; edges that alone connect two parts stay.
  double max_edge_error = 0.2;
  /// Points of a scan that look for correspondences in one other scan, evenly chosen, >= 16.
  std::uint32_t max_points = 1500;
  /// Points within initial_distance of the other scan from which two scans overlap, >= 1.
  std::uint32_t min_overlap = 100;
  /// Standard deviation of a point-to-plane distance, metres, > 0, and the number of neighbouring
  /// points whose errors count as one, >= 1: how much surfaces weigh beside the edges.
  double point_noise = 0.01;
  double correlated_points = 20;
  /// Range from which the noise of a point grows with the square of its distance to the closest
  /// viewpoint, as that of depth cameras, metres, > 0; infinity: it does not grow.
  double noise_range = std::numeric_limits<double>::infinity();
  int threads = 0;  ///< 0: one per core. Results do not depend on it.
  /// Called before every iteration with its number; true ends the refinement. May be empty.
  std::function<bool(int)> should_stop;

  /// Every length from the voxel size of the registration.
  /// @throws InvalidArgument unless voxel_size is finite and > 0.
  static RefineOptions from_voxel_size(float voxel_size);

  /// The same for depth cameras: noise_range is thirty voxels.
  static RefineOptions for_depth_cameras(float voxel_size);

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Figures of refine().
struct RefineReport {
  std::size_t pairs = 0;            ///< overlapping pairs in the last iteration
  std::size_t correspondences = 0;  ///< in the last iteration
  /// RMS point-to-plane distance of correspondences within final_distance, metres.
  double initial_rmse = 0, final_rmse = 0;
  int iterations = 0;
  std::size_t rejected_edges = 0;  ///< by max_edge_error
  bool solved = true;  ///< false: a linear system could not be solved; poses stay as they were
};

/// Refines all poses of a map together: point-to-plane distances over every overlapping pair of
/// scans of an island, also of pairs that no edge connects, beside the accepted edges and the
/// odometry. Sparse normal equations over all poses; the smallest scan of each island stays.
///
/// @param context finds the correspondences and adds them up, options.threads solve for the poses.
///   The bits of the poses depend on neither.
/// @param surfaces one per scan; those of scans that are left out may be empty.
/// @param map poses are replaced.
/// @throws InvalidArgument for options out of range, another number of surfaces than scans, and a
///   surface whose points and normals differ in number.
/// @throws DeviceError where the device has no memory left; the map stays as it was.
/// Sources: Chen and Medioni 1992 (point-to-plane); Neugebauer 1997 (all scans together).
RefineReport refine(const Context& context, const std::vector<Surface>& surfaces,
                    Reconstruction& map, const RefineOptions& options = {});

/// The same on a CPU context of options.threads.
RefineReport refine(const std::vector<Surface>& surfaces, Reconstruction& map,
                    const RefineOptions& options = {});

/// Averages the points of scans per voxel, one scan at a time: memory grows with the surface of the
/// map, not with the number of points. Not thread-safe.
class VoxelMap {
 public:
  /// @throws InvalidArgument unless voxel_size is finite and > 0.
  explicit VoxelMap(float voxel_size);

  /// Adds the finite points of a scan, moved by map_from_scan; normals where the view has them.
  /// @throws InvalidArgument as PointCloudView::validate(), and for a pose that is not finite.
  void add(const PointCloudView& scan, const UnalignedIsometry3d& map_from_scan);

  std::size_t size() const { return cells_.size(); }  ///< number of voxels

  /// @return the mean of each voxel, ordered by voxel, with mean normals where any scan had some
  ///   ((0,0,0) where they cancel out). The order of the scans changes rounding only.
  PointCloud cloud() const;

 private:
  struct Cell {
    Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
    std::uint64_t count = 0;
  };
  struct Key {
    std::int64_t x, y, z;
    bool operator==(const Key& o) const { return x == o.x && y == o.y && z == o.z; }
    bool operator<(const Key& o) const { return x != o.x ? x < o.x : y != o.y ? y < o.y : z < o.z; }
  };
  struct Hash {
    std::size_t operator()(const Key& key) const;
  };

  double voxel_size_;
  bool has_normals_ = false;
  std::unordered_map<Key, Cell, Hash> cells_;
};

}  // namespace gpureg::reconstruction
