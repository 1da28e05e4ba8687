// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "api/with_settings.hpp"
#include "gpureg/registration.hpp"
#include "support/expect_error.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

struct TwoScans {
  explicit TwoScans(unsigned seed) : random(seed), pose(test::random_pose(random)) {
    target = test::scan_room(random);
    source = test::moved(pose.inverse(), target);
  }
  std::mt19937 random;
  Eigen::Isometry3d pose;
  std::vector<Eigen::Vector3f> source, target;
};

RegistrationSettings keep_points() {
  RegistrationSettings o = resolve(RegistrationOptions{0.05f});
  o.prepare.voxel_size = 0;
  o.quadruples.count = 20000;
  o.smaller_as_source = false;
  o.quadruples.max_normal_angle = o.quadruples.max_verification_normal_angle = 180;
  return o;
}

/// Every 40th point: sparse enough for the undownsampled pipeline.
std::vector<Eigen::Vector3f> thin(const std::vector<Eigen::Vector3f>& points) {
  std::vector<Eigen::Vector3f> out;
  for (std::size_t k = 0; k < points.size(); k += 40) out.push_back(points[k]);
  return out;
}

// Features that tell points apart by where they are on the object: what a perfect learned feature
// would do. Dimensions 1 to 300.
TEST(CustomFeatures, OfAnyDimension) {
  const Context context = Context::cpu(2);
  const TwoScans scans(5);
  const std::vector<Eigen::Vector3f> source = thin(scans.source), target = thin(scans.target);
  for (const std::size_t dimension :
       {std::size_t(3), std::size_t(32), std::size_t(33), std::size_t(300)}) {
    std::mt19937 random(6);
    std::normal_distribution<float> normal;
    Eigen::MatrixXf lift(static_cast<Eigen::Index>(dimension), 3);
    for (Eigen::Index k = 0; k < lift.size(); ++k) lift.data()[k] = normal(random);
    std::vector<float> rows;
    for (const Eigen::Vector3f& p : target) {
      const Eigen::VectorXf f = lift * p;
      rows.insert(rows.end(), f.data(), f.data() + f.size());
    }
    PointCloudView a(source), b(target);
    a.features = b.features = rows.data();
    a.feature_dimension = b.feature_dimension = dimension;
    const RegistrationResult r = align(context, a, b, keep_points());
    ASSERT_TRUE(r.aligned()) << dimension << " " << to_string(r.reason);
    EXPECT_LT(test::translation_error(scans.pose, r.target_from_source), 0.01);
    EXPECT_EQ(r.statistics.correspondences, source.size());
  }
}

TEST(CustomFeatures, DimensionsMustAgree) {
  const Context context = Context::cpu(1);
  const TwoScans scans(7);
  const std::vector<float> rows(scans.source.size() * 4, 1.0f);
  PointCloudView a(scans.source);
  a.features = rows.data();
  a.feature_dimension = 4;
  const PreparedCloud with = prepare(context, a),
                      without = prepare(context, PointCloudView(scans.target));
  EXPECT_EQ(with.feature_dimension(), 4u);
  EXPECT_EQ(without.feature_dimension(), 33u);
  test::expect_error<InvalidArgument>([&] { align(context, with, without); },
                                      {"feature_dimension", "4", "33"});
}

RegistrationPrior of(std::vector<Correspondence> correspondences) {
  RegistrationPrior prior;
  prior.correspondences = std::move(correspondences);
  return prior;
}

TEST(CustomCorrespondences, HalfOfThemWrong) {
  const Context context = Context::cpu(2);
  TwoScans scans(8);
  const std::vector<Eigen::Vector3f> source = thin(scans.source), target = thin(scans.target);
  const RegistrationSettings options = keep_points();
  const PreparedCloud a = prepare(context, PointCloudView(source), options.prepare),
                      b = prepare(context, PointCloudView(target), options.prepare);
  std::vector<Correspondence> correspondences;
  for (std::uint32_t k = 0; k < a.size(); ++k)
    correspondences.push_back(
        {k, k % 2 ? k : static_cast<std::uint32_t>(scans.random() % b.size())});
  const RegistrationResult r = align(context, a, b, options, of(correspondences));
  ASSERT_TRUE(r.aligned());
  EXPECT_LT(test::translation_error(scans.pose, r.target_from_source), 0.01);
  EXPECT_EQ(r.statistics.correspondences, correspondences.size());
  const RegistrationResult none = align(context, a, b, options, of({}));
  EXPECT_EQ(none.reason, RegistrationReason::no_usable_features);
  EXPECT_EQ(none.statistics.source_points, a.size());
  const RegistrationResult three = align(context, a, b, options, of({{0, 0}, {1, 1}, {2, 2}}));
  EXPECT_EQ(three.reason, RegistrationReason::no_usable_features);
}

TEST(CustomCorrespondences, InABatchBesidePairsByFeatures) {
  const Context context = Context::cpu(2);
  const TwoScans scans(8);
  std::vector<Eigen::Vector3f> part = thin(scans.source);
  part.resize(part.size() / 2);
  const RegistrationOptions options{0.1f};
  const std::vector<PreparedCloud> clouds = {
      prepare(context, PointCloudView(part), options),
      prepare(context, PointCloudView(scans.target), options)};
  RegistrationPrior all;
  all.correspondences.emplace();
  for (std::uint32_t k = 0; k < clouds[0].size(); ++k) all.correspondences->push_back({k, k});
  RegistrationPrior back;  // the engine moves the smaller cloud, here the target
  back.correspondences.emplace();
  for (std::uint32_t k = 0; k < clouds[0].size(); ++k) back.correspondences->push_back({2 * k, k});
  RegistrationPrior both = all;
  both.gravity = GravityPrior{{0, 0, 1}, {0, 0, 1}, 1};
  const std::vector<Pair> pairs = {{0, 1}, {0, 1}, {0, 1}, {1, 0}, {0, 1}, {1, 0}};
  const std::vector<RegistrationPrior> priors = {all, of({}), {}, back, both, {}};
  const auto results = align_batch(context, clouds, pairs, options, {}, priors);
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const RegistrationResult alone =
        align(context, clouds[pairs[p].source], clouds[pairs[p].target], options, priors[p]);
    EXPECT_EQ(test::bytes(results[p]), test::bytes(alone)) << p;
  }
  EXPECT_EQ(results[0].statistics.correspondences, all.correspondences->size());
  EXPECT_EQ(results[1].reason, RegistrationReason::no_usable_features);
  EXPECT_EQ(results[3].statistics.correspondences, back.correspondences->size());
  EXPECT_GT(results[5].statistics.correspondences, 0u);
}

}  // namespace
}  // namespace gpureg
