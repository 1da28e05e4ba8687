// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gpureg/evaluation/surface_error.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "slam.hpp"

namespace slam_demo {

/// What a run gave, for the files.
struct RunResult {
  std::string sequence;
  std::size_t frames = 0, frames_done = 0;  ///< of the sequence; processed
  double seconds = 0, load_milliseconds = 0;
  std::size_t problems = 0, out_of_order = 0;  ///< frames with damaged files; frames left out
  Rig rig;
  Trajectory truth;
  gpureg::evaluation::TrajectoryEvaluation odometry, final;  ///< see evaluate()
  gpureg::evaluation::SurfaceEvaluation surface;             ///< without points: no true surface
};

/// Errors of what the system has by now. true_surface: a PLY, or empty. Without a true trajectory,
/// and with fewer than three poses in common, the figures stay empty.
void evaluate(const Slam& slam, const std::string& true_surface, RunResult& result);

/// With the folders above it. Throws gpureg::IoError.
void make_folder(const std::string& folder);

/// Writes trajectory.txt, odometry.txt, keyframes.txt (TUM), map.ply,
/// depth_calibration.json, loops.json, report.html. Throws gpureg::IoError.
void write_results(const std::string& folder, const Slam& slam, const RunResult& result);

/// JSON as text. Names of files need not be UTF-8: other bytes become the replacement character.
std::string text_of(const nlohmann::json& document, int indent);

/// The page of report.html. figures: loops.json.
std::string report_page(const Slam& slam, const RunResult& result, const surfel::Cloud& surfels,
                        const nlohmann::json& figures);

}  // namespace slam_demo
