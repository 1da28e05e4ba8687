// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "gpureg/error.hpp"
#include "gpureg/reconstruction/map.hpp"
#include "gpureg/verification.hpp"

/// Audit of finished maps: do scans that come to lie near each other agree, whether or not anybody
/// registered them? Every function is deterministic and thread-safe.
namespace gpureg::reconstruction {

/// AuditOptions::should_stop ended the call.
class Cancelled : public Error {
 public:
  using Error::Error;
};

/// Options of audit().
struct AuditOptions {
  /// ICP may move a pair by this many voxels of the registration before it contradicts its pose,
  /// > 0: what is left of the errors of a good map. Of larger voxels than 0.05 by the fourth root.
  double max_shift = 3;
  /// The same for each metre between the scans, >= 0: how far a map may bend.
  double max_shift_per_metre = 0.02;
  /// Probability, (0, 1), up to which a connection is contradicted.
  double max_contradicted = 0.1;
  /// Probability, (0, 1), from which a connection is confirmed.
  double min_confirmed = 0.9;
  /// Pairs of one scan that are looked at, 2 to 10000: the nearest half, others evenly chosen.
  std::uint32_t most_pairs = 40;
  /// Asked every tenth of a second, in the thread of the call; true ends the call, which throws
  /// Cancelled. May be empty.
  std::function<bool()> should_stop;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Whether two scans support or contradict their poses in a map.
enum class PairVerdict {
  silent,      ///< they hardly overlap, and neither stands in the other's view
  supports,    ///< their surfaces coincide
  contradicts  ///< one stands in the other's free space, or they coincide better elsewhere
};
const char* to_string(PairVerdict verdict);

/// Two scans that are near each other in a map.
struct AuditedPair {
  std::uint32_t source = 0, target = 0;  ///< scans
  PairVerdict verdict = PairVerdict::silent;
  /// log(p(evidence, correct pose) / p(evidence, wrong pose))
  double log_likelihood_ratio = 0;
  /// Of the map.
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  double overlap = 0;    ///< the larger share of points of one scan on the other's surfaces, [0, 1]
  double observed = 0;   ///< the larger share of points in the view of the other scan, [0, 1]
  double violation = 0;  ///< of these, the larger share that lies in free space, [0, 1]
  double shift = 0;      ///< RMS distance by which ICP moves the scans' overlap, metres
  /// The pose after ICP; without ICP, the pose of the map.
  UnalignedIsometry3d refined = UnalignedIsometry3d::Identity();
  Eigen::Vector3d overlap_centre = Eigen::Vector3d::Zero();  ///< in the source's frame, metres
  Eigen::Matrix3d overlap_spread = Eigen::Matrix3d::Zero();  ///< covariance of its points
};

enum class ConnectionVerdict {
  undecided,    ///< the two parts hardly see each other
  confirmed,    ///< scans of both parts agree
  contradicted  ///< scans of both parts contradict each other
};
const char* to_string(ConnectionVerdict verdict);

/// Two parts of a map and all pairs between them, which give one verdict. Pairs of one scan fail
/// together: every further one counts less. Pairs that ICP moves by one common motion contradict
/// the connection, too, however small the motion is.
struct AuditedConnection {
  /// The smaller part: `size` entries of Audit::order from `first` on; see Audit::scans_of().
  std::size_t first = 0, size = 0;
  std::uint32_t island = 0;  ///< index into Audit::islands
  ConnectionVerdict verdict = ConnectionVerdict::undecided;
  double confidence = 0.5;  ///< probability that the relative pose of the parts is correct
  std::size_t supporting = 0, contradicting = 0;  ///< pairs across it
  /// Indices of the pairs that contradict it, the strongest first.
  std::vector<std::size_t> contradictions;
};

/// The result of an audit for an island, or for a map.
enum class AuditVerdict {
  undecided,    ///< nothing is contradicted, but no more is confirmed than undecided
  sound,        ///< nothing is contradicted, and more connections are confirmed than undecided
  contradicted  ///< a connection is contradicted
};
const char* to_string(AuditVerdict verdict);

struct Audit {
  std::vector<AuditedPair> pairs;              ///< by source and target
  std::vector<AuditedConnection> connections;  ///< the least confident first
  std::vector<std::uint32_t> order;            ///< the scans that have a pose
  std::vector<Island> islands;                 ///< of the map, with the scans that have a pose

  /// Of each island. Undecided are those of poses in other units, or of other scans: they keep most
  /// scans out of each other's sight.
  std::vector<AuditVerdict> verdicts() const;
  /// Of the map: contradicted if an island is; sound if every island of two scans or more is.
  AuditVerdict verdict() const;
  /// The smaller part of a connection, ascending.
  std::vector<std::uint32_t> scans_of(const AuditedConnection& connection) const;
  std::size_t count(PairVerdict verdict) const;
  std::size_t count(ConnectionVerdict verdict) const;
};

/// Verifies every pair of scans that are near each other at their poses, and then the connections
/// along the best supported spanning trees.
///
/// @param clouds one per scan, with sensor positions if they are known: without, only surfaces
///   can contradict.
/// @param world_from_scan one per scan; not finite: the scan is left out.
/// @param registration as for align_batch().
/// @throws InvalidArgument for options out of range, another number of poses than clouds, a pose
///   that is no rigid motion (named); Cancelled; otherwise as verify_poses_batch().
Audit audit(const Context& context, const std::vector<PreparedCloud>& clouds,
            const std::vector<UnalignedIsometry3d>& world_from_scan,
            const RegistrationOptions& registration = {}, const AuditOptions& options = {});

/// The same for a map: scans of different islands are no pairs.
Audit audit(const Context& context, const std::vector<PreparedCloud>& clouds,
            const Reconstruction& map, const RegistrationOptions& registration = {},
            const AuditOptions& options = {});

}  // namespace gpureg::reconstruction
