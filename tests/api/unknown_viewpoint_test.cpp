// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <tuple>

#include "gpureg/registration.hpp"
#include "gpureg/verification.hpp"
#include "support/expect_error.hpp"
#include "support/same_evidence.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using test::moved;
using test::random_pose;

/// What a sensor sees: in each direction the points up to 4 cm behind the nearest one.
std::vector<Eigen::Vector3f> seen_from(const Eigen::Vector3f& sensor,
                                       const std::vector<Eigen::Vector3f>& points) {
  const auto cell = [&](const Eigen::Vector3f& p) {
    const Eigen::Vector3f d = (p - sensor).normalized() * 60;
    return std::make_tuple(std::lround(d.x()), std::lround(d.y()), std::lround(d.z()));
  };
  std::map<std::tuple<long, long, long>, float> nearest;
  for (const Eigen::Vector3f& p : points) {
    const float range = (p - sensor).norm();
    const auto [at, first] = nearest.emplace(cell(p), range);
    if (!first) at->second = std::min(at->second, range);
  }
  std::vector<Eigen::Vector3f> out;
  for (const Eigen::Vector3f& p : points)
    if ((p - sensor).norm() < nearest[cell(p)] + 0.04f) out.push_back(p);
  return out;
}

std::vector<Eigen::Vector3f> room_scan(unsigned seed) {
  std::mt19937 random(seed);
  auto points = seen_from(test::kRoomSensor, test::scan_room(random));
  for (Eigen::Vector3f& p : points) p -= test::kRoomSensor;
  return points;
}

/// A closed surface without symmetry: a sphere with bumps.
std::vector<Eigen::Vector3f> potato(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<Eigen::Vector3f> points;
  for (int k = 0; k < 40000; ++k) {
    const Eigen::Vector3f d =
        Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized();
    points.emplace_back(d *
                        (0.8f + 0.25f * std::sin(3 * d.x() + 1) * d.y() + 0.2f * d.z() * d.x()));
  }
  return points;
}

const Context& cpu() {
  static const Context context = Context::cpu(2);
  return context;
}

ViewpointSource decision(const PointCloudView& view) {
  return prepare(cpu(), view).statistics().viewpoint;
}

TEST(UnknownViewpoint, TheOriginOfAScannerIsFound) {
  EXPECT_EQ(decision(PointCloudView(room_scan(1))), ViewpointSource::origin);
}

TEST(UnknownViewpoint, AMovedScanHasNone) {
  std::mt19937 random(3);
  int none = 0;
  for (int k = 0; k < 5; ++k)
    none +=
        decision(PointCloudView(moved(random_pose(random), room_scan(1)))) == ViewpointSource::none;
  // A place may look as good as the sensor's by chance.
  EXPECT_GE(none, 4);
}

TEST(UnknownViewpoint, ATurnedScanKeepsItsOrigin) {
  std::mt19937 random(4);
  Eigen::Isometry3d turn = random_pose(random);
  turn.translation().setZero();
  EXPECT_EQ(decision(PointCloudView(moved(turn, room_scan(1)))), ViewpointSource::origin);
}

/// A street seen by a LiDAR of 32 rings at the origin; a share of the points is kept at random.
std::vector<Eigen::Vector3f> street_scan(unsigned seed, double kept) {
  std::mt19937 random(7), drop(seed);  // one street
  std::uniform_real_distribution<float> unit;
  std::vector<Eigen::AlignedBox3f> boxes;
  for (int k = 0; k < 60; ++k) {
    const float side = k % 2 ? 1.f : -1.f, x = 100 * unit(random) - 50;
    const Eigen::Vector3f low(x, side * (4 + 8 * unit(random)), -2);
    boxes.emplace_back(low, low + Eigen::Vector3f(1 + 5 * unit(random), 1 + 3 * unit(random),
                                                  1 + 5 * unit(random)));
  }
  std::bernoulli_distribution keep(kept);
  std::vector<Eigen::Vector3f> points;
  for (int ring = 0; ring < 32; ++ring)
    for (int column = 0; column < 1200; ++column) {
      const float up = -0.45f + 0.02f * static_cast<float>(ring);
      const float turn = static_cast<float>(column) * static_cast<float>(2 * M_PI) / 1200;
      const Eigen::Vector3f ray(std::cos(up) * std::cos(turn), std::cos(up) * std::sin(turn),
                                std::sin(up));
      float range = ray.z() < 0 ? -2 / ray.z() : 1e9f;
      for (const Eigen::AlignedBox3f& box : boxes) {
        const Eigen::Array3f a = box.min().array() / ray.array(),
                             b = box.max().array() / ray.array();
        const float enter = a.min(b).maxCoeff(), leave = a.max(b).minCoeff();
        if (enter > 0 && enter < leave) range = std::min(range, enter);
      }
      if (range < 80 && keep(drop)) points.push_back(ray * range);
    }
  return points;
}

// Neighbours in a thinned scan have distances by chance: its spacing does not tell the viewpoint.
TEST(UnknownViewpoint, AThinnedScanHasOneReturnPerDirection) {
  RegistrationOptions options{0.8f};
  const auto decisions = [&](bool move) {
    std::mt19937 random(6);
    std::map<ViewpointSource, int> out;
    for (unsigned k = 0; k < 6; ++k) {
      Eigen::Isometry3d pose = random_pose(random);
      if (move)
        pose.translation() = Eigen::Vector3d::Unit(k % 3) * (k < 3 ? 8 : -12);
      else
        pose.translation().setZero();
      const auto points = moved(pose, street_scan(k, 0.25));
      ++out[prepare(cpu(), PointCloudView(points), options).statistics().viewpoint];
    }
    return out;
  };
  EXPECT_EQ(decisions(false)[ViewpointSource::origin], 6);
  EXPECT_EQ(decisions(true)[ViewpointSource::none], 6);
}

TEST(UnknownViewpoint, WhatIsSaidIsTaken) {
  const auto points = room_scan(1);
  PointCloudView view(points);
  view.infer_viewpoint = false;
  EXPECT_EQ(decision(view), ViewpointSource::none);
  const float viewpoint[3] = {0, 0, 0};
  view.viewpoints = viewpoint;
  view.viewpoint_count = 1;
  EXPECT_THROW(prepare(cpu(), view), InvalidArgument);
  view.infer_viewpoint = true;
  EXPECT_EQ(decision(view), ViewpointSource::given);
}

TEST(UnknownViewpoint, AModelIsClosedAndItsNormalsPointOutwards) {
  const auto points = moved(Eigen::Isometry3d(Eigen::Translation3d(3, 1, 0)), potato(1));
  const PreparedCloud cloud = prepare(cpu(), PointCloudView(points));
  ASSERT_EQ(cloud.statistics().viewpoint, ViewpointSource::model);
  const auto p = cloud.points(), n = cloud.normals();
  std::size_t outwards = 0;
  for (std::size_t k = 0; k < p.size(); ++k)
    outwards += n[k].dot(p[k] - Eigen::Vector3f(3, 1, 0)) > 0;
  EXPECT_GT(static_cast<double>(outwards), 0.99 * static_cast<double>(p.size()));
}

TEST(UnknownViewpoint, MovedScansAlign) {
  std::mt19937 random(7);
  for (int k = 0; k < 3; ++k) {
    const Eigen::Isometry3d a = random_pose(random), b = random_pose(random);
    const auto source = moved(a, room_scan(1)), target = moved(b, room_scan(2));
    const RegistrationResult result =
        align(cpu(), PointCloudView(source), PointCloudView(target), RegistrationOptions{0.05f});
    ASSERT_TRUE(result.aligned()) << to_string(result.source_viewpoint) << " "
                                  << to_string(result.target_viewpoint) << " " << result.confidence;
    EXPECT_LT(test::rotation_error_degrees(b * a.inverse(), result.target_from_source), 1);
  }
}

/// A scan and where it was seen from: a room from within, a body from outside. Whichever side of a
/// cloud is tried first, it is the wrong one of one of them.
struct SeenScan {
  std::vector<Eigen::Vector3f> points;
  Eigen::Vector3f viewpoint;
};

std::vector<SeenScan> inside_and_outside(unsigned seed) {
  std::vector<Eigen::Vector3f> front;
  for (const Eigen::Vector3f& p : potato(seed))
    if (p.x() > 0.2f) front.push_back(p);
  return {{room_scan(seed), Eigen::Vector3f::Zero()}, {front, Eigen::Vector3f(6, 0, 0)}};
}

PreparedCloud of_unknown_sides(const std::vector<Eigen::Vector3f>& points) {
  PointCloudView view(points);
  view.infer_viewpoint = false;
  return prepare(cpu(), view);
}

PreparedCloud of_known_sides(const SeenScan& scan) {
  PointCloudView view(scan.points);
  view.viewpoints = scan.viewpoint.data();
  view.viewpoint_count = 1;
  return prepare(cpu(), view);
}

TEST(UnknownViewpoint, VerificationTriesBothSidesAsAlignDoes) {
  std::mt19937 random(8);
  for (std::size_t k = 0; k < 2; ++k) {
    SCOPED_TRACE(k);
    const auto source =
                   of_unknown_sides(moved(random_pose(random), inside_and_outside(1)[k].points)),
               target = of_known_sides(inside_and_outside(2)[k]);
    ASSERT_EQ(source.statistics().viewpoint, ViewpointSource::none);
    const RegistrationResult found = align(cpu(), source, target);
    ASSERT_TRUE(found.aligned()) << found.confidence;
    std::vector<UnalignedIsometry3d> poses;
    for (const RegistrationMode& mode : found.modes) poses.push_back(mode.target_from_source);
    const auto verified = verify_poses(cpu(), source, target, poses);
    ASSERT_EQ(verified.size(), found.modes.size());
    for (std::size_t m = 0; m < verified.size(); ++m)
      EXPECT_TRUE(test::same_evidence(verified[m].evidence, found.modes[m].evidence)) << m;
    EXPECT_EQ(verified[0].confidence, found.modes[0].confidence);
  }
}

TEST(UnknownViewpoint, GivenCorrespondencesAreTriedWithBothSides) {
  for (std::size_t k = 0; k < 2; ++k) {
    SCOPED_TRACE(k);
    // The same points, in the same order.
    const SeenScan scan = inside_and_outside(1)[k];
    const auto source = of_unknown_sides(scan.points), target = of_known_sides(scan);
    RegistrationPrior same;
    same.correspondences.emplace();
    for (std::uint32_t i = 0; i < source.size(); ++i) same.correspondences->push_back({i, i});
    const RegistrationResult result = align(cpu(), source, target, RegistrationOptions{}, same);
    ASSERT_TRUE(result.aligned()) << result.confidence;
    // Normals of the wrong side would agree nowhere.
    EXPECT_GT(result.modes[0].evidence.source_overlap, 0.9);
  }
}

TEST(UnknownViewpoint, PreparedPointsAndFrameStay) {
  auto points = room_scan(1);
  const PreparedCloud origin = prepare(cpu(), PointCloudView(points));
  PointCloudView view(points);
  view.infer_viewpoint = false;
  view.origin[0] = 500000;
  const PreparedCloud none = prepare(cpu(), view);
  ASSERT_EQ(none.size(), origin.size());
  EXPECT_EQ(none.voxel_size(), origin.voxel_size());
  EXPECT_EQ(none.statistics().input_points, points.size());
  EXPECT_EQ(none.origin().x(), 500000);
  const auto a = origin.points(), b = none.points();
  // Rows of a few metres, twice rounded to float.
  for (std::size_t k = 0; k < a.size(); ++k) ASSERT_LT((a[k] - b[k]).norm(), 2e-6f);
}

TEST(UnknownViewpoint, ContradictoryNormalsAreRepaired) {
  const auto points = room_scan(1);
  const float sensor[3] = {0, 0, 0};
  PointCloudView seen(points);
  seen.viewpoints = sensor;
  seen.viewpoint_count = 1;
  const PreparedCloud truth = prepare(cpu(), seen);
  // Patches of wrong normals, as a scanner's software leaves them.
  const auto p = truth.points();
  auto n = truth.normals();
  std::size_t wrong = 0;
  for (std::size_t k = 0; k < p.size(); ++k)
    if (std::fmod(std::fabs(p[k].x() * 7 + p[k].z() * 5), 1.0f) < 0.15f) {
      n[k] = -n[k];
      ++wrong;
    }
  PointCloudView given(p);
  given.normals = n.front().data();
  const PreparedCloud repaired = prepare(cpu(), given);
  EXPECT_EQ(repaired.statistics().viewpoint, ViewpointSource::normals);
  EXPECT_NEAR(repaired.statistics().repaired_normals, static_cast<double>(wrong),
              0.1 * static_cast<double>(wrong));
  const auto good = truth.normals();
  given.normals = good.front().data();
  EXPECT_EQ(prepare(cpu(), given).statistics().repaired_normals, 0u);
}

TEST(UnknownViewpoint, EveryThreadCountAndBatchDecidesAlike) {
  std::mt19937 random(9);
  const auto a = moved(random_pose(random), room_scan(1)), b = room_scan(2), c = potato(2);
  const std::vector<PointCloudView> views{PointCloudView(a), PointCloudView(b), PointCloudView(c)};
  const auto batch = prepare_batch(Context::cpu(3), views);
  for (std::size_t k = 0; k < views.size(); ++k) {
    const PreparedCloud alone = prepare(Context::cpu(1), views[k]);
    EXPECT_EQ(alone.statistics().viewpoint, batch[k].statistics().viewpoint);
    EXPECT_EQ(alone.normals(), batch[k].normals());
    EXPECT_EQ(alone.features(), batch[k].features());
  }
}

}  // namespace
}  // namespace gpureg
