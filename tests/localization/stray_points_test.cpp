// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "gpureg/change.hpp"
#include "gpureg/reconstruction.hpp"
#include "localization/building.hpp"

namespace gpureg::test {
namespace {

using localization::ChangeLabel;

// prepare() drops isolated points that would exhaust its memory. What else takes a cloud does so,
// too: it was refused here.
class StrayPointsOfPlaces : public testing::Test {
 protected:
  static constexpr std::size_t kStray = 26'000;

  StrayPointsOfPlaces() : context(Context::cpu(2)), query(1, 0, 1) {
    options = map_options(200);
    options.halo = 0;
  }

  static PointCloud littered(PointCloud cloud) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> place(-60, 60);
    for (std::size_t k = 0; k < kStray; ++k)
      cloud.points.emplace_back(place(random), place(random), place(random));
    return cloud;
  }
  /// One tile of all points, without sides.
  PreparedMap bare_map() const {
    PointCloud cloud;
    for (unsigned room = 1; room <= 6; ++room)
      for (const Eigen::Vector3f& p : furnished_room(room, room))
        cloud.points.push_back((map_from_room(room - 1) * p.cast<double>()).cast<float>());
    return prepare_map(littered(cloud).view(), options);
  }
  void expect_found(const PreparedMap& map, const PointCloud& scan) const {
    const LocateResult result = locate(context, scan.view(), map);
    ASSERT_EQ(result.status, LocateStatus::found);
    EXPECT_LT(query.error(result.poses.front()), 0.1);
  }

  Context context;
  MapOptions options;
  Query query;
};

TEST_F(StrayPointsOfPlaces, OfScansThatAMapIsMadeOf) {
  MapBuilder builder(options);
  const PointCloud room = seen_room(1, 1, Eigen::Isometry3d::Identity());
  builder.add_scan(context, littered(room).view(), UnalignedIsometry3d::Identity());
  MapBuilder clean(options);
  clean.add_scan(context, room.view(), UnalignedIsometry3d::Identity());
  const PreparedMap map = builder.build();
  // About two of the 26,000 lie in the room, beside its points.
  EXPECT_NEAR(static_cast<double>(map.size()), static_cast<double>(clean.build().size()), 10);
  expect_found(map, query.scan);
}

TEST_F(StrayPointsOfPlaces, OfAMapWithoutSides) { expect_found(bare_map(), query.scan); }

TEST_F(StrayPointsOfPlaces, OfAScan) {
  expect_found(building({1}, map_options()), littered(query.scan));
}

TEST_F(StrayPointsOfPlaces, OfMapAndScanThatAreCompared) {
  const PointCloud scan = littered(query.scan);
  for (const PreparedMap& map : {bare_map(), building({1}, map_options())}) {
    const localization::ChangeResult changes =
        find_changes(context, scan.view(), map, UnalignedIsometry3d(query.map_from_scan));
    EXPECT_EQ(changes.scan.labels.size(), scan.points.size());
    std::size_t same = 0;
    for (std::size_t k = 0; k < query.scan.points.size(); ++k)
      same += changes.scan.labels[k] == ChangeLabel::same;
    EXPECT_GT(same, query.scan.points.size() * 9 / 10);
  }
}

TEST_F(StrayPointsOfPlaces, OfASurfaceThatIsRefined) {
  const RegistrationOptions prepare;
  const auto surface = reconstruction::surface_of(context, littered(query.scan).view(), prepare);
  EXPECT_EQ(surface.points.size(),
            reconstruction::surface_of(context, query.scan.view(), prepare).points.size());
  EXPECT_TRUE(reconstruction::surface_of(context, PointCloudView(), prepare).points.empty());
}

}  // namespace
}  // namespace gpureg::test
