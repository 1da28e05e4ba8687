// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <utility>
#include <vector>

#include "loop_closure/drive.hpp"
#include "support/scan.hpp"

namespace gpureg::test {

/// Where a fragment was taken.
struct Place {
  Pose world_from_fragment = Pose::Identity();
  Pose world_from_room = Pose::Identity();
  bool mirrored = false;  ///< the mirror image of the room: another place
};

/// Scans of rooms by a sensor that drifts, each with its own noise and in a frame of its own.
struct Scans {
  explicit Scans(const std::vector<Place>& places) {
    std::mt19937 random(5);
    std::vector<Pose> truth;
    for (const Place& place : places) {
      truth.push_back(place.world_from_fragment);
      const Eigen::Isometry3d fragment_from_room(place.world_from_fragment.inverse() *
                                                 place.world_from_room);
      std::vector<Eigen::Vector3f> room = scan_room(random);
      Eigen::Vector3f sensor = kRoomSensor;
      if (place.mirrored) {
        for (Eigen::Vector3f& p : room) p.x() = -p.x();
        sensor.x() = -sensor.x();
      }
      points.push_back(moved(fragment_from_room, std::move(room)));
      const Eigen::Vector3d seen_from = fragment_from_room * sensor.cast<double>();
      sensors.emplace_back(seen_from.cast<float>());
    }
    s = sequence(truth);
  }

  PreparedCloud cloud(const Context& context, int k) const {
    PointCloudView view(points[static_cast<std::size_t>(k)]);
    view.viewpoints = sensors[static_cast<std::size_t>(k)].data();
    view.viewpoint_count = 1;
    return prepare(context, view);
  }

  void add(LoopCloser& closer, const Context& context, int k) const {
    closer.add({k, 0, double(k), cloud(context, k), s.odometry[static_cast<std::size_t>(k)],
                Eigen::Vector3d(0, 0, 1)});
  }

  void add_to(LoopCloser& closer, const Context& context, int begin, int end) const {
    for (int k = begin; k < end; ++k) {
      const auto at = static_cast<std::size_t>(k);
      add(closer, context, k);
      if (k > 0) closer.add_odometry(k, k - 1, s.odometry[at - 1].inverse() * s.odometry[at]);
    }
  }

  std::vector<std::vector<Eigen::Vector3f>> points;
  std::vector<Eigen::Vector3f> sensors;
  Sequence s;
};

/// `count` scans of one room along a curve.
inline Scans scans_of_one_room(int count) {
  std::vector<Place> places;
  for (int k = 0; k < count; ++k)
    places.push_back({planar(0.8 * k, 0.3 * k, 25.0 * k), Pose::Identity(), false});
  return Scans(places);
}

inline loop_closure::Options quick_options() {
  loop_closure::Options options;
  options.registration.quality = 1;
  options.chunk = 1;
  return options;
}

}  // namespace gpureg::test
