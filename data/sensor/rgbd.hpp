// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "data/sensor/depth_sensor.hpp"

/// The frames as a sequence in the layout of the TUM RGB-D benchmark (Sturm et al., IROS 2012).
namespace gpureg::synthetic {

/// 640 x 480 x RGB of what the camera sees: solid textures under a lamp at the ceiling and
/// daylight, with a little sensor noise.
std::vector<std::uint8_t> render_colour(const RayScene& scene,
                                        const Eigen::Isometry3d& world_from_camera,
                                        std::uint64_t seed, int frame);

/// The four quarters, in the order of phase (0,0), (1,0), (0,1), (1,1), as one 640 x 480 image of
/// 1/5000 m.
std::vector<std::uint16_t> depth_image(const std::array<DepthQuarter, 4>& quarters);

/// rgb/<time>.png and depth/<time>.png. Throws IoError.
void write_frame(const std::string& folder, int frame, const std::vector<std::uint8_t>& colour,
                 const std::vector<std::uint16_t>& depth);

/// rgb.txt, depth.txt, associations.txt, groundtruth.txt (world_from_camera) and camera.yaml.
/// Throws IoError.
void write_sequence_lists(const std::string& folder,
                          const std::vector<Eigen::Isometry3d>& world_from_camera);

/// true_depth_calibration.json: what the distortion of the sensor adds to inverse depths, in the
/// format of slam_demo's depth_calibration.json. Throws IoError.
void write_depth_calibration(const std::string& folder, const DepthSensor& sensor);

}  // namespace gpureg::synthetic
