// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gpureg/context.hpp"
#include "gpureg/pose_graph.hpp"
#include "gpureg/prepared_cloud.hpp"
#include "gpureg/prior.hpp"
#include "gpureg/reconstruction.hpp"
#include "gpureg/registration.hpp"

/// Component `loop_closure`: loops for a SLAM system that tracks by itself.
namespace gpureg::loop_closure {

using FragmentId = std::int64_t;
using pose_graph::UnalignedMatrix6d;

/// A piece of the map: the points of a few seconds in one frame.
struct Fragment {
  FragmentId id = 0;         ///< unique among the fragments present; any value
  std::int64_t session = 0;  ///< fragments of one session share a world
  double time = 0;           ///< seconds; any origin
  /// Of the closer's context and voxel size, with a point or more. An empty handle is a node of the
  /// graph that is never proposed.
  PreparedCloud cloud = {};
  /// p_world = world_from_fragment * p_fragment, metres; none: not known. As long as the host adds
  /// no odometry between fragments of a session, their poses are its odometry: the motion from one
  /// to the next counts as an add_odometry() without covariance. If odometry connects the
  /// fragment to others, their estimates and the odometry replace the pose.
  std::optional<UnalignedIsometry3d> world_from_fragment = std::nullopt;
  /// Up in the fragment's frame, of any length but 0. Registrations of two fragments that both have
  /// it keep gravity.
  std::optional<Eigen::Vector3d> up = std::nullopt;
};

/// Which pairs of fragments are registered without being asked for. Lengths are in voxels.
struct ProposalOptions {
  /// Edge of the coarse voxels that say what a fragment observed, > 0.
  double coarse_voxel_size = 10;
  /// Smallest expected overlap: the share of the coarse voxels of one fragment that the other
  /// observed, within the uncertainty of their relative pose, (0, 1].
  double min_overlap = 0.2;
  /// Largest distance by which the uncertainty may widen the search, >= 0.
  double max_dilation = 60;
  /// Pairs whose relative pose the graph knows better than this are not proposed: standard
  /// deviation of the translation, >= 0.
  double min_uncertainty = 0.6;
  /// Pairs of one session closer in time are not proposed, seconds, >= 0.
  double min_time = 0;
  std::uint32_t per_fragment = 6;          ///< with earlier fragments of its frame
  std::uint32_t between_frames = 6;        ///< with fragments that nothing connects it to
  std::uint32_t confirming_candidate = 4;  ///< that would confirm or refute one candidate

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// When a loop is accepted.
struct AcceptanceOptions {
  /// Registered poses below take no part, (0, 1).
  double min_confidence = 0.1;
  /// Confidence from which one loop within the drift of odometry suffices, (0, 1].
  double alone = 0.9;
  /// Least confidence of a loop that others confirm, [0, 1].
  double confirmed = 0.5;
  /// Probability that one of several independent loops that agree is correct, in view of those that
  /// contradict them, from which they suffice, (0, 1].
  double together = 0.9;
  /// The same between sessions, or parts of one, that odometry does not connect; never by one loop.
  double between_frames = 0.98;
  /// Two fragments of one frame with a larger overlap are at one place: loops between frames that
  /// compare one place with one other do not confirm each other, because places that look alike do
  /// so from everywhere. [0, 1]; 1: only a fragment itself is at its place.
  double same_place_overlap = 0.5;
  /// Quantile of the misclosure under odometry's uncertainty within which a loop may stand alone,
  /// (0, 1).
  double drift_probability = 0.99;
  /// Largest Loop::drift_ratio at which a loop may be accepted at all, if others confirm it, >= 1:
  /// the factor by which odometry may be worse than Options::graph.drift.
  double max_drift_ratio = 6;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Options of a LoopCloser. Lengths are in voxels of the registration, but for those of `graph`.
struct Options {
  RegistrationOptions registration = {};  ///< with the voxel size of the fragments
  ProposalOptions proposals = {};
  AcceptanceOptions acceptance = {};
  reconstruction::EdgeNoiseOptions noise = {};  ///< of registered poses
  /// Of loops of the host without information, in place of graph.loop_noise.
  pose_graph::LoopNoiseOptions host_noise = {1, 1};
  /// Length in which PoseEvidence::information_eigenvalues count rotations, > 0.
  double information_unit = 20;
  /// Graph optimisation: robust kernel, drift of odometry without covariance. By the drift pairs
  /// are proposed and loops verified. The poses start from it: the accepted loops show how noisy
  /// odometry and loops are.
  pose_graph::Options graph = {};
  /// Distance over which errors of odometry without covariance have one sign, >= 0: biases
  /// make drift grow faster than independent errors would. 0: independent errors.
  double drift_correlation = 200;
  /// Standard deviation of Fragment::up in the graph, degrees in (1e-6, 180]; 0: not used in the
  /// graph, and the world need not be z-up.
  double gravity_sigma = 0;
  std::uint32_t modes = 4;  ///< poses of a pair that compete in the graph, 1..16
  std::uint32_t chunk = 4;  ///< registrations between two looks at the clock, >= 1
  /// false: poses are left to the host (Update::poses is empty); states of loops are the same.
  bool optimize = true;

  /// Verification by the constants of LoopSmart: pose_graph::Options::loopsmart(), information of
  /// loops from their correspondences, one mode per pair, no rule but the line process. See there
  /// for the drift that it tolerates.
  static Options loopsmart(float voxel_size = 0.05f);

  /// true: Loop::information is the sum of G'G over correspondences (LoopSmart's equation of f);
  /// false: from `noise`.
  bool information_from_correspondences = false;
  /// true: a loop that the graph accepts is accepted; `acceptance` is not asked.
  bool accept_by_graph_alone = false;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

enum class LoopState {
  candidate,  ///< registered, not yet accepted: it moves nothing
  accepted,   ///< takes part in the graph
  rejected,   ///< does not take part
  retracted   ///< was accepted, does not take part any more: take the factor out again
};

enum class LoopReason {
  confident,          ///< accepted: confident, and odometry's drift explains it
  confirmed,          ///< accepted: independent loops agree
  by_graph,           ///< accepted: Options::accept_by_graph_alone
  unconfirmed,        ///< candidate: neither confident enough nor confirmed
  exceeds_drift,      ///< candidate: farther from odometry than drift explains
  not_aligned,        ///< rejected: no pose of the pair reaches min_confidence
  inconsistent,       ///< rejected or retracted: contradicts odometry and other loops
  lost_confirmation,  ///< retracted: the loops that confirmed it are gone
  replaced            ///< retracted: accepted with another pose, which follows
};

const char* to_string(LoopState state);    ///< "candidate", ...
const char* to_string(LoopReason reason);  ///< "confident", ...
const char* describe(LoopReason reason);   ///< one sentence for people

/// A loop of two fragments.
///
/// For GTSAM: BetweenFactorPose3(target, source, Pose3(target_from_source),
/// noiseModel.Gaussian.Information(information)). Both have the rotation first, then the
/// translation, and perturb the source from the right.
struct Loop {
  FragmentId source = 0, target = 0;
  bool from_host = false;  ///< by add_loop()
  LoopState state = LoopState::candidate;
  LoopReason reason = LoopReason::unconfirmed;
  /// p_target = target_from_source * p_source, metres; NaN if the pair was not aligned.
  UnalignedIsometry3d target_from_source = no_pose();
  /// Inverse covariance of Log(target_from_source^-1 * true target_from_source): rotation (radians)
  /// first, then translation (metres), in the source's frame.
  UnalignedMatrix6d information = UnalignedMatrix6d::Zero();
  double confidence = 0;  ///< of the registration, or as the host gave it
  double weight = 0;      ///< in the graph, [0, 1]
  /// Distance between odometry and the loop in units of odometry's drift: 1 is the boundary of
  /// AcceptanceOptions::drift_probability. Infinity if odometry does not connect the fragments.
  double drift_ratio = 0;
};

/// Where a fragment is.
struct FragmentPose {
  FragmentId id = 0;
  UnalignedIsometry3d world_from_fragment = UnalignedIsometry3d::Identity();
  /// Smallest id of the fragments that odometry and accepted loops connect with this one. Poses of
  /// different frames have nothing to do with each other.
  FragmentId frame = 0;
};

/// Limits of one process().
struct ProcessLimits {
  /// Wall time; none: until nothing is left to do. A limit makes the number of registrations, and
  /// with it the result, depend on the clock.
  std::optional<double> milliseconds = std::nullopt;
  /// Number of registrations; the result does not depend on the clock.
  std::optional<std::size_t> registrations = std::nullopt;
  /// Polled between chunks, while the graph is optimised and before the Update is made; true ends
  /// the call. A verification that it ends decides nothing (Update::status is cancelled), and the
  /// next call begins with it. What it throws ends the call without an Update; the next one has all
  /// changes. May be empty.
  std::function<bool()> should_stop = nullptr;
};

/// What one process() did.
struct Update {
  /// Each loop once per change of its state, in a fixed order. An accepted loop whose pose changes
  /// is retracted with the old one (LoopReason::replaced) and accepted with the new one, in this
  /// order. A host that adds a factor for each accepted loop and takes it out for each retracted
  /// one never has two. What a call that threw did not deliver, the next one does.
  std::vector<Loop> changed;
  /// All fragments, ascending by id; empty if no pose changed and with Options::optimize off.
  std::vector<FragmentPose> poses;
  std::size_t registered = 0;      ///< registrations of this call
  std::size_t proposals_left = 0;  ///< registrations that the limits left for later calls
  /// Of the optimisation, converged if none was necessary.
  pose_graph::Status status = pose_graph::Status::converged;
  std::string reason;  ///< one sentence if not converged
};

/// Gives a prepared cloud back to load().
using CloudProvider = std::function<PreparedCloud(FragmentId)>;

/// Finds, verifies and, if wanted, optimises the loops of a SLAM system.
///
/// The host adds fragments and odometry; process() registers pairs and returns loops. Owns no
/// thread. The same calls give the same bits for any number of threads and on every backend, as
/// long as ProcessLimits has no clock.
///
/// Thread-safe. Every function but process(), save() and load() returns at once, also while another
/// thread is in process(): what it adds takes effect in the next process().
///
/// A function that throws changes nothing. Coordinates are up to 1e9 metres; variances and
/// information are from 1e-18 to 1e18.
class LoopCloser {
 public:
  /// @throws InvalidArgument as Options::validate().
  explicit LoopCloser(const Context& context, const Options& options = {});
  ~LoopCloser();
  LoopCloser(LoopCloser&&) noexcept;
  LoopCloser& operator=(LoopCloser&&) noexcept;

  /// @throws InvalidArgument for an id that is present, a pose that is not rigid, a time that is
  ///   not finite, an up whose length is not within 1e-6 to 1e9, a cloud without points or of
  ///   another voxel size than Options::registration.
  void add(const Fragment& fragment);

  /// Relative pose by tracking: p_target = target_from_source * p_source.
  /// @param covariance of Log(target_from_source^-1 * truth): rotation (radians) first, then
  ///   translation (metres), in the source's frame. None: Options::graph.drift.
  /// @throws InvalidArgument for an unknown id, a fragment with itself, a repeated pair, a pose
  /// that
  ///   is not rigid, a covariance that is not finite, symmetric and positive definite.
  void add_odometry(FragmentId source, FragmentId target,
                    const UnalignedIsometry3d& target_from_source,
                    const std::optional<UnalignedMatrix6d>& covariance = std::nullopt);

  /// Tracking has closed the pairs of `id` with `others` already: they are not proposed.
  /// @throws InvalidArgument for an unknown id.
  void set_covisible(FragmentId id, const std::vector<FragmentId>& others);

  /// Registers a pair at the next process(), before all others: the host's place recognition.
  /// @param prior in addition to the gravity of both fragments.
  /// @throws InvalidArgument for an unknown id, a fragment with itself or without cloud, a prior
  /// out
  ///   of range.
  void propose(FragmentId source, FragmentId target,
               const std::optional<RegistrationPrior>& prior = std::nullopt);

  /// A loop that the host found: images, GNSS, tags.
  /// @param information as Loop::information; none: Options::host_noise.
  /// @param confidence prior probability that it is correct, [0, 1].
  /// @throws InvalidArgument as add_odometry(), and for a confidence outside [0, 1].
  void add_loop(FragmentId source, FragmentId target, const UnalignedIsometry3d& target_from_source,
                const std::optional<UnalignedMatrix6d>& information = std::nullopt,
                double confidence = 0.5);

  /// The result of an align() that the host ran itself: all its modes compete. The pair is not
  /// registered again.
  /// @throws InvalidArgument for an unknown id, a fragment with itself, a pose that is not rigid, a
  ///   confidence outside [0, 1], evidence that gives no information matrix.
  void add_result(FragmentId source, FragmentId target, const RegistrationResult& result);

  /// Poses after an optimisation of the host. They replace the estimates, for the proposals and as
  /// the start of the next optimisation.
  /// @throws InvalidArgument for an unknown or repeated id and a pose that is not rigid; then none
  ///   is taken.
  void set_poses(const std::vector<FragmentPose>& poses);

  /// Forgets a fragment: its cloud is freed, its edges are marginalised onto its neighbours. Its id
  /// may be used again.
  /// @throws InvalidArgument for an unknown id.
  void remove(FragmentId id);

  /// Registers what is due, verifies the loops, optimises.
  /// @throws DeviceError if the device fails, std::bad_alloc without memory. Nothing is lost:
  ///   the next call goes on, and ends in the same state.
  Update process(const ProcessLimits& limits = {});
  Update process(double milliseconds);  ///< process() with a time limit

  /// As of the last process().
  std::vector<FragmentPose> poses() const;
  std::vector<Loop> loops() const;  ///< every loop of fragments present, in a fixed order
  std::size_t size() const;         ///< number of fragments, those just added too

  /// The graph of the accepted loops, as of the last process(), for a solver of the host. With the
  /// noise that Options state; that of poses() is what the loops show of it.
  pose_graph::Graph graph() const;

  /// Writes the whole state but the clouds and the options. Waits for a running process(). The file
  /// is written completely or not at all.
  /// @throws IoError naming the file.
  void save(const std::string& path) const;

  /// Replaces the state by a saved one. Then the same calls give the same bits as without saving.
  /// @param clouds called once for each fragment that had a cloud; must return the same cloud.
  /// @throws IoError naming the file if it is missing, damaged or from a later version;
  ///   InvalidArgument naming both voxel sizes if they differ, or the fragment whose cloud does.
  ///   Then the state stays as it was.
  void load(const std::string& path, const CloudProvider& clouds);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gpureg::loop_closure
