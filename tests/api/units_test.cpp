// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "gpureg/voxel_size.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using Points = std::vector<Eigen::Vector3f>;

Points room(float factor) {
  std::mt19937 random(1);
  Points points = test::scan_room(random);
  for (Eigen::Vector3f& p : points) p *= factor;
  return points;
}

std::string question(const Points& source, const Points& target, double least = kSuspectRatio) {
  return question_units(PointCloudView(source), PointCloudView(target), least);
}

TEST(Units, ExtentsOfOtherUnitsAreAQuestion) {
  EXPECT_EQ(question(room(1), room(1000)),
            "are the units different? target is 1000 times larger than source, as with "
            "millimetres and metres");
  EXPECT_NE(question(room(100), room(1))
                .find("source is 100 times larger than target, as with "
                      "centimetres and metres"),
            std::string::npos);
  // Nothing usual, and still nobody has two such clouds of one place.
  EXPECT_EQ(question(room(1), room(60)),
            "are the units different? target is 60 times larger than "
            "source");
}

TEST(Units, PartsOfScenesAreNone) {
  EXPECT_EQ(question(room(1), room(3.28084f)), "");
  EXPECT_EQ(question(room(1), room(1.5f), kLeastUnitRatio), "");
  EXPECT_EQ(question(room(1), room(6), kLeastUnitRatio), "");
}

TEST(Units, AfterAFailureFeetAndInchesAre) {
  EXPECT_NE(question(room(1), room(3.28084f), kLeastUnitRatio).find("feet and metres"),
            std::string::npos);
  EXPECT_NE(question(room(39.37f), room(1), kLeastUnitRatio).find("inches and metres"),
            std::string::npos);
}

TEST(Units, StrayAndMissingPointsDoNotMatter) {
  Points stray = room(1);
  stray.emplace_back(5000.f, 0.f, 0.f);
  EXPECT_EQ(question(stray, room(1)), "");
  EXPECT_EQ(question({}, room(1)), "");
  EXPECT_EQ(question({Eigen::Vector3f(1, 2, 3)}, room(1)), "");
}

}  // namespace
}  // namespace gpureg
