// SPDX-License-Identifier: BSD-3-Clause
#include "output/progress.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <gpureg/error.hpp>
#include <nlohmann/json.hpp>

#include "output/output.hpp"

namespace slam_demo {
namespace {

using nlohmann::json;

constexpr int kVersion = 1;
constexpr std::size_t kPoints = 200;  // of a keyframe
constexpr double kMovedMetres = 1e-3, kMovedRadians = 1e-3;

/// A tenth of a millimetre is enough to look at, and half as long.
double rounded(double value) { return std::round(value * 1e4) / 1e4; }

json vector_json(const Eigen::Vector3d& v) {
  return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

/// Position, and the quaternion x y z w.
json pose_json(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q(pose.linear());
  json result = vector_json(pose.translation());
  for (const double value : {q.x(), q.y(), q.z(), q.w()}) result.push_back(rounded(value));
  return result;
}

bool moved(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm() >= kMovedMetres ||
         (a.linear() - b.linear()).norm() >= kMovedRadians;
}

/// The points that the keyframe saw first, in its camera.
json points_json(const Map& map, int index) {
  const Keyframe& keyframe = map.keyframes[at(index)];
  std::vector<Eigen::Vector3d> points;
  for (const int k : keyframe.points) {
    if (k == kNone || map.points[at(k)].bad || map.points[at(k)].first_keyframe != index) continue;
    points.push_back(keyframe.world_from_camera.inverse() * map.points[at(k)].position);
  }
  json result = json::array();
  const std::size_t stride = points.size() / kPoints + 1;
  for (std::size_t k = 0; k < points.size(); k += stride) result.push_back(vector_json(points[k]));
  return result;
}

}  // namespace

Progress::Progress(const std::string& folder, const Pinhole& camera)
    : path_(folder + "/progress.jsonl") {
  make_folder(folder);
  file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) throw gpureg::IoError(path_ + ": cannot be written: " + std::strerror(errno));
  // Some file systems have no locks: then nobody knows when a run was killed.
  if (::flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(file_);
    throw gpureg::IoError(path_ + ": another run writes to this folder");
  }
  complete_ = ::ftruncate(file_, 0) == 0;
  write(json{{"slam_demo_progress", kVersion},
             {"camera", {camera.fx, camera.fy, camera.cx, camera.cy}}}
            .dump());
}

Progress::~Progress() { ::close(file_); }

void Progress::write(std::string line) {
  line += '\n';
  for (std::size_t done = 0; complete_ && done < line.size();) {
    const ssize_t count = ::write(file_, line.data() + done, line.size() - done);
    if (count > 0)
      done += static_cast<std::size_t>(count);
    else
      complete_ = count < 0 && errno == EINTR;
  }
}

void Progress::add_keyframe(int frame, const Map& map) {
  const auto k = static_cast<int>(written_.size());
  const Keyframe& keyframe = map.keyframes[at(k)];
  written_.push_back(keyframe.world_from_camera);
  write(json{{"keyframe", k},
             {"frame", frame},
             {"time", keyframe.time},
             {"session", keyframe.session},
             {"pose", pose_json(keyframe.world_from_camera)},
             {"points", points_json(map, k)}}
            .dump());
}

void Progress::set_loop(int frame, int number, bool accepted, int a, int b,
                        const std::string& reason) {
  bool& before = accepted_[number];
  if (before == accepted) return;
  before = accepted;
  write(text_of({{"loop", number},
                 {"frame", frame},
                 {"keyframes", {a, b}},
                 {"state", accepted ? "accepted" : "retracted"},
                 {"reason", reason}},
                -1));
}

void Progress::update(int frame, const Map& map, const std::vector<LoopRecord>& loops,
                      const std::vector<ImageLoopRecord>& image_loops) {
  if (!complete_) return;
  frame_ = frame;
  json changed = json::array();
  for (std::size_t k = 0; k < written_.size(); ++k) {
    const Eigen::Isometry3d& pose = map.keyframes[k].world_from_camera;
    if (!moved(pose, written_[k])) continue;
    written_[k] = pose;
    json row = pose_json(pose);
    row.insert(row.begin(), k);
    changed.push_back(std::move(row));
  }
  if (!changed.empty()) write(json{{"moved", std::move(changed)}, {"frame", frame}}.dump());
  while (written_.size() < map.keyframes.size()) add_keyframe(frame, map);
  for (std::size_t k = 0; k < loops.size(); ++k)
    set_loop(frame, static_cast<int>(k), loops[k].state == "accepted", loops[k].target_keyframe,
             loops[k].source_keyframe, loops[k].reason);
  for (std::size_t k = 0; k < image_loops.size(); ++k)
    set_loop(frame, -1 - static_cast<int>(k), !image_loops[k].retracted, image_loops[k].target,
             image_loops[k].keyframe, "image");
}

void Progress::end(const std::string& how) { write(json{{"end", how}, {"frame", frame_}}.dump()); }

}  // namespace slam_demo
