// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <string>
#include <vector>

#include "gpureg/localization.hpp"
#include "support/cpu_context.hpp"
#include "support/scan.hpp"

namespace gpureg::test {

using localization::LocatedPose;
using localization::LocateOptions;
using localization::LocatePrior;
using localization::LocateResult;
using localization::LocateStatus;
using localization::MapBuilder;
using localization::MapOptions;
using localization::PreparedMap;
using localization::SearchStage;

constexpr float kVoxel = 0.1f;

/// A room of about 4 x 3 x 2.4 m with boxes, as its number decides; sample: another choice of
/// points. Same numbers, same points.
inline std::vector<Eigen::Vector3f> furnished_room(unsigned number, unsigned sample) {
  std::mt19937 furniture(number), random(1000 + sample);
  std::uniform_real_distribution<float> unit;
  std::normal_distribution<float> noise(0, 0.002f);
  std::vector<Eigen::Vector3f> points;
  const auto rectangle = [&](const Eigen::Vector3f& corner, const Eigen::Vector3f& a,
                             const Eigen::Vector3f& b) {
    for (int k = static_cast<int>(500 * a.cross(b).norm()); k > 0; --k)
      points.push_back(corner + unit(random) * a + unit(random) * b +
                       Eigen::Vector3f(noise(random), noise(random), noise(random)));
  };
  const auto box = [&](const Eigen::Vector3f& corner, const Eigen::Vector3f& size, float turn) {
    const Eigen::Matrix3f r = Eigen::AngleAxisf(turn, Eigen::Vector3f::UnitZ()).toRotationMatrix();
    const Eigen::Vector3f x = r.col(0) * size.x(), y = r.col(1) * size.y(), z = r.col(2) * size.z();
    rectangle(corner, x, z);
    rectangle(corner + y, x, z);
    rectangle(corner, y, z);
    rectangle(corner + x, y, z);
    rectangle(corner + z, x, y);
  };
  const float length = 3.4f + 1.2f * unit(furniture), width = 2.6f + 0.8f * unit(furniture);
  rectangle({0, 0, 0}, {length, 0, 0}, {0, width, 0});
  rectangle({0, 0, 0}, {length, 0, 0}, {0, 0, 2.4f});
  rectangle({0, width, 0}, {length, 0, 0}, {0, 0, 2.4f});
  rectangle({0, 0, 0}, {0, width, 0}, {0, 0, 2.4f});
  for (int k = 0; k < 7; ++k) {
    const Eigen::Vector3f corner(0.3f + 2.7f * unit(furniture), 0.3f + 1.8f * unit(furniture), 0);
    const Eigen::Vector3f size(0.3f + 0.6f * unit(furniture), 0.3f + 0.5f * unit(furniture),
                               0.3f + 1.3f * unit(furniture));
    box(corner, size, 3 * unit(furniture));
  }
  return points;
}

/// Where the sensor of a room stood.
inline const Eigen::Vector3f kSensor(2, 1.5f, 2);

/// Places of rooms in the building: rows of three.
inline Eigen::Isometry3d map_from_room(std::size_t place) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(6.0 * static_cast<double>(place % 3),
                                       5.0 * static_cast<double>(place / 3), 0);
  return pose;
}

inline PointCloud seen_room(unsigned number, unsigned sample, const Eigen::Isometry3d& pose) {
  PointCloud cloud;
  cloud.points = moved(pose, furnished_room(number, sample));
  cloud.viewpoints = moved(pose, {kSensor});
  return cloud;
}

/// tile_size: metres.
inline MapOptions map_options(double tile_size = 20) {
  MapOptions options{kVoxel};
  options.tile_size = tile_size / static_cast<double>(kVoxel);
  options.halo = 3 / static_cast<double>(kVoxel);
  return options;
}

/// A map of rooms that were scanned one by one.
inline PreparedMap building(const std::vector<unsigned>& rooms, const MapOptions& options) {
  MapBuilder builder(options);
  const Context context = Context::cpu(2);
  for (std::size_t k = 0; k < rooms.size(); ++k) {
    const PointCloud scan = seen_room(rooms[k], rooms[k], Eigen::Isometry3d::Identity());
    builder.add_scan(context, scan.view(), UnalignedIsometry3d(map_from_room(k)));
  }
  return builder.build();
}

/// A scan of a room in a frame of its own, and where that is in the map.
struct Query {
  PointCloud scan;
  Eigen::Isometry3d map_from_scan;

  Query(unsigned room, std::size_t place, unsigned seed) {
    std::mt19937 random(seed);
    const Eigen::Isometry3d scan_from_room = random_pose(random);
    scan = seen_room(room, 500 + seed, scan_from_room);
    map_from_scan = map_from_room(place) * scan_from_room.inverse();
  }
  /// Of the middle of the room, metres.
  double error(const LocatedPose& pose) const {
    const Eigen::Vector3d middle = scan.viewpoints.front().cast<double>();
    return (pose.map_from_scan * middle - map_from_scan * middle).norm();
  }
};

/// Everything of a result that has to be equal, bit for bit.
inline std::vector<double> numbers_of(const LocateResult& result) {
  std::vector<double> out{static_cast<double>(result.status), result.absent_probability,
                          static_cast<double>(result.scan_points),
                          static_cast<double>(result.tiles),
                          static_cast<double>(result.neighborhood_points)};
  for (const LocatedPose& pose : result.poses) {
    for (int k = 0; k < 16; ++k) out.push_back(pose.map_from_scan.matrix().data()[k]);
    out.insert(out.end(), {pose.confidence, pose.alias ? 1.0 : 0.0, pose.verification.confidence,
                           pose.verification.inlier_rmse});
  }
  return out;
}

}  // namespace gpureg::test
