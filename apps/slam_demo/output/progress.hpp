// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "camera.hpp"
#include "loops/loops.hpp"

namespace slam_demo {

/// progress.jsonl of the output: what the run did so far, for view.py. It grows by whole lines of
/// JSON. Whoever follows it knows by the lock (flock) of the file whether the run still goes on.
class Progress {
 public:
  /// Makes the folder and the file. Throws IoError, also where another run writes this file.
  Progress(const std::string& folder, const Pinhole& camera);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Between two frames: writes new keyframes, keyframes that moved by at least a millimetre since
  /// they were written, loops that were accepted or retracted.
  void update(int frame, const Map& map, const std::vector<LoopRecord>& loops,
              const std::vector<ImageLoopRecord>& image_loops);
  /// After the results are written: the last line. how: finished or interrupted.
  void end(const std::string& how);

  /// Every line was written. A line that cannot be written is the last one.
  bool complete() const { return complete_; }

 private:
  void write(std::string line);
  void add_keyframe(int frame, const Map& map);
  void set_loop(int frame, int number, bool accepted, int a, int b, const std::string& reason);

  const std::string path_;
  int file_ = -1, frame_ = 0;
  bool complete_ = true;
  std::vector<Eigen::Isometry3d> written_;  // by keyframe
  std::map<int, bool> accepted_;            // by number of the loop
};

}  // namespace slam_demo
