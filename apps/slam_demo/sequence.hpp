// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gpureg/evaluation/trajectory.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "camera.hpp"

namespace slam_demo {

using gpureg::evaluation::Trajectory;

/// One frame of a sequence on disk.
struct FrameFiles {
  double time = 0;            ///< seconds, of the colour image
  std::string colour, depth;  ///< paths
  double depth_delay = 0;     ///< seconds from the colour image to the depth image
};

/// An RGB-D sequence: what is on disk, nothing loaded.
struct Sequence {
  std::string layout;              ///< "TUM", "Redwood" or "7-Scenes"
  std::vector<FrameFiles> frames;  ///< ascending times
  std::size_t out_of_order = 0;    ///< frames dropped: not later than the one before
  Rig rig;                         ///< defaults of the layout
  Trajectory truth;                ///< empty where the folder has none
};

/// Recognises the layout of a folder:
///   TUM, ICL-NUIM  associations.txt, or rgb.txt and depth.txt; groundtruth.txt or *.gt.freiburg
///   Redwood        depth/ and color/, image/ or rgb/ with numbered files; trajectory.log or *.log
///   7-Scenes       frame-NNNNNN.color.*, .depth.png, .pose.txt; depth not registered to colour
/// Cameras: those that TUM (freiburg1, 2, 3), ICL-NUIM, Redwood and 7-Scenes publish; the folder's
/// camera.yaml (camera_file.hpp) replaces them. Where neither is, Rig::known is false.
/// @throws gpureg::IoError naming the file: no such folder, no known layout, a line that cannot be
///   read, no frames, several files that may be the true trajectory.
Sequence open_sequence(const std::string& folder);

/// What a frame holds. Empty images where a file is missing or damaged.
struct Images {
  cv::Mat3b colour;
  cv::Mat1b grey;
  cv::Mat1f depth;         ///< metres in the colour camera; 0: none
  double depth_delay = 0;  ///< seconds from the colour image to the depth image
  std::string problem;     ///< empty, or what is wrong with which file
};

Images load(const FrameFiles& files, const Rig& rig);

}  // namespace slam_demo
