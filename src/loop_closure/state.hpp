// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <set>
#include <type_traits>
#include <utility>
#include <vector>

#include "gpureg/loop_closure.hpp"
#include "loop_closure/coarse.hpp"
#include "pose_graph/uncertain_pose.hpp"

/// Everything that process() works on. Only the thread in process(), save() or load() sees it.
namespace gpureg::loop_closure {

using pose_graph::Matrix6d;
using pose_graph::UncertainPose;
using pose_graph::Vector6d;
using FragmentPair = std::pair<FragmentId, FragmentId>;  ///< the smaller id first

struct Node {
  std::int64_t session = 0;
  double time = 0;
  PreparedCloud cloud;
  bool has_cloud = false;
  std::uint64_t fingerprint = 0;
  std::optional<Eigen::Vector3d> up;
  UnalignedIsometry3d estimate = UnalignedIsometry3d::Identity();
  std::optional<UnalignedIsometry3d> given;  ///< Fragment::world_from_fragment
  std::shared_ptr<const Coarse> observed;    ///< of the cloud; empty without one
  std::uint64_t order = 0;                   ///< of arrival
  /// Proposals made so far; later fragments propose earlier ones.
  std::uint32_t within_frame = 0, between_frames = 0;
  bool placed = false;       ///< odometry connects it
  bool look_within = true;   ///< proposals within the frame are due
  bool look_between = true;  ///< proposals to other frames are due
  bool look_back = true;     ///< it may be due an edge from its pose and the last one's

  /// What it observed: nothing without a cloud.
  const Coarse& coarse() const;
};

struct Odometry {
  FragmentId source = 0, target = 0;
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  UnalignedMatrix6d information = UnalignedMatrix6d::Identity();
  /// true: the information is that of Options::graph.drift for an edge alone. Errors of such edges
  /// have one sign over Options::drift_correlation.
  bool modelled = false;
  double length = 0;        ///< metres travelled
  std::uint32_t steps = 1;  ///< edges of the host that it is made of
  bool implied = false;     ///< from the poses that were given with the fragments
};

/// One pose of a loop.
struct Mode {
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  UnalignedMatrix6d information = UnalignedMatrix6d::Identity();
  double confidence = 0.5;
  double drift_ratio = 0;  ///< Loop::drift_ratio
};

struct LoopRecord {
  Loop loop;  ///< as reported
  /// Ends of the edge: after a fragment was removed, of a neighbour of it.
  FragmentId source = 0, target = 0;
  std::vector<Mode> modes;       ///< none: not aligned
  std::uint32_t mode = 0;        ///< that takes part, or would
  std::optional<Loop> reported;  ///< what the host knows
  std::uint64_t number = 0;      ///< of arrival
  /// Of one mode among all loops, for State::relations.
  std::uint64_t key(std::uint32_t m) const { return number * 16 + m; }
  bool gated = false;     ///< drift_ratio is computed
  bool expanded = false;  ///< proposals that would confirm it were made
};

/// What one mode of a loop says about one of another, by how much odometry drifts.
struct Relation {
  std::uint64_t other = 0;   ///< LoopRecord::key
  bool independent = false;  ///< no fragment in common
  bool confirms = false;     ///< hardly agrees by chance
  bool connected = false;    ///< by odometry, beside the loops
  /// Places in kDriftScales from which they agree, and below which they contradict each other.
  std::uint8_t agrees_from = 0, contradicts_below = 0;
};

/// Multiples of the drift in Options::graph.drift under which loops are compared.
inline constexpr double kDriftScales[] = {1, 1.5, 2, 3, 4, 6, 8};
inline constexpr std::uint8_t kDriftScaleCount = 7;

/// Proposals of a smaller value go first.
enum class ProposalKind : std::uint8_t { host, confirming, within_frame, between_frames };

struct Proposal {
  FragmentId source = 0, target = 0;
  ProposalKind kind = ProposalKind::host;
  double value = 0;                                ///< larger ones first
  std::uint64_t order = 0;                         ///< of host proposals
  std::shared_ptr<const RegistrationPrior> prior;  ///< may be empty
};

struct State {
  float voxel_size = 0;              ///< of the clouds, metres
  std::set<std::int64_t> connected;  ///< sessions between whose fragments the host added odometry
  std::map<FragmentId, Node> nodes;
  std::vector<Odometry> odometry;
  std::vector<LoopRecord> loops;
  std::vector<Proposal> queue;   ///< sorted, the first one last
  std::set<FragmentPair> known;  ///< registered, queued or co-visible: not proposed
  std::uint64_t arrivals = 0;    ///< fragments, loops and host proposals so far
  /// By LoopRecord::key. Follows from the rest: not saved.
  std::map<std::uint64_t, std::vector<Relation>> relations;
  bool graph_changed = false;  ///< loops, or odometry between loops, since the last optimisation
  bool poses_changed = false;  ///< since the last report
};

/// Runs work(State&) on a copy that then replaces the state. Where it throws, the state stays as it
/// was.
template <typename Work>
void on_copy(State& state, const Work& work) {
  static_assert(std::is_nothrow_move_assignable_v<State>);
  State next(state);
  work(next);
  state = std::move(next);
}

inline FragmentPair pair_of(FragmentId a, FragmentId b) {
  return a < b ? FragmentPair{a, b} : FragmentPair{b, a};
}

inline pose_graph::Pose to_pose(const UnalignedIsometry3d& t) {
  return {t.linear(), t.translation()};
}
UnalignedIsometry3d to_isometry(const pose_graph::Pose& pose);

/// A product of poses, kept within what pose graphs take: a host's rotations are orthonormal to
/// 1e-4 only, and long chains of them would leave that.
UnalignedIsometry3d rigid(UnalignedIsometry3d pose);

/// Standard deviation of a translation, metres, at a point of the frame that the covariance is in.
double sigma_at(const Matrix6d& covariance, const Eigen::Vector3d& point);

/// An edge without covariance: Options::graph.drift.
Odometry modelled_odometry(FragmentId source, FragmentId target,
                           const UnalignedIsometry3d& target_from_source, const Options& options);

/// Factor on the covariance of a path whose edges, taken as independent, have errors of one sign
/// over `correlation` metres.
double correlation_factor(double length, double steps, double correlation);

/// The loop as a host sees it, with the mode that takes part.
void choose_mode(LoopRecord& record, std::size_t mode);

}  // namespace gpureg::loop_closure
