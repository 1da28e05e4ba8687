// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/options.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "gpureg/error.hpp"
#include "support/expect_error.hpp"

namespace gpureg {
namespace {

const float kNan = std::numeric_limits<float>::quiet_NaN();
const float kInf = std::numeric_limits<float>::infinity();

template <typename Change>
void expect_refused(Change&& change, const std::string& field) {
  RegistrationOptions options;
  change(options);
  test::expect_error<InvalidArgument>([&] { options.validate(); }, {field});
}

TEST(Options, PaperNumbers) {
  const RegistrationOptions o = RegistrationOptions::loopsmart();
  EXPECT_FLOAT_EQ(o.prepare.voxel_size, 0.05f);
  EXPECT_FLOAT_EQ(o.prepare.normal_radius, 0.1f);
  EXPECT_FLOAT_EQ(o.prepare.feature_radius, 0.25f);
  EXPECT_EQ(o.quadruples.count, 4'000'000u);
  EXPECT_FLOAT_EQ(o.quadruples.edge_similarity, 0.9f);
  EXPECT_FLOAT_EQ(o.prepare.max_correspondence_distance, 0.075f);
  EXPECT_LT(o.quadruples.max_normal_angle, 180);
  EXPECT_EQ(o.refine.max_iterations, 0u);
  EXPECT_EQ(o.method, RegistrationMethod::quadruples);
  EXPECT_EQ(o.prepare.wide_feature_radius, 0);
  EXPECT_EQ(o.prepare.depth_maps, 0u);
  EXPECT_EQ(o.prepare.surface_side_distance, 0.0f);
  EXPECT_NO_THROW(o.validate());
}

TEST(Options, EverythingScalesWithTheVoxel) {
  for (const float v : {0.001f, 0.05f, 0.3f, 2.0f}) {
    const RegistrationOptions o = RegistrationOptions::from_voxel_size(v);
    EXPECT_NO_THROW(o.validate());
    EXPECT_FLOAT_EQ(o.prepare.feature_radius / v, 5);
    EXPECT_FLOAT_EQ(o.prepare.max_correspondence_distance / v, 1.5f);
    EXPECT_GT(o.refine.max_iterations, 0u);
  }
}

TEST(Options, VoxelSizeMustBeALength) {
  for (const float v : {0.0f, -1.0f, kNan, kInf, 1e30f, 1e-30f})
    test::expect_error<InvalidArgument>([&] { RegistrationOptions::from_voxel_size(v); },
                                        {"voxel_size"});
}

TEST(Options, EachFieldIsNamed) {
  for (const float bad : {kNan, kInf, -0.1f, 0.0f, 1e9f}) {
    expect_refused([&](auto& o) { o.prepare.normal_radius = bad; }, "prepare.normal_radius");
    expect_refused([&](auto& o) { o.prepare.feature_radius = bad; }, "prepare.feature_radius");
    expect_refused([&](auto& o) { o.prepare.max_correspondence_distance = bad; },
                   "prepare.max_correspondence_distance");
    expect_refused([&](auto& o) { o.quadruples.max_normal_angle = bad; },
                   "quadruples.max_normal_angle");
    expect_refused([&](auto& o) { o.quadruples.max_verification_normal_angle = bad; },
                   "quadruples.max_verification_normal_angle");
    expect_refused([&](auto& o) { o.refine.kernel_width = bad; }, "refine.kernel_width");
    expect_refused([&](auto& o) { o.quadruples.edge_similarity = bad; },
                   "quadruples.edge_similarity");
    expect_refused([&](auto& o) { o.compatibility.tolerance = bad; }, "compatibility.tolerance");
    expect_refused([&](auto& o) { o.compatibility.max_turn = bad; }, "compatibility.max_turn");
    expect_refused([&](auto& o) { o.compatibility.consensus_distance = bad; },
                   "compatibility.consensus_distance");
    expect_refused([&](auto& o) { o.compatibility.seed_separation = bad; },
                   "compatibility.seed_separation");
    expect_refused([&](auto& o) { o.evidence.max_normal_angle = bad; },
                   "evidence.max_normal_angle");
    expect_refused([&](auto& o) { o.evidence.mode_angle = bad; }, "evidence.mode_angle");
    expect_refused([&](auto& o) { o.evidence.mode_distance = bad; }, "evidence.mode_distance");
    expect_refused([&](auto& o) { o.evidence.free_space_margin = bad; },
                   "evidence.free_space_margin");
    expect_refused([&](auto& o) { o.evidence.min_range = bad; }, "evidence.min_range");
  }
  for (const float bad : {kNan, -0.1f, 1.1f})
    expect_refused([&](auto& o) { o.quadruples.min_inlier_ratio = bad; },
                   "quadruples.min_inlier_ratio");
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), -0.1, 1.1})
    expect_refused([&](auto& o) { o.min_confidence = bad; }, "min_confidence");
  expect_refused([](auto& o) { o.compatibility.max_matches = 3; }, "compatibility.max_matches");
  expect_refused([](auto& o) { o.compatibility.seeds = 0; }, "compatibility.seeds");
  expect_refused([](auto& o) { o.compatibility.max_members = 1025; }, "compatibility.max_members");
  expect_refused([](auto& o) { o.compatibility.triangles = 0; }, "compatibility.triangles");
  expect_refused([](auto& o) { o.compatibility.refits = 9; }, "compatibility.refits");
  expect_refused([](auto& o) { o.evidence.sample = 63; }, "evidence.sample");
  expect_refused([](auto& o) { o.evidence.modes = 65; }, "evidence.modes");
  expect_refused([](auto& o) { o.prepare.depth_maps = 65; }, "prepare.depth_maps");
  expect_refused([](auto& o) { o.prepare.surface_side_distance = -0.1f; },
                 "prepare.surface_side_distance");
  for (const float bad : {kNan, -0.1f, std::numeric_limits<float>::infinity()})
    expect_refused([&](auto& o) { o.evidence.degeneracy_search_distance = bad; },
                   "evidence.degeneracy_search_distance");
  expect_refused(
      [](auto& o) { o.prepare.surface_side_distance = std::numeric_limits<float>::infinity(); },
      "prepare.surface_side_distance");
  expect_refused([](auto& o) { o.prepare.wide_feature_radius = 50; },
                 "prepare.wide_feature_radius");
  expect_refused([](auto& o) { o.prepare.voxel_size = kNan; }, "prepare.voxel_size");
  expect_refused([](auto& o) { o.prepare.voxel_size = 1e-5f; }, "prepare.feature_radius");
  expect_refused([](auto& o) { o.quadruples.count = 0; }, "quadruples.count");
  expect_refused([](auto& o) { o.quadruples.neighbors = 0; }, "quadruples.neighbors");
  expect_refused([](auto& o) { o.quadruples.neighbors = 17; }, "quadruples.neighbors");
  expect_refused([](auto& o) { o.quadruples.max_survivors = 0; }, "quadruples.max_survivors");
  expect_refused([](auto& o) { o.refine.max_iterations = 5000; }, "refine.max_iterations");
  expect_refused([](auto& o) { o.prepare.max_correspondence_distance = 1.1f; },
                 "prepare.max_correspondence_distance");
}

TEST(Options, MessageHoldsTheValue) {
  RegistrationOptions o;
  o.quadruples.edge_similarity = 1.5f;
  test::expect_error<InvalidArgument>([&] { o.validate(); }, {"quadruples.edge_similarity", "1.5"});
}

}  // namespace
}  // namespace gpureg
