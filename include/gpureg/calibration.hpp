// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "gpureg/registration.hpp"

/// Scale of the confidence for one sensor, from its clouds alone: no truth is needed.
namespace gpureg {

/// Where the label of a sample comes from.
enum class CalibrationKind : std::uint8_t {
  one_scan,          ///< pairs made of one scan: the pose is known
  loop_consistency,  ///< pairs of different scans that loops decide
  trajectory         ///< pairs of different scans whose poses are given
};

/// @return the name of the enumerator.
const char* to_string(CalibrationKind kind);

/// One pose with a known verdict.
struct CalibrationSample {
  double confidence = 0;  ///< before any calibration, [0, 1]
  bool correct = false;
  double weight = 1;  ///< finite, >= 0
  CalibrationKind kind = CalibrationKind::one_scan;
  std::uint32_t source = 0, target = 0;  ///< numbers of its scans; equal: made of one scan
};

/// Result of fit_calibration().
struct CalibrationFit {
  ConfidenceCalibration calibration;  ///< the identity if the samples are too few
  bool enough_samples = false;
  /// Expected calibration error of the samples with the identity and with the calibration.
  double error_before = 0, error_after = 0;
};

/// Fewest correct and fewest false samples of a fit.
inline constexpr std::size_t kMinCalibrationSamples = 10;
/// Fewest decided pairs of different scans of calibrate(). Pairs made of one scan alone do not tell
/// what pairs of two scans are like.
inline constexpr std::size_t kMinDecidedPairs = 20;
/// Range of the fitted slope.
inline constexpr double kMinCalibrationSlope = 0.2, kMaxCalibrationSlope = 3.0;

/// Fits slope and offset: maximum a posteriori of a logistic regression of the verdicts on the log
/// odds, with a prior about the identity. Deterministic: the same bits on every machine.
/// @param samples in any number; their order may change the last bits.
/// @throws InvalidArgument naming the sample: confidences outside [0, 1], bad weights.
CalibrationFit fit_calibration(const std::vector<CalibrationSample>& samples);

/// Expected calibration error: mean over ten equal bins of the confidence of the distance between
/// mean confidence and share of correct poses, weighted by the samples in each bin. 0 without
/// samples.
double calibration_error(const std::vector<CalibrationSample>& samples,
                         const ConfidenceCalibration& calibration = {});

/// What a caller demands of the poses that are reported.
struct RiskControl {
  double max_risk = 0.01;     ///< largest share of false poses among the reported ones, (0, 1)
  double max_failure = 0.05;  ///< probability that the samples mislead about it, (0, 1)

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Result of control_risk(), control_risk_of_scans() and control_risk_of_scenes().
struct RiskThreshold {
  bool supported = false;     ///< false: the samples are no proof for any threshold
  double min_confidence = 1;  ///< for RegistrationOptions::min_confidence
  std::size_t scans = 0;      ///< of control_risk_of_scans()
  std::size_t scenes = 0;     ///< of control_risk_of_scenes()
  std::size_t samples = 0;    ///< all
  std::size_t reported = 0;   ///< from min_confidence on
  std::size_t wrong = 0;      ///< of these
  double recall = 0;          ///< share of the correct samples that are reported, [0, 1]
  /// If it is not supported: how many more samples would do if their shares of false poses stay
  /// as they are. None: no number would do, too many of the most confident poses are false.
  std::optional<std::size_t> more_samples;
  /// The same in scans and in scenes.
  std::optional<std::size_t> more_scans, more_scenes;
};

/// Finds the lowest threshold on the confidence that keeps a promise: of the poses that pairs like
/// the samples report, at most max_risk are false in the long run. With probability 1 - max_failure
/// over the samples the promise is true, whatever their number and the quality of the confidence.
///
/// Learn-then-test (Angelopoulos et al. 2021, sections 2 and 3.2): thresholds on a fixed ladder are
/// tested from four fixed starts downwards, each with a quarter of max_failure, by the exact
/// binomial tail of the false poses among the reported ones; a sequence ends with its first
/// failure.
///
/// @param samples independent pairs, drawn like those of later; weights are not used. Pairs that
///   share scans are not independent: control_risk_of_scans().
/// @param calibration of the later runs: the threshold is chosen on confidences without it, and
///   min_confidence is its value with it.
/// @throws InvalidArgument for options and confidences out of range.
/// Deterministic for any order of the samples; thread-safe.
RiskThreshold control_risk(const std::vector<CalibrationSample>& samples,
                           const RiskControl& control = {},
                           const ConfidenceCalibration& calibration = {});

/// A scan of no group.
inline constexpr std::uint32_t kNoScanGroup = 0xffffffffu;

/// The same for pairs that share scans, as all pairs of a folder do: one bad scan makes many pairs
/// false, so what is drawn is a scan. With probability 1 - max_failure over the scans, at most
/// max_risk of the poses that pairs of further scans report are false in the long run.
///
/// In a round of a tournament every scan meets at most one other, so its pairs are independent. If
/// the promise is false, a bet on it pays at most 1 on average in each round. So does the mean over
/// all rounds, in which every pair occurs once: it exceeds 1 / p with a probability of at most p
/// (e-values, Vovk and Wang 2021; averages over disjoint pairs, Hoeffding 1963, section 5).
/// Thresholds are tested as by control_risk(). If all pairs are reported and correct, 10 % takes 94
/// scans, 5 % takes 192 and 1 % takes 978; no method does with fewer than 57, 117 and 597.
///
/// @param samples pairs of two scans: CalibrationResult::of_two_scans().
/// @param scan_groups group of each scan, or kNoScanGroup: all pairs of a group were aligned, and
///   no others. CalibrationResult::scan_groups. Scans are drawn independently of each other:
///   neighbours that are bad together count as fewer.
/// @throws InvalidArgument also for samples of one scan or of two groups, and for a pair that is
///   given twice.
RiskThreshold control_risk_of_scans(const std::vector<CalibrationSample>& samples,
                                    const std::vector<std::uint32_t>& scan_groups,
                                    const RiskControl& control = {},
                                    const ConfidenceCalibration& calibration = {});

/// The same for pairs of other scenes than the samples. Pairs of one scene share its aliases and
/// are not independent: what is drawn is a scene. With probability 1 - max_failure over the scenes,
/// at most max_risk of the poses that a further scene reports are false.
///
/// Split conformal prediction (Vovk et al. 2005; Angelopoulos and Bates 2023, section 1) of the
/// threshold from which on a scene keeps the risk: the k-th largest of n scenes holds for a further
/// one with probability 1 - k / (n + 1). A failure of 5 % takes 19 scenes, of which every one keeps
/// the risk; 39 allow for one that does not. With fewer nothing is supported.
///
/// @param scenes samples of each, drawn like those of later: buildings, not parts of one.
/// @throws InvalidArgument also for a scene without samples.
RiskThreshold control_risk_of_scenes(const std::vector<std::vector<CalibrationSample>>& scenes,
                                     const RiskControl& control = {},
                                     const ConfidenceCalibration& calibration = {});

/// Hash of the points of a cloud: scenes that share one are no two scenes.
std::uint64_t cloud_fingerprint(const PointCloudView& cloud);

/// Options of calibrate().
struct CalibrationOptions {
  /// Pairs made of one scan, spread over the clouds; 0: none.
  std::uint32_t self_pairs = 200;
  /// Largest number of pairs of different scans. If there are more, groups of consecutive clouds
  /// are taken, evenly spread; 0: none.
  std::uint32_t scan_pairs = 600;
  /// A pose is correct within this RMS distance over the source points, in voxels.
  double max_error = 4;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Callbacks of calibrate(). Both run on the calling thread, and either may be empty.
struct CalibrationCallbacks {
  std::function<void(std::size_t done, std::size_t total)> on_progress;  ///< in pairs
  /// Polled between chunks of pairs. true: calibrate() returns the identity at once.
  std::function<bool()> should_stop;
};

/// What one kind of pairs gave.
struct CalibrationCount {
  std::size_t pairs = 0;    ///< aligned
  std::size_t samples = 0;  ///< with a candidate and a verdict
  std::size_t correct = 0;  ///< of these
};

/// Result of calibrate().
struct CalibrationResult {
  ConfidenceCalibration calibration;  ///< for RegistrationOptions::calibration
  bool enough_samples = false;        ///< false: the calibration is the identity
  bool stopped = false;               ///< by the callback; the calibration is the identity
  /// Expected calibration error of the samples with the identity and with the calibration.
  double error_before = 0, error_after = 0;
  CalibrationCount one_scan, loop_consistency, trajectory;
  std::vector<CalibrationSample> samples;

  const CalibrationCount& count(CalibrationKind kind) const {
    return kind == CalibrationKind::one_scan           ? one_scan
           : kind == CalibrationKind::loop_consistency ? loop_consistency
                                                       : trajectory;
  }
  /// Group of each cloud, for control_risk_of_scans(): all pairs of a group were aligned.
  std::vector<std::uint32_t> scan_groups;
  /// The samples of pairs of different scans, for control_risk_of_scans().
  std::vector<CalibrationSample> of_two_scans() const;
};

/// Makes the calibration of a sensor from its clouds.
///
/// Pairs made of one scan: two disjoint halves of its points, cropped by planes so that they
/// overlap by 0 to 90 %, with noise of the size that the scan shows, the second one moved by a
/// random pose together with its viewpoints. They are easier than pairs of two scans, so each
/// weighs a twentieth, and the calibration is the identity without kMinDecidedPairs pairs of
/// different scans. These are decided by the poses of the clouds if they are given, otherwise by
/// loop_consistency() if it is sure from even odds.
///
/// @param clouds host memory; a dozen or more, some of which overlap.
/// @param options as for align(); its own calibration is not used. The samples hold for its voxel
///   size and quality.
/// @param world_from_cloud pose of each cloud, accurate to about a voxel, no_pose() if it is not
///   known; empty: none is known.
/// @return the calibration; the same bits for any number of threads and on every backend.
/// @throws InvalidArgument as prepare_batch() and align(), for another method than compatibility,
///   for another number of poses than clouds, and for poses that are not rigid.
/// Thread-safe.
CalibrationResult calibrate(const Context& context, const std::vector<PointCloudView>& clouds,
                            const RegistrationOptions& options = {},
                            const CalibrationOptions& calibration = {},
                            const std::vector<UnalignedIsometry3d>& world_from_cloud = {},
                            const CalibrationCallbacks& callbacks = {});

}  // namespace gpureg
