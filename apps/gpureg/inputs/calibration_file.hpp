// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "gpureg/calibration.hpp"
#include "json/json_fwd.hpp"

namespace gpureg::cli {

/// What `gpureg calibrate` writes.
struct CalibrationFile {
  ConfidenceCalibration calibration;
  double voxel_size = 0;  ///< that it was made with
};

/// Document of a calibration.
Json calibration_document(const CalibrationResult& result, const RegistrationOptions& options,
                          unsigned quality);

/// @throws IoError naming file and field: no such file, no JSON, another kind of document or a
/// newer version, a field that is missing or out of range.
CalibrationFile read_calibration(const std::string& path);

}  // namespace gpureg::cli
