// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "slam.hpp"

namespace slam_demo {

/// Keeps what tracking found, so that runs that differ in their loops share it. The file is of this
/// build and machine: values lie in it as in memory.
/// @throws gpureg::IoError naming the file: unreadable, of another build, cut off.
void write_tracking(const std::string& path, Tracking& tracking);
Tracking read_tracking(const std::string& path);

}  // namespace slam_demo
