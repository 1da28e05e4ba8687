// SPDX-License-Identifier: BSD-3-Clause
#include "tracking/tracking_file.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <gpureg/error.hpp>
#include <gpureg/files.hpp>
#include <iterator>

namespace slam_demo {
namespace {

constexpr float kMostPixels = 1 << 14;
constexpr int kMostOctaves = 32;

/// Says which build wrote the file: the sizes change with the structures.
std::string mark() {
  return "slam_demo tracking 2 " + std::to_string(sizeof(Keyframe)) + " " +
         std::to_string(sizeof(MapPoint)) + " " + std::to_string(sizeof(FramePose)) + " " +
         std::to_string(sizeof(surfel::Surfel)) + "\n";
}

/// Writes values, or reads them in the same order: the order is stated once.
struct Archive {
  std::string path, bytes;
  bool writing;
  std::size_t at = 0;

  void raw(void* data, std::size_t size) {
    if (size == 0) return;
    if (writing) {
      bytes.append(static_cast<const char*>(data), size);
      return;
    }
    if (size > bytes.size() - at) throw gpureg::IoError(path + ": is cut off");
    std::memcpy(data, bytes.data() + at, size);
    at += size;
  }
  /// Numbers, structures of numbers, and Eigen's matrices of a fixed size.
  template <class... T>
  void values(T&... value) {
    (raw(&value, sizeof(T)), ...);
  }
  template <class T>
  std::size_t resize(std::vector<T>& list) {
    std::size_t size = list.size();
    values(size);
    if (!writing && size > bytes.size() - at) throw gpureg::IoError(path + ": is cut off");
    list.resize(size);
    return size;
  }
  template <class... T>
  void lists(std::vector<T>&... list) {
    (raw(list.data(), sizeof(T) * resize(list)), ...);
  }
  template <class T, class Work>
  void each(std::vector<T>& list, const Work& work) {
    resize(list);
    for (T& item : list) work(item);
  }
};

void require(bool holds, const std::string& path, const std::string& what) {
  if (!holds) throw gpureg::IoError(path + ": is damaged: " + what);
}

void pass(Archive& file, Features& f) {
  file.lists(f.keys, f.descriptors, f.depth);
  if (file.writing) return;
  require(f.descriptors.size() == f.size() && f.depth.size() == f.size(), file.path,
          "lists of features differ in length");
  for (const cv::KeyPoint& key : f.keys)
    require(key.pt.x >= 0 && key.pt.x < kMostPixels && key.pt.y >= 0 && key.pt.y < kMostPixels &&
                key.octave >= 0 && key.octave < kMostOctaves,
            file.path, "a feature lies outside the image");
  f.index();
}

void pass(Archive& file, Keyframe& k) {
  file.values(k.frame, k.time, k.session, k.world_from_camera);
  file.lists(k.points);
  auto features =
      file.writing ? std::make_shared<Features>(*k.features) : std::make_shared<Features>();
  pass(file, *features);
  k.features = features;
  std::vector<std::pair<int, int>> shared(k.covisible.begin(), k.covisible.end());
  file.each(shared, [&](std::pair<int, int>& s) { file.values(s.first, s.second); });
  k.covisible = {shared.begin(), shared.end()};
}

void pass(Archive& file, MapPoint& p) {
  std::uint8_t bad = p.bad;  // not every byte is a bool
  file.values(p.position, p.descriptor, p.first_keyframe, p.octave_zero_distance, bad);
  p.bad = bad != 0;
  file.lists(p.observations);
}

void pass(Archive& file, Tracking& t) {
  file.each(t.map.keyframes, [&](Keyframe& k) { pass(file, k); });
  file.each(t.map.points, [&](MapPoint& p) { pass(file, p); });
  file.each(t.map.links,
            [&](RelativePose& r) { file.values(r.a, r.b, r.a_from_b, r.information); });
  file.each(t.frames, [&](FramePose& f) {
    file.values(f.time, f.session, f.reference, f.reference_from_camera);
  });
  file.each(t.fragments, [&](BuiltFragment& f) {
    file.values(f.keyframe, f.first_frame, f.last_frame, f.time);
    file.each(f.cloud.points, [&](Eigen::Vector3f& p) { file.values(p); });
    file.each(f.cloud.normals, [&](Eigen::Vector3f& n) { file.values(n); });
    file.each(f.cloud.viewpoints, [&](Eigen::Vector3f& v) { file.values(v); });
  });
  file.lists(t.surfels);
  file.values(t.map.calibration, t.lost, t.dense);
}

/// Throws IoError for an index of something that is not there.
void check(const Tracking& t, const std::string& path) {
  const auto below = [](int index, std::size_t count) { return index >= 0 && at(index) < count; };
  const auto none_or_below = [&](int index, std::size_t count) {
    return index == kNone || below(index, count);
  };
  const std::size_t keyframes = t.map.keyframes.size(), points = t.map.points.size();
  for (const Keyframe& k : t.map.keyframes) {
    require(k.points.size() == k.features->size(), path, "a keyframe has points without features");
    for (const int point : k.points)
      require(none_or_below(point, points), path, "a keyframe sees a point that is not there");
    for (const auto& [other, shared] : k.covisible)
      require(below(other, keyframes), path, "a keyframe shares points with none");
    require(k.session >= 0 && std::isfinite(k.time) && k.world_from_camera.matrix().allFinite(),
            path, "a keyframe has no session, time or pose");
  }
  for (const MapPoint& p : t.map.points) {
    require(none_or_below(p.first_keyframe, keyframes), path, "a point is of no keyframe");
    for (const Observation& o : p.observations)
      require(below(o.keyframe, keyframes) &&
                  below(o.key, t.map.keyframes[at(o.keyframe)].features->size()),
              path, "a point is seen by no feature");
  }
  for (const RelativePose& r : t.map.links)
    require(below(r.a, keyframes) && below(r.b, keyframes), path, "a link is of no keyframe");
  for (const FramePose& f : t.frames)
    require(f.session >= 0 ? below(f.reference, keyframes) : f.session == kNone, path,
            "a frame is of no keyframe");
  for (const BuiltFragment& f : t.fragments)
    require(below(f.keyframe, keyframes) &&
                (f.cloud.normals.empty() || f.cloud.normals.size() == f.cloud.points.size()),
            path, "a fragment is of no keyframe, or lacks normals");
  const DepthCalibration& c = t.map.calibration;
  require(c.width > 1 && c.height > 1 && std::isfinite(c.difference({})), path,
          "the depth calibration is none");
  require(t.lost >= 0 && t.dense >= 0, path, "a count is negative");
}

}  // namespace

void write_tracking(const std::string& path, Tracking& tracking) {
  Archive file{path, mark(), true};
  pass(file, tracking);
  gpureg::files::write_atomically(path, file.bytes);
}

Tracking read_tracking(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw gpureg::IoError(path + ": cannot be read");
  Archive file{path, {std::istreambuf_iterator<char>(in), {}}, false};
  if (file.bytes.compare(0, mark().size(), mark()) != 0)
    throw gpureg::IoError(path + ": is no file of --tracking, or of another build");
  file.at = mark().size();
  Tracking result;
  pass(file, result);
  check(result, path);
  return result;
}

}  // namespace slam_demo
