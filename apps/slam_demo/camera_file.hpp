// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "camera.hpp"

namespace slam_demo {

/// Reads the cameras of a device, in the format of OpenCV's FileStorage and with the names of its
/// calibration:
///   image_width, image_height   pixels
///   camera_matrix               3 x 3, of the colour camera
///   distortion_coefficients     4, 5 or 8 numbers (k1 k2 p1 p2 [k3 [k4 k5 k6]]); optional
///   depth_units                 values of a depth image per metre; optional
///   depth_camera_matrix         3 x 3; optional: depth is not registered to colour
///   colour_from_depth           4 x 4, metres; optional, with depth_camera_matrix
/// What the file does not have stays in the rig. A negative focal length in y turns the images
/// upside down.
/// @throws gpureg::IoError naming the file and the entry.
void read_camera(const std::string& path, Rig& rig);

}  // namespace slam_demo
