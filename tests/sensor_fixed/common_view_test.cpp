// SPDX-License-Identifier: BSD-3-Clause
#include "sensor_fixed/common_view.hpp"

#include <gtest/gtest.h>

namespace gpureg {
namespace {

struct Scan : PreparedState {
  std::vector<Vec3> copy_points() const override { return {}; }
  std::vector<Vec3> copy_normals() const override { return {}; }
  std::vector<float> copy_features() const override { return {}; }
  Scan(Vec3 viewpoint, ViewpointSource source) {
    viewpoints = {viewpoint};
    statistics.viewpoint = source;
  }
};

/// So many of 1,000 points on either side: seen by both, in free space, occluded.
ModeOutcome mode_with(std::uint32_t observed, std::uint32_t violating, std::uint32_t occluded) {
  ModeOutcome mode;
  for (SideEvidence* side : {&mode.source, &mode.target}) {
    (*side)[Term::tested] = 1000;
    (*side)[Term::observed] = observed;
    (*side)[Term::violating] = violating;
    (*side)[Term::occluded] = occluded;
  }
  return mode;
}

TEST(CommonView, OfScansFromOnePlaceIsTheSame) {
  const Scan a({1, 2, 0}, ViewpointSource::origin), b({0, 2, 0}, ViewpointSource::given),
      unknown({0, 2, 0}, ViewpointSource::none);
  ModeOutcome different = mode_with(600, 50, 250);
  different.pose.tx = -1.05;  // the sensors are 5 cm apart
  EXPECT_TRUE(contradicts_common_view(different, a, b, 0.075));
  EXPECT_FALSE(contradicts_common_view(different, a, b, 0.03));
  EXPECT_FALSE(contradicts_common_view(different, a, unknown, 0.075));
  EXPECT_FALSE(contradicts_common_view(different, unknown, b, 0.075));
  ModeOutcome equal = mode_with(600, 5, 15);
  equal.pose.tx = -1;
  EXPECT_FALSE(contradicts_common_view(equal, a, b, 0.075));
  // Side by side: hardly any direction is seen by both.
  ModeOutcome beside = mode_with(60, 5, 40);
  beside.pose.tx = -1;
  EXPECT_FALSE(contradicts_common_view(beside, a, b, 0.075));
  Scan fragment({1, 2, 0}, ViewpointSource::given);
  fragment.viewpoints.push_back({2, 2, 0});
  EXPECT_FALSE(contradicts_common_view(different, fragment, b, 0.075));
}

}  // namespace
}  // namespace gpureg
