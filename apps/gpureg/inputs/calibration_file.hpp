// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gpureg/calibration.hpp"
#include "json/json_fwd.hpp"

namespace gpureg::cli {

/// What `gpureg calibrate` writes.
struct CalibrationFile {
  ConfidenceCalibration calibration;
  double voxel_size = 0;                 ///< that it was made with
  std::optional<double> min_confidence;  ///< that keeps a promised risk, of `--max-risk`
};

/// Pairs of different scans of a calibration file, for control_risk_of_scenes().
/// @throws IoError as read_calibration().
std::vector<CalibrationSample> read_decided_pairs(const std::string& path);

/// A promise that was asked for, and the answer.
struct PromisedRisk {
  RiskControl control;
  RiskThreshold threshold;
};

/// Document of a calibration; risk: none was asked for.
Json calibration_document(const CalibrationResult& result, const RegistrationOptions& options,
                          unsigned quality, const std::optional<PromisedRisk>& risk);

/// @throws IoError naming file and field: no such file, no JSON, another kind of document or a
/// newer version, a field that is missing or out of range.
CalibrationFile read_calibration(const std::string& path);

}  // namespace gpureg::cli
