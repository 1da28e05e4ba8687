// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gpureg/calibration.hpp"
#include "json/json.hpp"

namespace gpureg::cli {

/// The scene that a calibration file is of, for control_risk_of_scenes().
struct SceneFile {
  std::string name;                      ///< for messages
  std::vector<CalibrationSample> pairs;  ///< of different scans
  std::vector<std::uint64_t> clouds;     ///< cloud_fingerprint() of each
  Json options;                          ///< that confidences depend on
};

/// @throws IoError as read_calibration(), and for a file without clouds, options or pairs.
SceneFile read_scene(const std::string& path);

/// The parts of the options that confidences depend on.
Json scene_options(const RegistrationOptions& options);

/// @throws InvalidArgument where two scenes have a cloud in common.
void check_different(const SceneFile& a, const SceneFile& b);

/// @throws InvalidArgument naming the first option that is not that of this run.
void check_options(const SceneFile& scene, const Json& options);

}  // namespace gpureg::cli
