// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

#include "gpureg/evaluation.hpp"
#include "gpureg/registration.hpp"
#include "support/data_folder.hpp"
#include "support/plain_ply.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

// Real fragments of the red kitchen, a few pairs with wide overlap each: the paper's preset must
// find them all.
TEST(RealData, RedKitchenPairs) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redkitchen/fragments");
  const evaluation::GroundTruth truth = evaluation::read_ground_truth(folder);
  const RegistrationOptions options = RegistrationOptions::loopsmart();
  const Context context = Context::cpu();
  std::vector<PointCloud> raw;
  std::vector<PointCloudView> views;
  for (int k = 0; k < 4; ++k)
    raw.push_back(test::read_plain_ply(folder + "/cloud_bin_" + std::to_string(k) + ".ply"));
  for (const PointCloud& cloud : raw) views.push_back(cloud.view());
  const std::vector<PreparedCloud> clouds = prepare_batch(context, views, options);
  int tried = 0;
  for (std::size_t k = 0; k < truth.log.size(); ++k) {
    const int i = truth.log[k].i, j = truth.log[k].j;
    if (j > 3) continue;
    const RegistrationResult r = align(context, clouds[static_cast<std::size_t>(j)],
                                       clouds[static_cast<std::size_t>(i)], options);
    EXPECT_TRUE(r.aligned()) << i << " " << j;
    EXPECT_LT(evaluation::redwood_error(truth.log[k].transform, r.target_from_source.matrix(),
                                        truth.information[k].information),
              0.2)
        << i << " " << j;
    ++tried;
  }
  EXPECT_GE(tried, 3);
}

// The 25 synthetic range pairs of the Fast Global Registration paper, each with a random pose: root
// mean square distance of the pairs that are within 0.0125 of each other under the ground truth, in
// data units. FGR's own figures: mean 0.0104, max 0.0193.
TEST(RealData, FgrRangePairs) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "fgr");
  // what `gpureg info` suggests
  RegistrationOptions options{0.02f};
  options.quadruples = 1'000'000;
  const Context context = Context::cpu();
  double mean = 0, worst = 0;
  for (int k = 1; k <= 25; ++k) {
    const std::string pair = folder + "/" + (k < 10 ? "0" : "") + std::to_string(k) + "/";
    const PointCloud target = test::read_plain_ply(pair + "Depth_0000.ply");
    PointCloud source = test::read_plain_ply(pair + "Depth_0001.ply");
    Eigen::Isometry3d truth;
    truth.matrix() = evaluation::read_log(pair + "gt.log").at(0).transform;

    std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> together;
    for (const Eigen::Vector3f& p : source.points) {
      const Eigen::Vector3f moved = (truth * p.cast<double>()).cast<float>();
      const Eigen::Vector3f* nearest = nullptr;
      float best = 0.0125f * 0.0125f;
      for (const Eigen::Vector3f& q : target.points)
        if ((q - moved).squaredNorm() < best) {
          best = (q - moved).squaredNorm();
          nearest = &q;
        }
      if (nearest) together.emplace_back(p.cast<double>(), nearest->cast<double>());
    }
    ASSERT_GT(together.size(), 1000u);

    std::mt19937 random(static_cast<unsigned>(1000 + k));
    const Eigen::Isometry3d displaced = test::random_pose(random);
    source.points = test::moved(displaced, source.points);
    for (Eigen::Vector3f& n : source.normals) n = displaced.linear().cast<float>() * n;
    const RegistrationResult r = align(context, source.view(), target.view(), options);
    EXPECT_TRUE(r.aligned()) << k;
    double sum = 0;
    for (const auto& [p, q] : together)
      sum += (r.target_from_source * (displaced * p) - q).squaredNorm();
    const double rmse = std::sqrt(sum / static_cast<double>(together.size()));
    mean += rmse / 25;
    worst = std::max(worst, rmse);
  }
  std::printf("fgr: mean RMSE %.4f, max %.4f\n", mean, worst);
  EXPECT_LE(mean, 0.0104);
  EXPECT_LE(worst, 0.0193);
}

// A LiDAR scan pair: within 0.3 m and 2 degrees before refinement, which then brings it closer.
TEST(RealData, LidarPair) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "lidar");
  const PointCloud source = test::read_plain_ply(folder + "/source.ply"),
                   target = test::read_plain_ply(folder + "/target.ply");
  Eigen::Isometry3d truth;
  std::ifstream file(folder + "/T_target_source.txt");
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) file >> truth.matrix()(row, column);
  ASSERT_TRUE(file);
  RegistrationOptions options = RegistrationOptions::loopsmart(0.5f);
  options.quadruples = 400'000;
  const Context context = Context::cpu();
  const RegistrationResult coarse = align(context, source.view(), target.view(), options);
  ASSERT_TRUE(coarse.aligned());
  EXPECT_LT(test::translation_error(truth, coarse.target_from_source), 0.3);
  EXPECT_LT(test::rotation_error_degrees(truth, coarse.target_from_source), 2);
  options.refine_iterations = 20;
  const RegistrationResult fine = align(context, source.view(), target.view(), options);
  std::printf("lidar: %.3f m, %.2f degrees; refined %.3f m, %.2f degrees\n",
              test::translation_error(truth, coarse.target_from_source),
              test::rotation_error_degrees(truth, coarse.target_from_source),
              test::translation_error(truth, fine.target_from_source),
              test::rotation_error_degrees(truth, fine.target_from_source));
  EXPECT_LT(test::translation_error(truth, fine.target_from_source), 0.05);
  EXPECT_LT(test::rotation_error_degrees(truth, fine.target_from_source), 0.5);
}

}  // namespace
}  // namespace gpureg
