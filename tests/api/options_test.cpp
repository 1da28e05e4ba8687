// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/options.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "gpureg/error.hpp"
#include "settings/resolve.hpp"
#include "support/expect_error.hpp"

namespace gpureg {
namespace {

const float kNan = std::numeric_limits<float>::quiet_NaN();
const float kInf = std::numeric_limits<float>::infinity();

template <typename Options = RegistrationOptions, typename Change>
void expect_refused(Change&& change, const std::string& field) {
  Options options;
  change(options);
  test::expect_error<InvalidArgument>([&] { options.validate(); }, {field});
}

TEST(Options, PaperNumbers) {
  const RegistrationSettings o = resolve(RegistrationOptions::loopsmart());
  EXPECT_FLOAT_EQ(o.prepare.voxel_size, 0.05f);
  EXPECT_FLOAT_EQ(o.prepare.normal_radius, 0.1f);
  EXPECT_FLOAT_EQ(o.prepare.feature_radius, 0.25f);
  EXPECT_EQ(o.quadruples.count, 4'000'000u);
  EXPECT_FLOAT_EQ(o.quadruples.edge_similarity, 0.9f);
  EXPECT_EQ(o.quadruples.min_inlier_ratio, 0.3f);
  EXPECT_FLOAT_EQ(o.prepare.max_correspondence_distance, 0.075f);
  EXPECT_LT(o.quadruples.max_normal_angle, 180);
  EXPECT_EQ(o.refine.max_iterations, 0u);
  EXPECT_EQ(o.method, RegistrationMethod::quadruples);
  EXPECT_EQ(o.prepare.wide_feature_radius, 0);
  EXPECT_EQ(o.prepare.depth_maps, 0u);
  EXPECT_EQ(o.prepare.surface_side_distance, 0.0f);
}

TEST(Options, EverythingFollowsFromTheVoxelSizeAlone) {
  for (const float v : {0.001f, 0.05f, 0.3f, 2.0f}) {
    RegistrationOptions options;
    options.voxel_size = v;
    const RegistrationSettings o = resolve(options);
    EXPECT_FLOAT_EQ(o.prepare.feature_radius / v, 5);
    EXPECT_FLOAT_EQ(o.prepare.max_correspondence_distance / v, 1.5f);
    EXPECT_FLOAT_EQ(o.evidence.mode_distance / v, 6);
  }
}

TEST(Options, PointsStayAsTheyAreWithTheLengthsOfTheVoxelSize) {
  RegistrationOptions options{0.1f};
  options.prepare.downsample = false;
  const PrepareSettings o = resolve(options).prepare;
  EXPECT_EQ(o.voxel_size, 0);
  EXPECT_EQ(o.unit, 0.1f);
  EXPECT_EQ(o.normal_radius, 0.2f);
}

TEST(Options, VoxelSizeMustBeALength) {
  for (const float v : {0.0f, -1.0f, kNan, kInf, 1e30f, 1e-30f})
    expect_refused([&](auto& o) { o.voxel_size = v; }, "voxel_size is ");
  expect_refused([](auto& o) { o.voxel_size = 1e6f; }, "voxel_size is 1e+06, from which follows: ");
}

TEST(Options, QualityIsANumberOfCandidates) {
  EXPECT_EQ(resolve(RegistrationOptions{0.05f, 0}).compatibility.seeds, 64u);
  EXPECT_EQ(resolve(RegistrationOptions{0.05f, 10}).compatibility.seeds, 8192u);
  expect_refused([](auto& o) { o.quality = 11; }, "quality is 11");
}

TEST(Options, ConstantsAreTunedByTheirNames) {
  RegistrationOptions o;
  o.tune = "evidence.sample=1024  quadruples.mutual=true";
  EXPECT_EQ(resolve(o).evidence.sample, 1024u);
  EXPECT_TRUE(resolve(o).quadruples.mutual);
  const auto refused = [](const char* text, const char* why) {
    expect_refused([&](auto& options) { options.tune = text; }, why);
  };
  refused("evidence.sampel=3", "tune: evidence.sampel=3: there is no such option, only sample");
  refused("evidence.sample", "tune: evidence.sample: expected NAME=VALUE");
  refused("evidence.sample=3", "tune: evidence.sample is 3, expected 64 to 65536");
}

TEST(Options, EachFieldIsNamed) {
  for (const float bad : {kNan, kInf, -0.1f, 0.0f, 1e9f}) {
    expect_refused([&](auto& o) { o.prepare.normal_radius = bad; }, "prepare.normal_radius");
    expect_refused([&](auto& o) { o.prepare.feature_radius = bad; }, "prepare.feature_radius");
    expect_refused([&](auto& o) { o.prepare.max_correspondence_distance = bad; },
                   "prepare.max_correspondence_distance");
  }
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), -0.1, 1.1})
    expect_refused([&](auto& o) { o.min_confidence = bad; }, "min_confidence");
  expect_refused([](auto& o) { o.prepare.depth_maps = 65; }, "prepare.depth_maps");
  for (const float bad : {-0.1f, kInf})
    expect_refused([&](auto& o) { o.prepare.surface_side_distance = bad; },
                   "prepare.surface_side_distance");
  expect_refused([](auto& o) { o.prepare.wide_feature_radius = 50; },
                 "prepare.wide_feature_radius");
  expect_refused([](auto& o) { o.prepare.feature_radius = 101; },
                 "prepare.feature_radius is 101, expected at most 100 voxels");
  expect_refused([](auto& o) { o.prepare.max_correspondence_distance = 21; },
                 "prepare.max_correspondence_distance is 21, expected at most 20 voxels");
  expect_refused([](auto& o) { o.quadruples = 0; }, "quadruples");
  expect_refused([](auto& o) { o.refine_iterations = 5000; }, "refine_iterations");
}

TEST(Options, EachSettingIsNamed) {
  const auto refused = [](const auto& change, const char* field) {
    expect_refused<RegistrationSettings>(change, field);
  };
  for (const float bad : {kNan, kInf, -0.1f, 0.0f, 1e9f}) {
    refused([&](auto& o) { o.prepare.normal_radius = bad; }, "prepare.normal_radius");
    refused([&](auto& o) { o.prepare.feature_radius = bad; }, "prepare.feature_radius");
    refused([&](auto& o) { o.prepare.max_correspondence_distance = bad; },
            "prepare.max_correspondence_distance");
    refused([&](auto& o) { o.quadruples.max_normal_angle = bad; }, "quadruples.max_normal_angle");
    refused([&](auto& o) { o.quadruples.max_verification_normal_angle = bad; },
            "quadruples.max_verification_normal_angle");
    refused([&](auto& o) { o.refine.kernel_width = bad; }, "refine.kernel_width");
    refused([&](auto& o) { o.quadruples.edge_similarity = bad; }, "quadruples.edge_similarity");
    refused([&](auto& o) { o.compatibility.tolerance = bad; }, "compatibility.tolerance");
    refused([&](auto& o) { o.compatibility.max_turn = bad; }, "compatibility.max_turn");
    refused([&](auto& o) { o.compatibility.consensus_distance = bad; },
            "compatibility.consensus_distance");
    refused([&](auto& o) { o.compatibility.seed_separation = bad; },
            "compatibility.seed_separation");
    refused([&](auto& o) { o.evidence.max_normal_angle = bad; }, "evidence.max_normal_angle");
    refused([&](auto& o) { o.evidence.mode_angle = bad; }, "evidence.mode_angle");
    refused([&](auto& o) { o.evidence.mode_distance = bad; }, "evidence.mode_distance");
    refused([&](auto& o) { o.evidence.free_space_margin = bad; }, "evidence.free_space_margin");
    refused([&](auto& o) { o.evidence.min_range = bad; }, "evidence.min_range");
  }
  for (const float bad : {kNan, -0.1f, 1.1f})
    refused([&](auto& o) { o.quadruples.min_inlier_ratio = bad; }, "quadruples.min_inlier_ratio");
  for (const float bad : {kNan, -0.1f, kInf})
    refused([&](auto& o) { o.evidence.degeneracy_search_distance = bad; },
            "evidence.degeneracy_search_distance");
  refused([](auto& o) { o.compatibility.max_matches = 3; }, "compatibility.max_matches");
  refused([](auto& o) { o.compatibility.seeds = 0; }, "compatibility.seeds");
  refused([](auto& o) { o.compatibility.max_members = 1025; }, "compatibility.max_members");
  refused([](auto& o) { o.compatibility.triangles = 0; }, "compatibility.triangles");
  refused([](auto& o) { o.compatibility.refits = 9; }, "compatibility.refits");
  refused([](auto& o) { o.evidence.sample = 63; }, "evidence.sample");
  refused([](auto& o) { o.evidence.modes = 65; }, "evidence.modes");
  refused([](auto& o) { o.prepare.wide_feature_radius = 50; }, "prepare.wide_feature_radius");
  refused([](auto& o) { o.prepare.voxel_size = kNan; }, "prepare.voxel_size");
  refused([](auto& o) { o.prepare.voxel_size = 1e-5f; }, "prepare.feature_radius");
  refused([](auto& o) { o.prepare.max_correspondence_distance = 1.1f; },
          "prepare.max_correspondence_distance");
  refused([](auto& o) { o.quadruples.neighbors = 17; }, "quadruples.neighbors");
  refused([](auto& o) { o.quadruples.max_survivors = 0; }, "quadruples.max_survivors");
}

}  // namespace
}  // namespace gpureg
