// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/reconstruction/mend.hpp"

#include <gtest/gtest.h>

#include "fields/in_units.hpp"
#include "fields/reconstruction.hpp"
#include "reconstruction/audit/in_units.hpp"
#include "reconstruction/audit/joins.hpp"
#include "support/audited_room.hpp"
#include "support/registration_result.hpp"

namespace gpureg::test {
namespace {

using namespace reconstruction;

struct MendedRoom : AuditedRoom {
  /// Registrations are right to a few millimetres here; parts keep their shape.
  void expect_mended(const std::vector<UnalignedIsometry3d>& poses) const {
    const Audit found = audit(context, clouds, poses, options, audit_options);
    ASSERT_EQ(found.verdict(), AuditVerdict::contradicted);
    const MendedMap mended = mend(context, clouds, poses, found, options, audit_options);
    EXPECT_EQ(mended.audit.verdict(), AuditVerdict::sound);
    EXPECT_TRUE(mended.left_out.empty());
    const UnalignedIsometry3d back = world_from_scan[0] * mended.world_from_scan[0].inverse();
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_LT((back * mended.world_from_scan[k].translation() - world_from_scan[k].translation())
                    .norm(),
                0.03)
          << k;
  }

  AuditOptions audit_options;
};

TEST_F(MendedRoom, ASlipIsMended) {
  std::vector<UnalignedIsometry3d> poses = world_from_scan;
  for (std::size_t k = 3; k < 6; ++k) poses[k].translation() += Eigen::Vector3d(0.4, 0.3, 0.1);
  expect_mended(poses);
}

// As a false loop does it to the scans between its ends.
TEST_F(MendedRoom, BentScansAreMended) {
  std::vector<UnalignedIsometry3d> poses = world_from_scan;
  for (std::size_t k = 0; k < 6; ++k)
    poses[k].translation() += static_cast<double>(k) * Eigen::Vector3d(0.2, 0.15, 0.05);
  expect_mended(poses);
}

TEST_F(MendedRoom, AWrongScanIsMended) { expect_mended(with_slip(2, 0.6)); }

// Of two islands, each in a frame of its own, only the contradicted one changes.
TEST_F(MendedRoom, OtherIslandsStay) {
  std::vector<UnalignedIsometry3d> poses = with_slip(1, 0.6);
  for (const std::size_t k : {4, 5}) poses[k].translation() += Eigen::Vector3d(0.4, 0.3, 0.1);
  Reconstruction map = map_of_poses(poses, {0, 0, 0, 0, 1, 1});
  Audit found = audit(context, clouds, map, options, audit_options);
  ASSERT_EQ(found.verdicts()[0], AuditVerdict::contradicted);
  const MendedMap mended = mend(context, clouds, map, found, options, audit_options);
  EXPECT_EQ(mended.moved, std::vector<std::uint32_t>{1});
  EXPECT_TRUE(mended.left_out.empty());
  EXPECT_LT((mended.world_from_scan[1].translation() - world_from_scan[1].translation()).norm(),
            0.03);
  for (const std::size_t k : {4, 5})
    EXPECT_EQ(mended.world_from_scan[k].matrix(), poses[k].matrix());

  poses[1] = world_from_scan[1];
  map = map_of_poses(poses, {0, 0, 0, 0, 1, 1});
  found = audit(context, clouds, map, options, audit_options);
  EXPECT_TRUE(mend(context, clouds, map, found, options, audit_options).left_out.empty());
}

/// Two islands of three scans, and pairs between them.
struct TwoIslands : MendedRoom {
  TwoIslands() {
    map.scans.resize(6);
    map.islands = {{{0, 1, 2}}, {{3, 4, 5}}};
    for (std::uint32_t k = 0; k < 6; ++k) {
      Scan& scan = map.scans[k];
      scan.placed = true;
      scan.island = k / 3;
      scan.island_from_scan = world_from_scan[k / 3 * 3].inverse() * world_from_scan[k];
    }
  }

  UnalignedIsometry3d relative(std::uint32_t source, std::uint32_t target) const {
    return UnalignedIsometry3d(world_from_scan[target].inverse() * world_from_scan[source]);
  }
  void add(std::uint32_t source, std::uint32_t target, double metres_off, double confidence) {
    UnalignedIsometry3d pose = relative(source, target);
    pose.translation().x() += metres_off;
    pairs.push_back({source, target});
    results.push_back(result_of(pose, confidence));
  }
  std::vector<Odometry> joins() const {
    return confirmed_joins(context, clouds, pairs, results, {}, map,
                           fields::in_units(Options{0.1f}, 0.1f), options,
                           in_units(audit_options, 0.1f));
  }

  Reconstruction map;
  std::vector<Pair> pairs;
  std::vector<RegistrationResult> results;
};

TEST_F(TwoIslands, AreJoinedWhereTheirScansAgree) {
  add(3, 2, 0.05, 0.999);
  add(4, 2, -0.05, 0.999);
  add(5, 0, 1.5, 0.999);
  const std::vector<Odometry> found = joins();
  ASSERT_EQ(found.size(), 1u);
  const UnalignedIsometry3d right = relative(found[0].source, found[0].target);
  EXPECT_LT((found[0].target_from_source.translation() - right.translation()).norm(), 0.05);
}

TEST_F(TwoIslands, StayApartWhereNoPoseIsConfirmed) {
  EXPECT_TRUE(joins().empty());
  add(3, 2, 1.5, 0.999);
  add(4, 2, 1.5, 0.999);
  EXPECT_TRUE(joins().empty());
}

}  // namespace
}  // namespace gpureg::test
