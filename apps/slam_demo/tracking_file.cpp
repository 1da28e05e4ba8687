// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_file.hpp"

#include <cstring>
#include <fstream>
#include <gpureg/error.hpp>
#include <gpureg/files.hpp>
#include <iterator>

namespace slam_demo {
namespace {

/// Says which build wrote the file: the sizes change with the structures.
std::string mark() {
  return "slam_demo tracking 1 " + std::to_string(sizeof(Keyframe)) + " " +
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

void pass(Archive& file, Features& f) {
  file.lists(f.keys, f.descriptors, f.depth);
  if (!file.writing) f.index();
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
  file.values(p.position, p.descriptor, p.first_keyframe, p.octave_zero_distance, p.bad);
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
  file.values(t.lost, t.dense);
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
  return result;
}

}  // namespace slam_demo
