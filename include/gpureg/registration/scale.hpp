// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gpureg/registration.hpp"
#include "gpureg/verification.hpp"

/// Registration of clouds whose scales differ by an unknown factor: photogrammetry, monocular
/// reconstruction, models in unknown units.
namespace gpureg {

/// Scales to search: lengths of the target's unit per unit of the source.
struct ScaleRange {
  double least = 0, most = 0;  ///< both 0: free, every scale at which the clouds can be compared

  static ScaleRange free() { return {}; }
  /// @param value not searched: the source is multiplied by it.
  static ScaleRange known(double value) { return {value, value}; }
  bool is_free() const { return least == 0 && most == 0; }
  bool is_known() const { return least == most && !is_free(); }

  /// @throws InvalidArgument naming the end that is not finite, not positive, or upside down.
  void validate() const;
};

/// How far the scale of a result is known.
enum class ScaleStatus : std::uint8_t {
  known,           ///< given, not searched
  found,           ///< measured
  ambiguous,       ///< another scale fits about as well, see ScaledResult::candidates
  not_observable,  ///< the surfaces in common fit at other scales, too: planes through one point
  none             ///< no pose at any scale
};

const char* to_string(ScaleStatus status);
/// @return one English sentence for messages.
const char* explain(ScaleStatus status);

/// A scale that was tried with all the evidence.
struct ScaleCandidate {
  double scale = 1;
  double confidence = 0;  ///< RegistrationResult::symmetry_confidence() at that scale
};

/// Result of align_scaled(): a similarity.
struct ScaledResult {
  ScaleStatus scale_status = ScaleStatus::none;
  double scale = 1;  ///< lengths of the target's unit per unit of the source
  /// Standard deviation of `scale` as a fraction of it, from `information`; 0: known.
  double scale_deviation = 0;
  /// Point-to-plane information of the similarity, per square of the target's unit, about the
  /// centre of the points in common: rotation (radians), translation, logarithm of the scale.
  Eigen::Matrix<double, 7, 7> information = Eigen::Matrix<double, 7, 7>::Zero();
  /// Of the source multiplied by `scale`: the pose is rigid, and all lengths are in the target's
  /// unit. Status and confidence take the other scales into account.
  RegistrationResult result;
  /// Distinct scales, the most confident first.
  std::vector<ScaleCandidate> candidates;

  bool aligned() const { return result.aligned(); }
  /// @return 4 x 4, p_target = similarity() * (p_source, 1): its upper left 3 x 3 is the rotation
  ///   times `scale`.
  Eigen::Matrix4d similarity() const;
};

/// @return the reason why the pair is not aligned, with its numbers: explain(result.result), or
/// that
///   of the scale.
std::string explain(const ScaledResult& result);

/// Finds scale, rotation and translation of two clouds. The source is prepared at the rungs of a
/// ladder of scales; feature matches that agree on a common factor propose scales, align() and its
/// evidence decide between them, and point-to-plane ICP with a free scale refines the result.
///
/// With a known scale it is align() of the source multiplied by it: the same bits for 1.
/// Deterministic, the same bits on every backend. Thread-safe.
/// @param source host memory, any unit.
/// @param target host memory; voxel size and all lengths of the options are in its unit.
/// @param range scales to search.
/// @throws InvalidArgument as prepare() and align(), for a range that is none, and, unless the
///   scale is known, for a voxel size of 0 and for RegistrationMethod::quadruples.
ScaledResult align_scaled(const Context& context, const PointCloudView& source,
                          const PointCloudView& target, const ScaleRange& range = {},
                          const RegistrationOptions& options = {});

/// align_scaled() with voxel sizes that follow from the clouds: that of the target, and once a
/// scale is found, a search within a twentieth of it in the voxels that both clouds suggest there.
/// Its result counts, or the more confident one where the two searches inferred different
/// viewpoints; other scales stay candidates. RegistrationResult::voxel_size is that of the result.
/// @param options their voxel size counts only where suggest_voxel_size() has none.
/// @throws Error as align_scaled().
ScaledResult align_scaled_auto(const Context& context, const PointCloudView& source,
                               const PointCloudView& target, const ScaleRange& range = {},
                               const RegistrationOptions& options = {});

/// Callbacks of align_scaled_batch(), on the calling thread; either may be empty.
struct ScaledCallbacks {
  /// Receives each pair once when it is finished; pairs of one source come together.
  std::function<void(std::size_t, const ScaledResult&)> on_result;
  /// Polled before each pair. true: the remaining pairs are RegistrationStatus::skipped.
  std::function<bool()> should_stop;
};

/// align_scaled() for many pairs; each cloud is prepared once for all its pairs.
/// @param pairs indices into clouds.
/// @param names of the clouds in error messages, as many as clouds, or none.
/// @return one result per pair, by pair index, each equal to that of align_scaled().
/// @throws InvalidArgument as align_scaled(), and for an index out of range.
std::vector<ScaledResult> align_scaled_batch(const Context& context,
                                             const std::vector<PointCloudView>& clouds,
                                             const std::vector<Pair>& pairs,
                                             const ScaleRange& range = {},
                                             const RegistrationOptions& options = {},
                                             const ScaledCallbacks& callbacks = {},
                                             const std::vector<std::string>& names = {});

/// 4x4 without alignment, as UnalignedIsometry3d.
using UnalignedMatrix4d = Eigen::Matrix<double, 4, 4, Eigen::DontAlign>;

/// Verdict on one similarity of a pair.
struct ScaledVerification {
  double scale = 1;  ///< as given, or refined
  /// known: as given; found: refined; not_observable: the surfaces in common fit at other scales,
  /// too; none: the clouds have no surface in common at this pose.
  ScaleStatus scale_status = ScaleStatus::none;
  double scale_deviation = 0;  ///< as of ScaledResult; of a given scale, too
  /// As of ScaledResult.
  Eigen::Matrix<double, 7, 7> information = Eigen::Matrix<double, 7, 7>::Zero();
  /// Of the source multiplied by `scale`: the pose is rigid.
  PoseVerification verification;

  /// @return as ScaledResult::similarity().
  Eigen::Matrix4d similarity() const;
};

/// verify_poses() for similarities that another method proposes: TEASER++, the loop of a monocular
/// run. Those of other scales compete with each other; scales that nobody proposes are not
/// searched.
/// @param similarities p_target = M * (p_source, 1), any number of them.
/// @param options as for align_scaled().
/// @param verification refine: the scale, too, with the pose.
/// @return one entry for each, in their order. Deterministic, the same bits on every backend.
/// @throws InvalidArgument naming the matrix that is no similarity; otherwise as prepare() and
///   verify_poses(). Thread-safe.
std::vector<ScaledVerification> verify_scaled_poses(
    const Context& context, const PointCloudView& source, const PointCloudView& target,
    const std::vector<UnalignedMatrix4d>& similarities, const RegistrationOptions& options = {},
    const VerificationOptions& verification = {});

}  // namespace gpureg
