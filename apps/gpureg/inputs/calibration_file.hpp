// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
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

/// A promise that was asked for, and the answer.
struct PromisedRisk {
  RiskControl control;
  RiskThreshold threshold;
};

/// Document of a calibration; clouds: cloud_fingerprint() of each; risk: none was asked for.
Json calibration_document(const CalibrationResult& result, const RegistrationOptions& options,
                          unsigned quality, const std::vector<std::uint64_t>& clouds,
                          const std::optional<PromisedRisk>& risk);

/// The document of a calibration file.
/// @throws IoError as read_calibration().
Json read_calibration_document(const std::string& path);

/// @throws IoError naming file and field: no such file, no JSON, another kind of document or a
/// newer version, a field that is missing or out of range.
CalibrationFile read_calibration(const std::string& path);

}  // namespace gpureg::cli
