// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "gpureg/reconstruction/audit.hpp"
#include "support/scan.hpp"

namespace gpureg::test {

/// Scans of a room, each without another slice of it, at their places in the room.
struct AuditedRoom : ::testing::Test {
  AuditedRoom() {
    options = RegistrationOptions{0.1f};
    for (unsigned k = 0; k < 6; ++k) {
      std::mt19937 random(k + 1);
      world_from_scan.emplace_back(k == 0 ? Eigen::Isometry3d::Identity() : random_pose(random));
      const Eigen::Isometry3d scan_from_world(world_from_scan.back().inverse().matrix());
      const std::vector<Eigen::Vector3f> points = moved(scan_from_world, scan_room(random));
      const Eigen::Vector3f sensor = (scan_from_world * kRoomSensor.cast<double>()).cast<float>();
      PointCloudView view;
      view.points = points.front().data();
      view.size = points.size();
      view.viewpoints = sensor.data();
      view.viewpoint_count = 1;
      clouds.push_back(prepare(context, view, options));
    }
  }

  reconstruction::Audit audited(const std::vector<UnalignedIsometry3d>& poses) const {
    return reconstruction::audit(context, clouds, poses, options, reconstruction::AuditOptions{});
  }

  std::vector<UnalignedIsometry3d> with_slip(std::size_t scan, double metres) const {
    std::vector<UnalignedIsometry3d> poses = world_from_scan;
    poses[scan].translation() += metres * Eigen::Vector3d(0.6, 0.48, 0.64);
    return poses;
  }

  Context context = Context::cpu(1);
  RegistrationOptions options;
  std::vector<PreparedCloud> clouds;
  std::vector<UnalignedIsometry3d> world_from_scan;
};

}  // namespace gpureg::test
