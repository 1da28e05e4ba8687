// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/labels.hpp"

#include <algorithm>
#include <cmath>

#include "confidence/calibrate_modes.hpp"
#include "gpureg/loop_consistency.hpp"

namespace gpureg::calibration {
namespace {

/// Confidence from which loops decide that a pose is correct, and below one minus which that it is
/// false.
constexpr double kSure = 0.98;

RegistrationResult calibrated(const RegistrationResult& result,
                              const ConfidenceCalibration& calibration) {
  RegistrationResult out = result;
  std::vector<confidence::ModeConfidence> modes;
  std::vector<bool> equivalent;
  for (const RegistrationMode& mode : result.modes) {
    modes.push_back({mode.confidence, mode.overlap_confidence});
    equivalent.push_back(mode.equivalent);
  }
  confidence::calibrate_modes(calibration, equivalent, modes);
  for (std::size_t k = 0; k < modes.size(); ++k) {
    out.modes[k].confidence = modes[k].confidence;
    out.modes[k].overlap_confidence = modes[k].overlap_confidence;
  }
  if (!modes.empty()) out.score = modes.front().confidence;
  return out;
}

double odds(double probability) { return probability / std::max(1.0 - probability, 1e-12); }

}  // namespace

double confidence_of(const RegistrationResult& result) {
  return std::min(1.0, result.symmetry_confidence());
}

bool is_correct(const RegistrationResult& result, const Eigen::Isometry3d& truth,
                const std::vector<Eigen::Vector3f>& source_points, double max_rms) {
  const auto near = [&](const UnalignedIsometry3d& pose) {
    double sum = 0;
    for (const Eigen::Vector3f& p : source_points) {
      const Eigen::Vector3d d = p.cast<double>();
      sum += (pose * d - truth * d).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(source_points.size())) <= max_rms;
  };
  if (near(result.target_from_source)) return true;
  return std::any_of(
      result.modes.begin(), result.modes.end(),
      [&](const RegistrationMode& mode) { return mode.equivalent && near(mode.target_from_source); });
}

std::vector<std::optional<bool>> verdicts_of_loops(const std::vector<Pair>& pairs,
                                                   const std::vector<RegistrationResult>& results,
                                                   const ConfidenceCalibration& calibration,
                                                   float voxel_size) {
  LoopConsistencyOptions options = LoopConsistencyOptions::from_voxel_size(voxel_size);
  // The verdict on a pair must come from the other pairs alone: its own confidence is what is
  // calibrated. All pairs take part, and nothing dampens or bounds what loops say.
  options.min_confidence = 0.005;
  options.max_odds_factor = 1e4;
  options.iterations = 10;
  std::vector<RegistrationResult> now;
  for (const RegistrationResult& result : results) now.push_back(calibrated(result, calibration));
  const std::vector<PairConsistency> consistency = gpureg::loop_consistency(pairs, now, options);
  std::vector<std::optional<bool>> out(pairs.size());
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const PairConsistency& pair = consistency[p];
    if (!results[p].has_candidate || (pair.loops == 0 && pair.path == 0)) continue;
    if (pair.mode != 0) {
      const RegistrationMode& mode = results[p].modes[pair.mode];
      const double factor = odds(pair.confidence) / odds(now[p].modes[pair.mode].confidence);
      if (factor >= odds(kSure)) out[p] = mode.equivalent;
      continue;
    }
    const double factor = odds(pair.confidence) / odds(std::clamp(now[p].score, 1e-12, 1.0));
    if (factor >= odds(kSure)) out[p] = true;
    if (factor <= odds(1.0 - kSure)) out[p] = false;
  }
  return out;
}

}  // namespace gpureg::calibration
