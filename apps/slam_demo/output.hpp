// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "slam.hpp"

namespace slam_demo {

/// Distances of a map to the true surface.
struct SurfaceError {
  std::size_t points = 0;
  double mean = 0, median = 0, within = 0;  ///< metres; share within kSurfaceReach
};
constexpr double kSurfaceReach = 0.2;  ///< metres; points beyond count as so far away

/// Distance of every point to the true surface (points with normals, about 1 cm apart): to the
/// tangent plane of its nearest true point. truth_from_map as by the alignment of the trajectories.
SurfaceError surface_error(const gpureg::PointCloud& truth, const std::vector<Eigen::Vector3f>& map,
                           const Eigen::Isometry3d& truth_from_map);

/// What a run gave, for the files.
struct RunResult {
  std::string sequence, command;
  std::size_t frames = 0, frames_done = 0;  ///< of the sequence; processed
  double seconds = 0, load_milliseconds = 0;
  std::size_t problems = 0, out_of_order = 0;  ///< frames with damaged files; frames left out
  Rig rig;
  Trajectory truth;
  AteResult odometry, final;  ///< without poses where there is no truth
  SurfaceError surface;       ///< without points where there is no true surface
};

/// Writes trajectory.txt, odometry.txt, keyframes.txt (TUM), map.ply, loops.json, report.html.
/// Throws gpureg::IoError.
void write_results(const std::string& folder, const Slam& slam, const RunResult& result);

/// The page of report.html.
std::string report_page(const Slam& slam, const RunResult& result, const surfel::Cloud& surfels);

}  // namespace slam_demo
