// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <set>
#include <tuple>
#include <vector>

#include "calibration/halves.hpp"
#include "calibration/labels.hpp"
#include "gpureg/calibration.hpp"
#include "support/expect_error.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using calibration::Halves;
using calibration::halves_of;

constexpr float kVoxel = 0.1f;
constexpr int kScans = 8;

/// Scans of one room from one place, each in a frame of its own and without a slice.
struct Scans {
  Scans() {
    std::mt19937 random(11);
    for (int k = 0; k < kScans; ++k) {
      poses.push_back(test::random_pose(random));
      std::vector<Eigen::Vector3f> points = test::scan_room(random);
      // A quarter of the points fills the voxels, too.
      std::vector<Eigen::Vector3f> some;
      for (std::size_t p = 0; p < points.size(); p += 4) some.push_back(points[p]);
      points = some;
      const float begin = 0.25f * static_cast<float>(k);
      points.erase(std::remove_if(points.begin(), points.end(),
                                  [&](const Eigen::Vector3f& p) {
                                    return p.x() > begin && p.x() < begin + 0.5f;
                                  }),
                   points.end());
      const Eigen::Isometry3d scan_from_room = Eigen::Isometry3d(poses.back().matrix()).inverse();
      clouds.push_back(test::moved(scan_from_room, points));
      eyes.push_back((scan_from_room * test::kRoomSensor.cast<double>()).cast<float>());
    }
  }
  std::vector<PointCloudView> views() const {
    std::vector<PointCloudView> out;
    for (int k = 0; k < kScans; ++k) {
      out.emplace_back(clouds[k]);
      out.back().viewpoints = eyes[k].data();
      out.back().viewpoint_count = 1;
    }
    return out;
  }
  std::vector<std::vector<Eigen::Vector3f>> clouds;
  std::vector<Eigen::Vector3f> eyes;
  std::vector<UnalignedIsometry3d> poses;  ///< world_from_cloud
};

const Scans& scans() {
  static const Scans scans;
  return scans;
}

RegistrationOptions fast() { return RegistrationOptions{kVoxel, 2}; }

CalibrationOptions some_pairs() {
  CalibrationOptions options;
  options.self_pairs = 32;
  return options;
}

CalibrationResult calibrated(unsigned threads, const std::vector<UnalignedIsometry3d>& poses = {}) {
  return calibrate(Context::cpu(threads), scans().views(), fast(), some_pairs(), poses);
}

const CalibrationResult& by_loops() {
  static const CalibrationResult result = calibrated(2);
  return result;
}

TEST(Calibrate, EndToEndByLoops) {
  const CalibrationResult& result = by_loops();
  EXPECT_TRUE(result.enough_samples);
  EXPECT_FALSE(result.stopped);
  EXPECT_EQ(result.one_scan.pairs, 32u);
  EXPECT_EQ(result.loop_consistency.pairs, 28u);
  EXPECT_EQ(result.trajectory.pairs, 0u);
  // One in four pairs of one scan has no overlap.
  EXPECT_LE(result.one_scan.correct, 24u);
  EXPECT_GE(result.one_scan.correct, 8u);
  // Each pair is in six loops.
  EXPECT_GE(result.loop_consistency.samples, 20u);
  EXPECT_GE(result.loop_consistency.correct, 20u);
  EXPECT_EQ(result.samples.size(), result.one_scan.samples + result.loop_consistency.samples);
  const CalibrationFit again = fit_calibration(result.samples);
  EXPECT_EQ(again.calibration.slope, result.calibration.slope);
  EXPECT_EQ(again.calibration.offset, result.calibration.offset);
  EXPECT_EQ(again.error_after, result.error_after);
  RegistrationOptions options = fast();
  options.calibration = result.calibration;
  options.validate();
}

TEST(Calibrate, SameBitsForAnyNumberOfThreads) {
  const CalibrationResult &one = by_loops(), three = calibrated(3);
  EXPECT_EQ(one.calibration.slope, three.calibration.slope);
  EXPECT_EQ(one.calibration.offset, three.calibration.offset);
  ASSERT_EQ(one.samples.size(), three.samples.size());
  for (std::size_t k = 0; k < one.samples.size(); ++k) {
    EXPECT_EQ(one.samples[k].confidence, three.samples[k].confidence);
    EXPECT_EQ(one.samples[k].correct, three.samples[k].correct);
  }
}

TEST(Calibrate, OwnCalibrationOfTheOptionsDoesNotCount) {
  RegistrationOptions options = fast();
  options.calibration = {0.4, 3};
  CalibrationOptions few;
  few.self_pairs = 2;
  few.scan_pairs = 0;
  const CalibrationResult result = calibrate(Context::cpu(2), scans().views(), options, few);
  ASSERT_EQ(result.samples.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_EQ(result.samples[k].confidence, by_loops().samples[k].confidence);
}

TEST(Calibrate, PosesDecide) {
  const CalibrationResult result = calibrated(2, scans().poses);
  EXPECT_EQ(result.loop_consistency.pairs, 0u);
  EXPECT_EQ(result.trajectory.pairs, 28u);
  EXPECT_GE(result.trajectory.correct, 24u);
  // A false pose of one scan makes its seven pairs false.
  std::vector<UnalignedIsometry3d> poses = scans().poses;
  poses[3].translation().x() += 1;
  const CalibrationResult shifted = calibrated(2, poses);
  EXPECT_LE(shifted.trajectory.correct, result.trajectory.correct - 5);
  EXPECT_LT(shifted.calibration(0.9), result.calibration(0.9));
}

TEST(Calibrate, TooFewDecidedPairsGiveTheIdentity) {
  CalibrationOptions options;
  options.self_pairs = 8;
  options.scan_pairs = 0;
  const CalibrationResult result = calibrate(Context::cpu(2), scans().views(), fast(), options);
  EXPECT_GT(result.one_scan.samples, 0u);
  EXPECT_FALSE(result.enough_samples);
  EXPECT_TRUE(result.calibration.is_identity());
  EXPECT_EQ(result.error_before, result.error_after);
  for (const std::size_t count : {0u, 1u}) {
    std::vector<PointCloudView> views = scans().views();
    views.resize(count);
    EXPECT_TRUE(calibrate(Context::cpu(1), views, fast(), options).calibration.is_identity());
  }
  // Empty clouds are left out.
  std::vector<PointCloudView> views = scans().views();
  views.resize(2);
  views.emplace_back();
  EXPECT_EQ(calibrate(Context::cpu(1), views, fast(), options).loop_consistency.pairs, 0u);
}

TEST(Calibrate, AtMostSoManyPairs) {
  CalibrationOptions options;
  options.self_pairs = 0;
  options.scan_pairs = 7;  // one group of four scans
  std::vector<UnalignedIsometry3d> poses = scans().poses;
  const auto pairs = [&] {
    return calibrate(Context::cpu(2), scans().views(), fast(), options, poses).trajectory.pairs;
  };
  EXPECT_EQ(pairs(), 6u);
  // Without a pose, a scan takes no part.
  poses[3] = no_pose();
  EXPECT_EQ(pairs(), 3u);
}

TEST(Calibrate, ProgressAndStop) {
  CalibrationCallbacks callbacks;
  std::vector<std::size_t> seen;
  callbacks.on_progress = [&](std::size_t done, std::size_t total) {
    EXPECT_EQ(total, 60u);
    if (!seen.empty()) EXPECT_GT(done, seen.back());
    seen.push_back(done);
  };
  calibrate(Context::cpu(2), scans().views(), fast(), some_pairs(), {}, callbacks);
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen.back(), 60u);
  for (const std::size_t after : {0u, 3u}) {
    std::size_t polled = 0;
    callbacks.on_progress = nullptr;
    callbacks.should_stop = [&] { return polled++ >= after; };
    const CalibrationResult stopped =
        calibrate(Context::cpu(2), scans().views(), fast(), some_pairs(), {}, callbacks);
    EXPECT_TRUE(stopped.stopped);
    EXPECT_TRUE(stopped.calibration.is_identity());
    EXPECT_TRUE(stopped.samples.empty());
    EXPECT_EQ(polled, after + 1);
  }
}

TEST(Calibrate, BadArgumentsAreNamed) {
  const Context context = Context::cpu(1);
  const auto views = scans().views();
  test::expect_error<InvalidArgument>(
      [&] { calibrate(context, views, RegistrationOptions::loopsmart(kVoxel)); }, {"method"});
  CalibrationOptions options;
  options.max_error = 0;
  test::expect_error<InvalidArgument>([&] { calibrate(context, views, fast(), options); },
                                      {"max_error is 0"});
  options = {};
  options.self_pairs = 2'000'000;
  test::expect_error<InvalidArgument>([&] { calibrate(context, views, fast(), options); },
                                      {"self_pairs"});
  std::vector<UnalignedIsometry3d> poses = scans().poses;
  poses[2].matrix()(0, 0) = 3;
  test::expect_error<InvalidArgument>([&] { calibrate(context, views, fast(), {}, poses); },
                                      {"world_from_cloud[2]"});
  poses.pop_back();
  test::expect_error<InvalidArgument>([&] { calibrate(context, views, fast(), {}, poses); },
                                      {"7 poses", "8 clouds"});
}

using Row = std::tuple<float, float, float>;
Row row(const Eigen::Vector3f& p) { return {p.x(), p.y(), p.z()}; }

TEST(Halves, AreDisjointPartsOfTheScanUnderOnePose) {
  const PointCloudView scan = scans().views()[0];
  const PreparedCloud prepared = prepare(Context::cpu(1), scan, fast());
  std::set<Row> all;
  for (const Eigen::Vector3f& p : scans().clouds[0]) all.insert(row(p));
  for (std::uint32_t number = 0; number < 8; ++number) {
    const Halves halves = halves_of(scan, prepared, 0.0, 0.4, 1, number);
    ASSERT_GT(halves.source.points.size(), 1000u);
    ASSERT_GT(halves.target.points.size(), 1000u);
    std::set<Row> source;
    for (const Eigen::Vector3f& p : halves.source.points) {
      EXPECT_EQ(all.count(row(p)), 1u);
      source.insert(row(p));
    }
    // Points of the target come back to points of the scan that the source lacks.
    std::vector<Eigen::Vector3f> back =
        test::moved(halves.target_from_source.inverse(), halves.target.points);
    for (std::size_t k = 0; k < back.size(); k += 97) {
      float nearest = 1, in_source = 1;
      for (const Eigen::Vector3f& p : scans().clouds[0]) {
        const float d = (p - back[k]).norm();
        nearest = std::min(nearest, d);
        if (source.count(row(p)) > 0) in_source = std::min(in_source, d);
      }
      EXPECT_LT(nearest, 1e-5f);  // floats of a few metres
      EXPECT_GT(in_source, nearest);
    }
    ASSERT_EQ(halves.source.viewpoints.size(), 1u);
    EXPECT_EQ(halves.source.viewpoints[0], scans().eyes[0]);
    EXPECT_LT((halves.target_from_source * scans().eyes[0].cast<double>() -
               halves.target.viewpoints[0].cast<double>())
                  .norm(),
              1e-5);
  }
}

double overlap_of(const Halves& halves) {
  const auto back = test::moved(halves.target_from_source.inverse(), halves.target.points);
  std::set<std::tuple<long, long, long>> cells;
  const auto cell = [](const Eigen::Vector3f& p) {
    return std::make_tuple(std::lround(p.x() / kVoxel), std::lround(p.y() / kVoxel),
                           std::lround(p.z() / kVoxel));
  };
  for (const Eigen::Vector3f& p : back) cells.insert(cell(p));
  double inside = 0;
  for (const Eigen::Vector3f& p : halves.source.points) inside += double(cells.count(cell(p)));
  return inside / static_cast<double>(halves.source.points.size());
}

TEST(Halves, OverlapsVary) {
  const PointCloudView scan = scans().views()[0];
  const PreparedCloud prepared = prepare(Context::cpu(1), scan, fast());
  std::vector<double> overlaps;
  for (std::uint32_t number = 0; number < 40; ++number) {
    const double overlap = overlap_of(halves_of(scan, prepared, 0, 0.4, 1, number));
    if (number % calibration::kWithoutOverlap == calibration::kWithoutOverlap - 1)
      EXPECT_LT(overlap, 0.08) << number;  // cells on the border
    else
      overlaps.push_back(overlap);
  }
  std::sort(overlaps.begin(), overlaps.end());
  EXPECT_LT(overlaps.front(), 0.25);
  EXPECT_GT(overlaps.front(), 0.05);
  EXPECT_GT(overlaps.back(), 0.7);
  EXPECT_LT(overlaps.back(), 0.97);
}

TEST(Halves, TheNoiseHasItsSize) {
  const PointCloudView scan = scans().views()[0];
  const PreparedCloud prepared = prepare(Context::cpu(1), scan, fast());
  const Halves clean = halves_of(scan, prepared, 0, 0.4, 1, 0),
               noisy = halves_of(scan, prepared, 0.01, 0.4, 1, 0);
  ASSERT_EQ(clean.source.points.size(), noisy.source.points.size());
  double sum = 0;
  for (std::size_t k = 0; k < clean.source.points.size(); ++k)
    sum += static_cast<double>((noisy.source.points[k] - clean.source.points[k]).squaredNorm());
  // White and smooth noise of 0.01 along each axis; three waves vary by a third.
  const double rms = std::sqrt(sum / (3.0 * static_cast<double>(clean.source.points.size())));
  EXPECT_GT(rms, 0.0115);
  EXPECT_LT(rms, 0.0175);
  EXPECT_NE(halves_of(scan, prepared, 0, 0.4, 2, 0).target_from_source.matrix(),
            clean.target_from_source.matrix());
}

TEST(Halves, NormalsAndFeaturesFollow) {
  PointCloudView scan(scans().clouds[0]);
  std::vector<Eigen::Vector3f> normals(scan.size);
  std::vector<float> features;
  for (std::size_t k = 0; k < scan.size; ++k) {
    normals[k] = scans().clouds[0][k].normalized();
    features.insert(features.end(), {scans().clouds[0][k].x(), 7.0f});
  }
  scan.normals = normals.front().data();
  scan.features = features.data();
  scan.feature_dimension = 2;
  const PreparedCloud prepared = prepare(Context::cpu(1), scan, fast());
  const Halves halves = halves_of(scan, prepared, 0, 0.4, 1, 0);
  const PointCloudView view = halves.target.view();
  view.validate();
  EXPECT_EQ(view.feature_dimension, 2u);
  ASSERT_EQ(halves.target.features.size(), 2 * halves.target.points.size());
  const Eigen::Isometry3d back = halves.target_from_source.inverse();
  for (std::size_t k = 0; k < halves.target.points.size(); k += 50) {
    const Eigen::Vector3d p = back * halves.target.points[k].cast<double>();
    const Eigen::Vector3d n = back.linear() * halves.target.normals[k].cast<double>();
    EXPECT_LT((n - p.normalized()).norm(), 1e-4);
    EXPECT_NEAR(static_cast<double>(halves.target.features[2 * k]), p.x(), 1e-4);
    EXPECT_EQ(halves.target.features[2 * k + 1], 7.0f);
  }
}

TEST(Labels, LoopsDecideFromEvenOdds) {
  // Eight clouds in one place; pose 0-1 is a metre off. A weak pair is called correct, and a
  // confident false one is not.
  std::vector<Pair> pairs;
  std::vector<RegistrationResult> results;
  for (std::uint32_t i = 0; i < 8; ++i)
    for (std::uint32_t j = i + 1; j < 8; ++j) {
      RegistrationMode mode;
      mode.confidence = i == 2 && j == 3 ? 0.05 : 0.95;
      if (j == 1) mode.target_from_source.translation().x() = 1;
      RegistrationResult result;
      result.target_from_source = mode.target_from_source;
      result.confidence = mode.confidence;
      result.modes = {mode};
      pairs.push_back({j, i});
      results.push_back(result);
    }
  const auto verdicts = calibration::verdicts_of_loops(pairs, results, 0.05f);
  EXPECT_EQ(verdicts[0], std::optional<bool>(false));
  std::size_t correct = 0;
  for (std::size_t p = 1; p < pairs.size(); ++p) {
    EXPECT_NE(verdicts[p], std::optional<bool>(false)) << p;
    correct += verdicts[p].value_or(false);
    if (pairs[p].target == 2 && pairs[p].source == 3)
      EXPECT_EQ(verdicts[p], std::optional<bool>(true));
  }
  EXPECT_GE(correct, 20u);
  // Two clouds have no loop.
  EXPECT_FALSE(calibration::verdicts_of_loops({pairs[0]}, {results[0]}, 0.05f)[0].has_value());
}

TEST(Labels, EquivalentPosesAreCorrect) {
  RegistrationResult result;
  result.modes.resize(2);
  result.modes[0].confidence = 0.6;
  result.modes[0].target_from_source.translation().x() = 1;
  result.modes[1].confidence = 0.3;
  result.target_from_source = result.modes[0].target_from_source;
  result.confidence = 0.6;
  const std::vector<Eigen::Vector3f> points = {{0, 0, 0}, {1, 0, 0}};
  const Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  EXPECT_FALSE(calibration::is_correct(result, truth, points, 0.2));
  EXPECT_EQ(calibration::confidence_of(result), 0.6);
  result.modes[1].equivalent = true;
  EXPECT_TRUE(calibration::is_correct(result, truth, points, 0.2));
  EXPECT_NEAR(calibration::confidence_of(result), 0.9, 1e-15);
}

}  // namespace
}  // namespace gpureg
