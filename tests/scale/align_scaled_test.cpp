// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "gpureg/error.hpp"
#include "gpureg/registration/scale.hpp"
#include "gpureg/voxel_size.hpp"
#include "support/expect_error.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

std::vector<Eigen::Vector3f> times(double factor, std::vector<Eigen::Vector3f> points) {
  for (Eigen::Vector3f& p : points) p = (factor * p.cast<double>()).cast<float>();
  return points;
}

/// One of four points: a short ladder.
std::vector<Eigen::Vector3f> thinned(const std::vector<Eigen::Vector3f>& points) {
  std::vector<Eigen::Vector3f> out;
  for (std::size_t k = 0; k < points.size(); k += 4) out.push_back(points[k]);
  return out;
}

class UnknownScale : public testing::Test {
 protected:
  UnknownScale() : options(RegistrationOptions{0.1f}) {
    std::mt19937 random(11);
    target = thinned(test::scan_room(random));
    truth = test::random_pose(random);
    source = test::moved(truth.inverse(), thinned(test::scan_room(random)));
  }
  /// The target is seen through `similarity` of a source that was divided by the factor.
  void expect_truth(const ScaledResult& result, double factor) const {
    EXPECT_TRUE(result.aligned()) << explain(result);
    EXPECT_EQ(result.scale_status, ScaleStatus::found);
    EXPECT_NEAR(result.scale / factor, 1, 0.01);
    EXPECT_LT(result.scale_deviation, 0.01);
    const Eigen::Matrix4d found = result.similarity();
    EXPECT_NEAR(std::cbrt(found.topLeftCorner<3, 3>().determinant()), result.scale,
                1e-9 * result.scale);
    for (std::size_t k = 0; k < source.size(); k += 97) {
      const Eigen::Vector3d p = source[k].cast<double>();
      const Eigen::Vector3d q = (found * (p / factor).homogeneous()).head<3>();
      EXPECT_LT((q - truth * p).norm(), 0.06);
    }
  }

  Context context = Context::cpu(2);
  RegistrationOptions options;
  std::vector<Eigen::Vector3f> source, target;
  Eigen::Isometry3d truth;
};

TEST_F(UnknownScale, AutoTakesTheVoxelSizeThatBothCloudsSuggest) {
  // Of half of the room alone the voxels would be others.
  std::vector<Eigen::Vector3f> half;
  for (const Eigen::Vector3f& p : target)
    if (p.x() < 1) half.push_back(p);
  const auto scaled = times(1 / 3.0, source);
  const PointCloudView a(scaled), b(half);
  const float alone = suggest_voxel_size({b}).voxel_size;
  const ScaledResult result = align_scaled_auto(context, a, b, {2, 5});
  expect_truth(result, 3);
  EXPECT_GT(result.result.voxel_size, 1.1f * alone);
  const ScaledResult first = align_scaled(context, a, b, {2, 5}, RegistrationOptions{alone}),
                     second = align_scaled(context, a, b, {first.scale / 1.05, first.scale * 1.05},
                                           RegistrationOptions{result.result.voxel_size});
  EXPECT_EQ(test::bytes(result.result), test::bytes(second.result));
}

TEST_F(UnknownScale, AutoWithAKnownScaleIsRegistrationOfBoth) {
  const PointCloudView a(source), b(target);
  const ScaledResult known = align_scaled_auto(context, a, b, ScaleRange::known(1));
  EXPECT_EQ(known.scale_status, ScaleStatus::known);
  EXPECT_EQ(test::bytes(known.result), test::bytes(align(context, a, b)));
}

TEST_F(UnknownScale, AutoSaysWhatIsWrong) {
  const PointCloudView a(source), b(target);
  EXPECT_THROW(align_scaled_auto(context, a, b, {5, 2}), InvalidArgument);
  EXPECT_FALSE(align_scaled_auto(context, PointCloudView(), b).aligned());
  EXPECT_FALSE(align_scaled_auto(context, a, PointCloudView()).aligned());
}

TEST_F(UnknownScale, IsFound) {
  const auto scaled = times(1 / 0.05, source);
  expect_truth(align_scaled(context, PointCloudView(scaled), PointCloudView(target), {}, options),
               0.05);
}

TEST_F(UnknownScale, IsFoundInARange) {
  const auto scaled = times(1 / 20.0, source);
  expect_truth(
      align_scaled(context, PointCloudView(scaled), PointCloudView(target), {16, 25}, options), 20);
  const ScaledResult outside =
      align_scaled(context, PointCloudView(scaled), PointCloudView(target), {0.2, 0.4}, options);
  EXPECT_FALSE(outside.aligned());
}

TEST_F(UnknownScale, HasTheSameBitsOnAnyThreadsAndInABatch) {
  const auto scaled = times(1 / 0.7, source);
  const std::vector<PointCloudView> clouds{PointCloudView(scaled), PointCloudView(target)};
  const ScaledResult one = align_scaled(Context::cpu(1), clouds[0], clouds[1], {0.5, 1.5}, options);
  const std::vector<ScaledResult> batch =
      align_scaled_batch(Context::cpu(3), clouds, {{1, 0}, {0, 1}}, {0.5, 1.5}, options);
  EXPECT_EQ(one.scale, batch[1].scale);
  EXPECT_EQ(one.scale_deviation, batch[1].scale_deviation);
  EXPECT_EQ(one.information, batch[1].information);
  EXPECT_EQ(test::bytes(one.result), test::bytes(batch[1].result));
}

TEST_F(UnknownScale, IsThatOfAlignWhereItIsKnown) {
  const ScaledResult known = align_scaled(context, PointCloudView(source), PointCloudView(target),
                                          ScaleRange::known(1), options);
  EXPECT_EQ(known.scale_status, ScaleStatus::known);
  EXPECT_EQ(test::bytes(known.result),
            test::bytes(align(context, PointCloudView(source), PointCloudView(target), options)));
  const auto scaled = times(1 / 4.0, source);
  const ScaledResult four = align_scaled(context, PointCloudView(scaled), PointCloudView(target),
                                         ScaleRange::known(4), options);
  EXPECT_TRUE(four.aligned());
  EXPECT_EQ(four.scale, 4);
}

TEST_F(UnknownScale, ScalesViewpointsAndOrigin) {
  PointCloud cloud, seen;
  cloud.points = times(1 / 2.0, source);
  cloud.set_viewpoints({truth.inverse() * test::kRoomSensor.cast<double>() / 2});
  cloud.origin = {500, -200, 30};
  for (Eigen::Vector3f& v : cloud.viewpoints)
    v = (truth.inverse() * test::kRoomSensor.cast<double>() / 2).cast<float>();
  seen.points = target;
  seen.set_viewpoints({test::kRoomSensor.cast<double>()});
  const ScaledResult result = align_scaled(context, cloud.view(), seen.view(), {1.5, 2.5}, options);
  ASSERT_TRUE(result.aligned()) << explain(result);
  EXPECT_NEAR(result.scale, 2, 0.02);
  const Eigen::Vector3d p = cloud.points[500].cast<double>() + cloud.origin;
  const Eigen::Vector3d q = (result.similarity() * p.homogeneous()).head<3>();
  EXPECT_LT((q - truth * source[500].cast<double>()).norm(), 0.1);
}

// Three planes through one point look the same at every scale.
TEST_F(UnknownScale, OfACornerIsNotObservable) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit;
  const auto corner = [&] {
    std::vector<Eigen::Vector3f> points;
    for (int k = 0; k < 9000; ++k) {
      Eigen::Vector3f p(2 * unit(random), 1.7f * unit(random), 1.5f * unit(random));
      p[k % 3] = 0;
      points.push_back(p);
    }
    return points;
  };
  const auto a = corner(), b = corner();
  const ScaledResult result =
      align_scaled(context, PointCloudView(a), PointCloudView(b), {0.5, 2}, options);
  EXPECT_FALSE(result.aligned());
  EXPECT_NE(result.scale_status, ScaleStatus::found);
}

TEST_F(UnknownScale, IsNoneWithoutPoints) {
  const ScaledResult result =
      align_scaled(context, PointCloudView(), PointCloudView(target), {}, options);
  EXPECT_FALSE(result.aligned());
  EXPECT_EQ(result.scale_status, ScaleStatus::none);
  EXPECT_EQ(result.result.reason, RegistrationReason::too_few_source_points);
  const ScaledResult other =
      align_scaled(context, PointCloudView(source), PointCloudView(), {}, options);
  EXPECT_EQ(other.result.reason, RegistrationReason::too_few_target_points);
}

TEST_F(UnknownScale, RefusesWrongRanges) {
  const auto refused = [&](double least, double most, std::initializer_list<std::string> text) {
    test::expect_error<InvalidArgument>(
        [&] {
          align_scaled(context, PointCloudView(source), PointCloudView(target), {least, most},
                       options);
        },
        text);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused(0, 2, {"scale.least is 0"});
  refused(-1, 2, {"scale.least is -1"});
  refused(nan, 2, {"scale.least is nan"});
  refused(1, std::numeric_limits<double>::infinity(), {"scale.most is inf"});
  refused(3, 2, {"scale is 3 to 2", "smaller end first"});
  options.prepare.downsample = false;
  refused(1, 2, {"prepare.downsample is false"});
  options.method = RegistrationMethod::quadruples;
  refused(1, 2, {"method"});
}

TEST_F(UnknownScale, StopsABatch) {
  ScaledCallbacks callbacks;
  callbacks.should_stop = [] { return true; };
  const auto results = align_scaled_batch(context, {PointCloudView(source), PointCloudView(target)},
                                          {{0, 1}}, {}, options, callbacks);
  EXPECT_EQ(results[0].result.status, RegistrationStatus::skipped);
  test::expect_error<InvalidArgument>(
      [&] { align_scaled_batch(context, {PointCloudView(source)}, {{0, 1}}, {}, options); },
      {"pairs[0]", "1 clouds"});
}

}  // namespace
}  // namespace gpureg
