// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "gpureg/preparation/sensor_fixed.hpp"
#include "gpureg/registration.hpp"
#include "sensor_fixed/parts.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using test::Part;
using test::Points;

constexpr int kScans = 4, kOfAnotherRoom = 1;

/// Scans of two rooms from different places, in the frames of their sensors.
struct Rooms {
  std::vector<Points> scans;
  std::vector<Eigen::Isometry3d> room_from_sensor;

  Rooms() {
    for (int k = 0; k < kScans + kOfAnotherRoom; ++k) {
      std::mt19937 random(static_cast<unsigned>(20 + k));
      const Eigen::Vector3f size =
          k < kScans ? Eigen::Vector3f::Ones() : Eigen::Vector3f(1.6f, 0.7f, 1.3f);
      std::uniform_real_distribution<double> unit;
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      const double x = 0.8 + 0.6 * unit(random), y = 0.6 + 0.3 * unit(random);
      pose.translation() = Eigen::Vector3d(x, y, 1.5);
      pose.linear() = (Eigen::AngleAxisd(6.28 * unit(random), Eigen::Vector3d::UnitZ()) *
                       Eigen::AngleAxisd(0.3 * unit(random), Eigen::Vector3d::UnitX()))
                          .toRotationMatrix();
      const Eigen::Isometry3f sensor_from_room = pose.inverse().cast<float>();
      const Points room = test::scan_room(random);
      const float missing = 0.5f * static_cast<float>(k % 4);
      Points scan;
      for (std::size_t n = 0; n < room.size(); n += 6)
        if (room[n].x() < missing || room[n].x() > missing + 0.3f)
          scan.push_back(sensor_from_room * room[n].cwiseProduct(size));
      scans.push_back(std::move(scan));
      room_from_sensor.push_back(pose);
    }
  }
};

/// As `gpureg batch` does it.
std::vector<RegistrationResult> align_set(std::vector<Points> scans) {
  const FixedParts parts = find_fixed_parts(test::views_of(scans));
  for (Points& scan : scans) {
    const std::vector<std::uint32_t> rows = rows_in(parts, PointCloudView(scan));
    for (std::size_t k = rows.size(); k-- > 0;)
      scan.erase(scan.begin() + static_cast<std::ptrdiff_t>(rows[k]));
  }
  const RegistrationOptions options{0.1f};
  const Context context = Context::cpu(2);
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < scans.size(); ++i)
    for (std::uint32_t j = i + 1; j < scans.size(); ++j) pairs.push_back({j, i});
  return align_batch(context, prepare_batch(context, test::views_of(scans), options), pairs,
                     options);
}

Eigen::Vector3f of_shell(std::mt19937& random) { return 12 * test::any_direction(random); }

// A vehicle with a fifth of the points brought scans of different rooms together, with .55.
TEST(InjectedPoints, ChangeNoPoseAndReportNoForeignPair) {
  const Rooms rooms;
  std::mt19937 random(3);
  const std::vector<RegistrationResult> clean = align_set(rooms.scans);
  EXPECT_GE(std::count_if(clean.begin(), clean.end(), [](const auto& r) { return r.aligned(); }),
            kScans * (kScans - 1) / 2 - 1);
  for (const auto& [name, part] : {std::pair<const char*, Part>{"vehicle", test::of_vehicle},
                                   {"hand", test::of_hand},
                                   {"disc", test::of_disc},
                                   {"frame", test::of_frame},
                                   {"shell", of_shell}})
    for (const double share : {0.01, 0.2}) {
      std::vector<Points> scans = rooms.scans;
      test::add(part, share, scans, random);
      const std::vector<RegistrationResult> results = align_set(scans);
      std::size_t at = 0;
      for (std::size_t i = 0; i < scans.size(); ++i)
        for (std::size_t j = i + 1; j < scans.size(); ++j, ++at) {
          const bool same_room = i < kScans && j < kScans;
          if (clean[at].aligned() || !same_room)
            EXPECT_EQ(results[at].aligned(), same_room)
                << name << " " << share << ": " << i << " " << j << ", " << results[at].confidence;
          if (!same_room) continue;
          const Eigen::Isometry3d truth =
              rooms.room_from_sensor[i].inverse() * rooms.room_from_sensor[j];
          // A fraction of the voxels of 0.1 m.
          EXPECT_LT(test::translation_error(
                        truth, Eigen::Isometry3d(results[at].target_from_source.matrix())),
                    0.05)
              << name << " " << share << ": " << i << " " << j;
        }
    }
}

}  // namespace
}  // namespace gpureg
