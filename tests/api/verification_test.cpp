// SPDX-License-Identifier: BSD-3-Clause
// Poses of other methods get the evidence and the confidence that align() would give them.
#include "gpureg/verification.hpp"

#include <gtest/gtest.h>

#include "gpureg/evaluation.hpp"
#include "support/data_folder.hpp"
#include "support/expect_error.hpp"
#include "support/plain_ply.hpp"
#include "support/same_evidence.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using test::same_evidence;

/// What lies beyond this distance from the first point is gone: fewer prepared points.
std::vector<Eigen::Vector3f> cut_off(const std::vector<Eigen::Vector3f>& points) {
  constexpr float kKept = 2.8f;
  std::vector<Eigen::Vector3f> out;
  for (const Eigen::Vector3f& p : points)
    if ((p - points.front()).norm() < kKept) out.push_back(p);
  return out;
}

/// Two scans of a room. fewer: 1, the source is the smaller cloud; 2, the target is.
struct Scene {
  explicit Scene(unsigned seed, std::size_t fewer) {
    std::mt19937 random(seed);
    std::vector<Eigen::Vector3f> b = test::scan_room(random);
    truth = test::random_pose(random);
    std::vector<Eigen::Vector3f> a = test::moved(truth.inverse(), test::scan_room(random));
    if (fewer == 1) a = cut_off(a);
    if (fewer == 2) b = cut_off(b);
    const Eigen::Vector3f eye = test::kRoomSensor;
    const Eigen::Vector3f moved_eye = (truth.inverse() * eye.cast<double>()).cast<float>();
    PointCloudView source_view(a), target_view(b);
    source_view.viewpoints = moved_eye.data();
    target_view.viewpoints = eye.data();
    source_view.viewpoint_count = target_view.viewpoint_count = 1;
    source = prepare(context, source_view);
    target = prepare(context, target_view);
  }
  Context context = Context::cpu(2);
  Eigen::Isometry3d truth;
  PreparedCloud source, target;
};

std::vector<UnalignedIsometry3d> poses_of(const RegistrationResult& result) {
  std::vector<UnalignedIsometry3d> out;
  for (const RegistrationMode& mode : result.modes) out.push_back(mode.target_from_source);
  return out;
}

TEST(Verification, ModesOfAlignGetTheirEvidenceAndConfidence) {
  for (const std::size_t fewer : {0u, 1u, 2u}) {
    SCOPED_TRACE(fewer);
    const Scene scene(4, fewer);
    const RegistrationResult found = align(scene.context, scene.source, scene.target);
    ASSERT_TRUE(found.aligned());
    const auto verified = verify_poses(scene.context, scene.source, scene.target, poses_of(found));
    ASSERT_EQ(verified.size(), found.modes.size());
    for (std::size_t k = 0; k < verified.size(); ++k) {
      EXPECT_TRUE(same_evidence(verified[k].evidence, found.modes[k].evidence)) << k;
      EXPECT_EQ(verified[k].target_from_source.matrix(),
                found.modes[k].target_from_source.matrix());
    }
    EXPECT_EQ(verified[0].confidence, found.modes[0].confidence);
    EXPECT_EQ(verified[0].inlier_ratio, found.inlier_ratio);
    EXPECT_EQ(verified[0].inlier_rmse, found.inlier_rmse);
    EXPECT_EQ(verified[0].source_moments.count, found.source_moments.count);
    EXPECT_EQ(verified[0].target_moments.outer, found.target_moments.outer);
  }
}

TEST(Verification, TellsTheTruthFromAPoseBeside) {
  const Scene scene(5, 0);
  UnalignedIsometry3d beside = scene.truth;
  beside.translation() += Eigen::Vector3d(0.5, 0, 0);
  const auto verified =
      verify_poses(scene.context, scene.source, scene.target, {scene.truth, beside});
  EXPECT_GT(verified[0].confidence, 0.9);
  EXPECT_LT(verified[1].confidence, 0.1);
  VerificationOptions alone;
  alone.search_alternatives = false;
  const auto fast =
      verify_poses(scene.context, scene.source, scene.target, {scene.truth, beside}, {}, alone);
  EXPECT_TRUE(same_evidence(fast[0].evidence, verified[0].evidence));
  EXPECT_GT(fast[0].confidence, 0.9);
  EXPECT_LT(fast[1].confidence, 0.1);
}

TEST(Verification, RefinesWhereAsked) {
  const Scene scene(6, 0);
  UnalignedIsometry3d rough = scene.truth;
  rough.translation() += Eigen::Vector3d(0.03, -0.02, 0.02);
  VerificationOptions refined;
  refined.refine = true;
  const auto out =
      verify_poses(scene.context, scene.source, scene.target, {rough}, {}, refined).at(0);
  // The scans share surfaces with 1 mm of noise; ICP of 5 cm clouds is good to some millimetres.
  EXPECT_LT((out.target_from_source.translation() - scene.truth.translation()).norm(), 0.01);
  EXPECT_GT(out.confidence, 0.9);
  const auto given = verify_poses(scene.context, scene.source, scene.target, {rough}).at(0);
  EXPECT_EQ(given.target_from_source.matrix(), rough.matrix());
  EXPECT_GT(out.evidence.source_residual, 0);
  EXPECT_LT(out.inlier_rmse, given.inlier_rmse);
}

TEST(Verification, ManyPosesAndPairsAreTheSameAsOneByOne) {
  const Scene scene(7, 0);
  std::mt19937 random(7);
  std::vector<UnalignedIsometry3d> poses(70, scene.truth);
  for (UnalignedIsometry3d& pose : poses)
    pose.translation() += test::random_pose(random, 0.2).translation();
  VerificationOptions options;
  options.search_alternatives = false;
  const std::vector<PreparedCloud> clouds{scene.source, scene.target};
  const auto batch = verify_poses_batch(scene.context, clouds, {{0, 1}, {1, 0}, {0, 1}},
                                        {poses, {}, {poses[3]}}, {}, options);
  ASSERT_EQ(batch.size(), 3u);
  ASSERT_EQ(batch[0].size(), 70u);
  EXPECT_TRUE(batch[1].empty());
  EXPECT_TRUE(same_evidence(batch[2].at(0).evidence, batch[0][3].evidence));
  const auto again =
      verify_poses(Context::cpu(1), scene.source, scene.target, {poses[69]}, {}, options);
  EXPECT_TRUE(same_evidence(again.at(0).evidence, batch[0][69].evidence));
}

TEST(Verification, BadInputIsNamed) {
  const Scene scene(8, 0);
  UnalignedIsometry3d bad = scene.truth;
  bad.linear() *= 1.1;
  const std::vector<PreparedCloud> clouds{scene.source, scene.target};
  const auto refused = [&](std::vector<Pair> pairs,
                           std::vector<std::vector<UnalignedIsometry3d>> poses,
                           std::initializer_list<std::string> words) {
    test::expect_error<InvalidArgument>(
        [&] { verify_poses_batch(scene.context, clouds, pairs, poses); }, words);
  };
  refused({{0, 1}}, {{scene.truth, bad}}, {"poses[0][1]", "rigid"});
  refused({{0, 1}}, {{no_pose()}}, {"poses[0][0]", "rigid"});
  bad.matrix() = scene.truth.matrix().transpose();
  refused({{0, 1}}, {{bad}}, {"poses[0][0]", "last row", "looks transposed"});
  refused({{0, 1}}, {}, {"poses", "0", "1"});
  refused({{0, 2}}, {{}}, {"pairs[0]", "2"});
  test::expect_error<InvalidArgument>(
      [&] { verify_poses(scene.context, PreparedCloud(), scene.target, {}); }, {"clouds[0]"});
  EXPECT_TRUE(verify_poses(scene.context, scene.source, scene.target, {}).empty());
}

// Ground-truth poses of real pairs against the same poses half a metre or ten degrees off.
TEST(Verification, SeparatesTrueFromFalsePosesOfTheRedKitchen) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redkitchen/fragments");
  const evaluation::GroundTruth truth = evaluation::read_ground_truth(folder);
  const Context context = Context::cpu();
  std::vector<PointCloud> raw;
  std::vector<PointCloudView> views;
  for (int k = 0; k < 6; ++k)
    raw.push_back(test::read_plain_ply(folder + "/cloud_bin_" + std::to_string(k) + ".ply"));
  for (const PointCloud& cloud : raw) views.push_back(cloud.view());
  const std::vector<PreparedCloud> clouds = prepare_batch(context, views);
  std::vector<Pair> pairs;
  std::vector<std::vector<UnalignedIsometry3d>> poses;
  for (const evaluation::LogEntry& entry : truth.log) {
    if (entry.j >= 6) continue;
    pairs.push_back({static_cast<std::uint32_t>(entry.j), static_cast<std::uint32_t>(entry.i)});
    UnalignedIsometry3d pose, shifted, turned;
    pose.matrix() = entry.transform;
    shifted = turned = pose;
    shifted.translation() += Eigen::Vector3d(0.3, 0.3, 0.3);
    turned.linear() =
        turned.linear() *
        Eigen::AngleAxisd(10 / 57.29578, Eigen::Vector3d(1, 1, 1).normalized()).toRotationMatrix();
    poses.push_back({pose, shifted, turned});
  }
  ASSERT_GE(pairs.size(), 5u);
  VerificationOptions options;
  options.search_alternatives = false;
  double lowest_true = 1, highest_false = 0;
  for (const auto& of_pair : verify_poses_batch(context, clouds, pairs, poses, {}, options)) {
    lowest_true = std::min(lowest_true, of_pair[0].confidence);
    highest_false = std::max({highest_false, of_pair[1].confidence, of_pair[2].confidence});
  }
  EXPECT_GT(lowest_true, highest_false);
}

}  // namespace
}  // namespace gpureg
