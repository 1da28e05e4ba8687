// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/map.hpp"

#include <algorithm>
#include <stdexcept>

namespace slam_demo {
int Map::add_keyframe(Keyframe keyframe) {
  keyframe.points.assign(keyframe.features->size(), kNone);
  keyframe.covisible.clear();
  keyframes.push_back(std::move(keyframe));
  return static_cast<int>(keyframes.size()) - 1;
}

int Map::add_point(int keyframe, int key, const Eigen::Vector3d& position) {
  MapPoint point;
  point.position = position;
  point.first_keyframe = keyframe;
  points.push_back(point);
  const int index = static_cast<int>(points.size()) - 1;
  add_observation(index, {keyframe, key});
  return index;
}

const Observation* Map::find(int point, int keyframe) const {
  for (const Observation& o : points[at(point)].observations) {
    if (o.keyframe == keyframe) return &o;
  }
  return nullptr;
}

void Map::count_shared(int keyframe, int point, int change) {
  for (const Observation& o : points[at(point)].observations) {
    if (o.keyframe == keyframe) continue;
    for (const auto& [a, b] : {std::pair{keyframe, o.keyframe}, std::pair{o.keyframe, keyframe}}) {
      std::map<int, int>& shared = keyframes[at(a)].covisible;
      if ((shared[b] += change) <= 0) shared.erase(b);
    }
  }
}

void Map::add_observation(int index, const Observation& observation) {
  if (find(index, observation.keyframe) != nullptr) return;
  MapPoint& point = points[at(index)];
  Keyframe& keyframe = keyframes[at(observation.keyframe)];
  count_shared(observation.keyframe, index, 1);
  point.observations.push_back(observation);
  if (observation.loop != kNone) return;
  keyframe.points[at(observation.key)] = index;
  point.descriptor = keyframe.features->descriptors[at(observation.key)];
  const double distance = (point.position - keyframe.world_from_camera.translation()).norm();
  point.octave_zero_distance =
      distance * scale_of(keyframe.features->keys[at(observation.key)].octave);
}

void Map::remove_observation(int index, int keyframe, int key) {
  MapPoint& point = points[at(index)];
  const auto found =
      std::find_if(point.observations.begin(), point.observations.end(),
                   [&](const Observation& o) { return o.keyframe == keyframe && o.key == key; });
  if (found == point.observations.end()) return;
  point.observations.erase(found);
  int& sees = keyframes[at(keyframe)].points[at(key)];
  if (sees == index) sees = kNone;
  count_shared(keyframe, index, -1);
  if (point.observations.empty()) point.bad = true;
}

void Map::remove_point(int index) {
  while (!points[at(index)].observations.empty()) {
    const Observation o = points[at(index)].observations.back();
    remove_observation(index, o.keyframe, o.key);
  }
  points[at(index)].bad = true;
}

void Map::remove_loop(int loop) {
  for (std::size_t p = 0; p < points.size(); ++p) {
    const std::vector<Observation> all = points[p].observations;
    for (const Observation& o : all) {
      if (o.loop == loop) remove_observation(static_cast<int>(p), o.keyframe, o.key);
    }
  }
}

void Map::cull(int newest) {
  constexpr int kTrial = 3;  // keyframes within which a point must be seen again
  for (; culled_ < points.size(); ++culled_) {
    MapPoint& point = points[culled_];
    if (point.first_keyframe > newest - kTrial) break;
    if (!point.bad && point.observations.size() < 2) remove_point(static_cast<int>(culled_));
  }
}

Map Map::excerpt(const std::vector<int>& keyframes_with_points) const {
  Map part;
  part.calibration = calibration;
  part.points.resize(points.size());
  for (const Keyframe& k : keyframes)
    part.keyframes.push_back({k.frame, k.time, k.session, k.world_from_camera, k.features, {}, {}});
  for (const int k : keyframes_with_points) {
    part.keyframes[at(k)].points = keyframes[at(k)].points;
    for (const int p : keyframes[at(k)].points) {
      if (p != kNone) part.points[at(p)] = points[at(p)];
    }
  }
  return part;
}

std::vector<int> Map::covisible(int keyframe, std::size_t count, int min_shared) const {
  std::vector<int> result = by_count(keyframes[at(keyframe)].covisible, min_shared);
  result.resize(std::min(result.size(), count));
  return result;
}

std::map<int, int> Map::tracked_covisible(int keyframe) const {
  std::map<int, int> shared;
  for (const int p : keyframes[at(keyframe)].points) {
    if (p == kNone) continue;
    for (const Observation& o : points[at(p)].observations) {
      if (o.loop == kNone && o.keyframe != keyframe) ++shared[o.keyframe];
    }
  }
  return shared;
}

std::vector<int> by_count(const std::map<int, int>& counts, int min_count) {
  std::vector<std::pair<int, int>> order;
  for (const auto& [key, count] : counts) {
    if (count >= min_count) order.emplace_back(-count, key);
  }
  std::sort(order.begin(), order.end());
  std::vector<int> result;
  for (const auto& [count, key] : order) result.push_back(key);
  return result;
}

Eigen::Matrix<double, 6, 6> information_of(double radians, double metres) {
  Eigen::Matrix<double, 6, 1> diagonal;
  diagonal << Eigen::Vector3d::Constant(1 / (radians * radians)),
      Eigen::Vector3d::Constant(1 / (metres * metres));
  return diagonal.asDiagonal();
}

}  // namespace slam_demo
