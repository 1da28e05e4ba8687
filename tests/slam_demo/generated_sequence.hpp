// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "data/generate.hpp"
#include "output/output.hpp"
#include "sequence.hpp"
#include "support/temporary_folder.hpp"

/// 150 generated frames, made once for all tests of this process.
namespace slam_demo {

using gpureg::evaluation::ErrorStatistics;

inline const std::string& frames_folder() {
  static const gpureg::test::TemporaryFolder folder;
  static const std::string path = [] {
    gpureg::synthetic::GenerateOptions options;
    options.fragments = 3;
    options.seed = 5;
    options.rgbd = true;
    gpureg::synthetic::generate(folder.path(), options);
    return folder.path();
  }();
  return path;
}

inline SlamOptions sequential() {
  SlamOptions options;
  options.tracker.sequential = true;
  options.loops.parallel = false;
  return options;
}

/// Runs the frames; those that `hide` names are black and without depth.
inline std::unique_ptr<Slam> run(const Sequence& sequence, const SlamOptions& options,
                                 const std::function<bool(int)>& hide) {
  auto slam = std::make_unique<Slam>(gpureg::Context::cpu(), sequence.rig, options);
  for (int k = 0; k < static_cast<int>(sequence.frames.size()); ++k) {
    const FrameFiles& files = sequence.frames[static_cast<std::size_t>(k)];
    Images images = load(files, sequence.rig);
    if (hide(k)) {
      images.colour.setTo(cv::Scalar(0, 0, 0));
      images.grey.setTo(0);
      images.depth.setTo(0);
    }
    slam->frame(k, files.time, images);
  }
  slam->finish();
  return slam;
}

inline ErrorStatistics ate(const Trajectory& estimate, const Trajectory& truth) {
  return gpureg::evaluation::evaluate_trajectory(estimate, truth).absolute_translation;
}

}  // namespace slam_demo
