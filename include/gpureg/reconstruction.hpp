// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <unordered_map>
#include <vector>

#include "gpureg/reconstruction/audit.hpp"
#include "gpureg/reconstruction/map.hpp"

/// Component `reconstruction`: from registered pairs of unordered scans to one map. Every function
/// is deterministic and thread-safe.
namespace gpureg::reconstruction {

/// A map and what its last audit says.
struct AuditedReconstruction {
  Reconstruction map;
  Audit audit;
  /// Pairs contradicted the map more than their confidences explain, or consecutive scans lay far
  /// apart in it. Then only pairs are trusted that keep scans of consecutive numbers beside each
  /// other; without such an order every pair counts by itself, and for less.
  bool places_look_alike = false;
};

/// Places scans by the results of their pairs: loop consistency, a pose graph over the modes of
/// each pair with graduated non-convexity, islands, and an audit. Edges across a connection that
/// the scans contradict are taken out and the graph is solved again, until nothing is contradicted.
/// Their reason is EdgeReason::inconsistent; that of pairs that are not trusted because places look
/// alike is EdgeReason::unconfirmed.
///
/// @param clouds as for audit(); without odometry, in the order of the sensor's path if there is
///   one.
/// @param pairs indices of clouds, as for align_batch().
/// @param results results[k] belongs to pairs[k], as align_batch() returns them.
/// @param odometry relative poses that are known. They connect scans whatever the pairs say; pairs
///   that contradict them by more than their drift are rejected.
/// @param registration as for align_batch().
/// @return the map. Scans that cannot be placed are no error. Independent of the number of threads.
/// @throws InvalidArgument for options out of range, an index out of range, a pair of a scan with
///   itself, a repeated pair; as loop_consistency(), pose_graph::Graph::validate() and audit().
///   Cancelled.
AuditedReconstruction reconstruct(const Context& context, const std::vector<PreparedCloud>& clouds,
                                  const std::vector<Pair>& pairs,
                                  const std::vector<RegistrationResult>& results,
                                  const Options& options = {},
                                  const std::vector<Odometry>& odometry = {},
                                  const RegistrationOptions& registration = {},
                                  const AuditOptions& audit_options = {});

/// reconstruct() by the poses of the pairs alone: no cloud is seen and nothing is audited. If
/// places look alike, pairs with equal errors confirm each other, and the map is wrong: use it
/// if there are no clouds.
/// @param scans number of scans; the indices of the pairs are below it.
Reconstruction reconstruct_from_poses(std::size_t scans, const std::vector<Pair>& pairs,
                                      const std::vector<RegistrationResult>& results,
                                      const Options& options = {},
                                      const std::vector<Odometry>& odometry = {});

/// The placed scans with their poses, the odometry between them, and the accepted edges. Node ids
/// are indices of scans, or `ids` of them if given.
/// @throws InvalidArgument if ids are neither none nor one per scan.
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

/// Options of prepare() for the points of a Surface: half the voxel size with the other lengths as
/// they are, and nothing that only registration needs.
RegistrationOptions surface_options(RegistrationOptions registration);

/// The points of a cloud that prepare() made with surface_options(), and its viewpoints if the
/// caller gave them.
Surface surface_of(const PreparedCloud& cloud);

/// The same from a raw cloud. Features of the cloud are not used, and none are computed.
/// @param registration options of the registration of the pairs.
/// @throws InvalidArgument as prepare().
Surface surface_of(const Context& context, PointCloudView cloud,
                   const RegistrationOptions& registration);

/// Options of refine(). Lengths are in voxels.
struct RefineOptions {
  float voxel_size = 0.05f;  ///< of the registration, in the unit of the points
  /// Largest distance of a correspondence in the first iterations, > 0.
  double initial_distance = 3;
  double final_distance = 1;     ///< the same in the last ones, > 0, <= initial_distance
  double max_normal_angle = 45;  ///< degrees between the normals of a correspondence, (0, 90]
  /// Width of the Geman-McClure kernel on the point-to-plane distance in the last iterations,
  /// > 0; it shrinks with the distance.
  double kernel_width = 0.4;
  int iterations = 10;  ///< >= 1
  /// RMS distance between the measured and the refined pose over the overlap from which an edge is
  /// rejected in the end, > 0; edges that alone connect two parts stay.
  double max_edge_error = 4;
  /// Points of a scan that look for correspondences in one other scan, evenly chosen, >= 16.
  std::uint32_t max_points = 1500;
  /// Points within initial_distance of the other scan from which two scans overlap, >= 1.
  std::uint32_t min_overlap = 100;
  /// Standard deviation of a point-to-plane distance, > 0, and the number of neighbouring
  /// points whose errors count as one, >= 1: how much surfaces weigh beside the edges.
  double point_noise = 0.2;
  double correlated_points = 20;
  /// Range from which the noise of a point grows with the square of its distance to the closest
  /// viewpoint, as that of depth cameras, > 0; infinity: it does not grow.
  double noise_range = std::numeric_limits<double>::infinity();
  int threads = 0;  ///< 0: one per core. Results do not depend on it.
  /// Called before every iteration with its number; true ends the refinement. May be empty.
  std::function<bool(int)> should_stop = {};

  /// For depth cameras: noise_range is thirty voxels.
  static RefineOptions for_depth_cameras(float voxel_size = 0.05f);

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
/// @throws DeviceError if the device has no memory left; the map stays as it was.
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

  /// Adds the finite points of a scan, moved by map_from_scan; normals if the view has them.
  /// @throws InvalidArgument as PointCloudView::validate(), and for a pose that is not rigid.
  void add(const PointCloudView& scan, const UnalignedIsometry3d& map_from_scan);

  std::size_t size() const { return cells_.size(); }  ///< number of voxels

  /// @return the mean of each voxel, ordered by voxel, with mean normals if any scan had some
  ///   ((0,0,0) if they cancel out). The order of the scans changes rounding only.
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
