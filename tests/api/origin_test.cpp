// SPDX-License-Identifier: BSD-3-Clause
// Clouds with large coordinates: rows in float, their origin in double.
#include <gtest/gtest.h>

#include <limits>

#include "gpureg/registration.hpp"
#include "support/expect_error.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

const double kUtmSource[3] = {450123.25, 5412345.5, 310.75};
const double kUtmTarget[3] = {450100.0, 5412300.0, 300.0};

struct ScannedRoom {
  std::vector<Eigen::Vector3f> source, target;
  Eigen::Vector3f source_eye, target_eye;
  Eigen::Isometry3d truth;  // target rows from source rows
};

ScannedRoom scanned_room(unsigned seed) {
  std::mt19937 random(seed);
  ScannedRoom out;
  out.target = test::scan_room(random);
  out.truth = test::random_pose(random);
  out.source = test::moved(out.truth.inverse(), out.target);
  out.target_eye = test::kRoomSensor;
  out.source_eye = (out.truth.inverse() * out.target_eye.cast<double>()).cast<float>();
  return out;
}

PointCloudView view_of(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& eye,
                       const double* origin) {
  PointCloudView view(points);
  view.viewpoints = eye.data();
  view.viewpoint_count = 1;
  if (origin) std::copy(origin, origin + 3, view.origin);
  return view;
}

Eigen::Translation3d translation(const double (&origin)[3]) {
  return Eigen::Translation3d(origin[0], origin[1], origin[2]);
}

TEST(Origin, OfAnOwningCloud) {
  PointCloud cloud;
  cloud.points = {{1, 2, 3}};
  cloud.origin = {450123.25, 5412345.5, 310.75};
  cloud.set_viewpoints({{450124.5, 5412345.5, 310.75}});
  EXPECT_EQ(cloud.viewpoints, (std::vector<Eigen::Vector3f>{{1.25f, 0, 0}}));
  for (int k = 0; k < 3; ++k) EXPECT_EQ(cloud.view().origin[k], kUtmSource[k]);
}

TEST(Origin, MovesPosesAndMomentsAndNothingElse) {
  const ScannedRoom pair = scanned_room(9);
  const Context context = Context::cpu(2);
  const RegistrationResult plain = align(context, view_of(pair.source, pair.source_eye, nullptr),
                                         view_of(pair.target, pair.target_eye, nullptr));
  const RegistrationResult far = align(context, view_of(pair.source, pair.source_eye, kUtmSource),
                                       view_of(pair.target, pair.target_eye, kUtmTarget));
  ASSERT_TRUE(plain.aligned());
  ASSERT_TRUE(far.aligned());
  EXPECT_EQ(far.confidence, plain.confidence);
  ASSERT_EQ(far.modes.size(), plain.modes.size());
  for (std::size_t k = 0; k < far.modes.size(); ++k) {
    const Eigen::Isometry3d expected = translation(kUtmTarget) *
                                       Eigen::Isometry3d(plain.modes[k].target_from_source) *
                                       translation(kUtmSource).inverse();
    EXPECT_EQ(far.modes[k].confidence, plain.modes[k].confidence);
    // Coordinates of millions of metres have 1e-9 in double; products of three of them some more.
    EXPECT_LT((far.modes[k].target_from_source.matrix() - expected.matrix()).norm(), 1e-7);
  }
  EXPECT_EQ(far.source_moments.count, plain.source_moments.count);
  const Eigen::Vector3d middle =
      far.source_moments.sum / static_cast<double>(far.source_moments.count);
  const Eigen::Vector3d plain_middle =
      plain.source_moments.sum / static_cast<double>(plain.source_moments.count);
  EXPECT_LT((middle - translation(kUtmSource) * plain_middle).norm(), 1e-7);
}

TEST(Origin, PreparedCloudsKeepIt) {
  const ScannedRoom pair = scanned_room(10);
  const PreparedCloud cloud =
      prepare(Context::cpu(1), view_of(pair.target, pair.target_eye, kUtmTarget));
  EXPECT_EQ(cloud.origin(), Eigen::Vector3d(kUtmTarget[0], kUtmTarget[1], kUtmTarget[2]));
  EXPECT_LT(cloud.points().front().norm(), 100) << "rows, relative to the origin";
  EXPECT_EQ(prepare(Context::cpu(1), view_of(pair.target, pair.target_eye, nullptr)).origin(),
            Eigen::Vector3d::Zero());
}

TEST(Origin, PriorsAreInTheFramesOfTheClouds) {
  const ScannedRoom pair = scanned_room(11);
  const Context context = Context::cpu(2);
  const RegistrationOptions options{0.05f};
  const PreparedCloud source = prepare(context, view_of(pair.source, pair.source_eye, kUtmSource)),
                      target = prepare(context, view_of(pair.target, pair.target_eye, kUtmTarget));
  RegistrationPrior prior;
  prior.pose.emplace();
  prior.pose->max_rotation = 10;
  prior.pose->max_translation = 0.5;
  prior.pose->target_from_source =
      translation(kUtmTarget) * pair.truth * translation(kUtmSource).inverse();
  EXPECT_TRUE(align(context, source, target, options, prior).aligned());
  prior.pose->target_from_source = pair.truth;
  EXPECT_EQ(align(context, source, target, options, prior).reason,
            RegistrationReason::contradicts_prior);
}

TEST(Origin, MustBeFinite) {
  PointCloudView view;
  view.origin[1] = std::numeric_limits<double>::quiet_NaN();
  test::expect_error<InvalidArgument>([&] { view.validate(); }, {"origin"});
}

}  // namespace
}  // namespace gpureg
