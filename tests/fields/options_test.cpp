// SPDX-License-Identifier: BSD-3-Clause
// Ranges, messages and lengths that come from the descriptions.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "fields/localization.hpp"
#include "fields/loop_closure.hpp"
#include "fields/scale.hpp"
#include "gpureg/error.hpp"
#include "support/expect_error.hpp"

namespace gpureg {
namespace {

template <typename Change>
std::string message(Change&& change) {
  RegistrationOptions options;
  change(options);
  try {
    options.validate();
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(OptionFields, MessagesNameFieldValueAndRange) {
  EXPECT_EQ(message([](auto& o) { o.prepare.voxel_size = -1; }),
            "prepare.voxel_size is -1, expected 0 or a length in [1e-6, 1e6]");
  EXPECT_EQ(message([](auto& o) { o.prepare.normal_radius = 0; }),
            "prepare.normal_radius is 0, expected a length in [1e-6, 1e6]");
  EXPECT_EQ(message([](auto& o) { o.prepare.depth_maps = 65; }),
            "prepare.depth_maps is 65, expected at most 64");
  EXPECT_EQ(message([](auto& o) { o.prepare.wide_feature_radius = 2; }),
            "prepare.wide_feature_radius is 2, expected at most 4 times prepare.feature_radius");
  EXPECT_EQ(message([](auto& o) { o.quadruples.count = 0; }),
            "quadruples.count is 0, expected 1 to 2^30");
  EXPECT_EQ(message([](auto& o) { o.quadruples.neighbors = 17; }),
            "quadruples.neighbors is 17, expected 1 to 16");
  EXPECT_EQ(message([](auto& o) { o.quadruples.edge_similarity = 0; }),
            "quadruples.edge_similarity is 0, expected a ratio in (0, 1]");
  EXPECT_EQ(message([](auto& o) { o.quadruples.min_inlier_ratio = 1.5f; }),
            "quadruples.min_inlier_ratio is 1.5, expected a ratio in [0, 1]");
  EXPECT_EQ(message([](auto& o) { o.compatibility.max_turn = 0; }),
            "compatibility.max_turn is 0, expected a difference of cosines in (0, 2]");
  EXPECT_EQ(message([](auto& o) { o.refine.max_iterations = 1001; }),
            "refine.max_iterations is 1001, expected at most 1000");
  EXPECT_EQ(message([](auto& o) { o.evidence.mode_angle = 181; }),
            "evidence.mode_angle is 181, expected degrees in (0, 180]");
  EXPECT_EQ(message([](auto& o) { o.min_confidence = 2; }),
            "min_confidence is 2, expected a probability in [0, 1]");
  EXPECT_EQ(message([](auto& o) { o.calibration.slope = 0; }),
            "calibration.slope is 0, expected a number > 0");
  EXPECT_EQ(message([](auto& o) { o.calibration.offset = 1.0 / 0.0; }),
            "calibration.offset is inf, expected a finite number");
}

/// The first float that is less, or greater, than a limit.
template <typename M>
M beyond(double limit, int direction) {
  constexpr M kInfinite = std::numeric_limits<M>::infinity();
  if constexpr (std::is_floating_point_v<M>)
    return std::nextafter(static_cast<M>(limit), direction > 0 ? kInfinite : -kInfinite);
  else
    return static_cast<M>(limit + direction);
}

/// Each bound of each field of T is where its range says, and the message names the field.
template <typename T>
void expect_bounds() {
  fields::each<T>([](const std::string& name, auto member, const fields::Field& field) {
    using M = std::decay_t<decltype(std::declval<T>().*member)>;
    if constexpr (std::is_arithmetic_v<M> && !std::is_same_v<M, bool>) {
      const fields::Range& range = field.range;
      if (!range.checked) return;
      const auto refuse = [&](M value) {
        T options;
        options.*member = value;
        test::expect_error<InvalidArgument>([&] { options.validate(); },
                                            {fields::Fields<T>::kGroup + name + " is "});
      };
      if (std::is_floating_point_v<M>) refuse(std::numeric_limits<M>::quiet_NaN());
      const bool top = range.high >= static_cast<double>(std::numeric_limits<M>::max());
      if (!top) refuse(beyond<M>(range.high, 1));
      if (top && range.high < fields::kInfinity && std::is_floating_point_v<M>)
        refuse(std::numeric_limits<M>::infinity());
      if (range.open_low && range.low == 0) refuse(0);
      if (!range.open_low && range.low > 0) refuse(beyond<M>(range.low, -1));
    }
  });
}

TEST(OptionFields, BoundsAreThoseOfTheRanges) {
  expect_bounds<ConfidenceCalibration>();
  expect_bounds<PrepareOptions>();
  expect_bounds<QuadrupleOptions>();
  expect_bounds<RefineOptions>();
  expect_bounds<CompatibilityOptions>();
  expect_bounds<EvidenceOptions>();
  expect_bounds<RegistrationOptions>();
  expect_bounds<LoopConsistencyOptions>();
  expect_bounds<pose_graph::DriftOptions>();
  expect_bounds<pose_graph::LoopNoiseOptions>();
  expect_bounds<pose_graph::GncOptions>();
  expect_bounds<pose_graph::LineProcessOptions>();
  expect_bounds<pose_graph::SolverOptions>();
  expect_bounds<pose_graph::Options>();
  expect_bounds<reconstruction::EdgeNoiseOptions>();
  expect_bounds<reconstruction::Options>();
  expect_bounds<reconstruction::RefineOptions>();
  expect_bounds<loop_closure::ProposalOptions>();
  expect_bounds<loop_closure::AcceptanceOptions>();
  expect_bounds<loop_closure::Options>();
  expect_bounds<localization::MapOptions>();
  expect_bounds<localization::LocateOptions>();
  expect_bounds<localization::ChangeOptions>();
}

TEST(OptionFields, MessagesOfMaps) {
  reconstruction::Options o;
  o.noise.max_translation = 0.01;
  test::expect_error<InvalidArgument>(
      [&] { o.validate(); },
      {"noise.max_translation is 0.01, expected a finite number >= noise.translation"});
  o = {};
  o.threads = -1;
  test::expect_error<InvalidArgument>([&] { o.validate(); }, {"threads is -1, expected 0 or more"});
  pose_graph::Options graph;
  graph.threads = 5000;
  test::expect_error<InvalidArgument>([&] { graph.validate(); },
                                      {"threads is 5000, expected 0 (one per core) to 4096"});
  graph.threads = 0;
  graph.robust = static_cast<pose_graph::Robust>(7);
  test::expect_error<InvalidArgument>([&] { graph.validate(); },
                                      {"robust is 7, expected none, gnc or line_process"});
}

bool same_bits(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0; }

TEST(OptionFields, LengthsHaveTheBitsOfTheirFormulas) {
  for (const float v : {0.05f, 0.1f, 0.0123f, 7.0f, 1e-6f, 333.3f}) {
    const RegistrationOptions o = RegistrationOptions::from_voxel_size(v);
    EXPECT_TRUE(same_bits(o.prepare.voxel_size, v));
    EXPECT_TRUE(same_bits(o.prepare.normal_radius, 2.0f * v));
    EXPECT_TRUE(same_bits(o.prepare.feature_radius, 5.0f * v));
    EXPECT_TRUE(same_bits(o.prepare.wide_feature_radius, 8.0f * v));
    EXPECT_TRUE(same_bits(o.prepare.max_correspondence_distance, 1.5f * v));
    EXPECT_TRUE(same_bits(o.prepare.surface_side_distance, 10.0f * v));
    EXPECT_TRUE(same_bits(o.refine.kernel_width, 0.5f * v));
    EXPECT_TRUE(same_bits(o.compatibility.tolerance, v));
    EXPECT_TRUE(same_bits(o.compatibility.consensus_distance, 2.0f * v));
    EXPECT_TRUE(same_bits(o.compatibility.seed_separation, 2.0f * v));
    EXPECT_TRUE(same_bits(o.evidence.mode_distance, 6.0f * v));
    EXPECT_TRUE(same_bits(o.evidence.degeneracy_search_distance, 8.0f * v));
    EXPECT_TRUE(same_bits(o.evidence.free_space_margin, v / 5.0f * 12.0f));
    EXPECT_TRUE(same_bits(o.evidence.min_range, 6.0f * v));
  }
}

TEST(OptionFields, MultiplyingLengthsLeavesTheRest) {
  RegistrationOptions o = RegistrationOptions::from_voxel_size(0.05f);
  o.evidence.mode_angle = 7;
  fields::multiply_lengths(o, 2);
  const RegistrationOptions wide = RegistrationOptions::from_voxel_size(0.1f);
  EXPECT_FLOAT_EQ(o.prepare.voxel_size, wide.prepare.voxel_size);
  EXPECT_FLOAT_EQ(o.prepare.feature_radius, wide.prepare.feature_radius);
  EXPECT_FLOAT_EQ(o.evidence.min_range, wide.evidence.min_range);
  EXPECT_EQ(o.evidence.mode_angle, 7);
  EXPECT_EQ(o.evidence.sample, wide.evidence.sample);
}

TEST(OptionFields, LengthsOfMapsHaveTheBitsOfTheirFormulas) {
  for (const float v : {0.05f, 0.1f, 0.0123f, 7.0f}) {
    const double scale = static_cast<double>(v) / 0.05;
    const auto r = reconstruction::Options::from_voxel_size(v);
    EXPECT_TRUE(same_bits(r.consistency.closing_distance, 3.0f * v));
    EXPECT_EQ(r.noise.translation, 0.03 * scale);
    EXPECT_EQ(r.noise.max_translation, 0.4 * scale);
    EXPECT_EQ(r.information_unit, 1.0 * scale);
    EXPECT_EQ(r.drift.min_translation, 0.01);
    const auto f = reconstruction::RefineOptions::for_depth_cameras(v);
    EXPECT_EQ(f.initial_distance, 0.15 * scale);
    EXPECT_EQ(f.final_distance, 0.05 * scale);
    EXPECT_EQ(f.kernel_width, 0.02 * scale);
    EXPECT_EQ(f.point_noise, 0.01 * scale);
    EXPECT_EQ(f.max_edge_error, 0.2 * scale);
    EXPECT_EQ(f.noise_range, static_cast<double>(30 * v));
    const auto c = loop_closure::Options::from_voxel_size(v);
    EXPECT_TRUE(same_bits(c.registration.prepare.feature_radius, 5.0f * v));
    EXPECT_EQ(c.proposals.coarse_voxel_size, 0.5 * scale);
    EXPECT_EQ(c.proposals.max_dilation, 3 * scale);
    EXPECT_EQ(c.proposals.min_uncertainty, 0.03 * scale);
    EXPECT_EQ(c.noise.translation, 0.03 * scale);
    EXPECT_EQ(c.noise.max_translation, 0.4 * scale);
    EXPECT_EQ(c.information_unit, scale);
    EXPECT_EQ(c.graph.loop_noise.translation, 0.05 * scale);
    EXPECT_EQ(c.drift_correlation, 10 * scale);
  }
}

/// Compares every field of two values of one struct.
template <typename T>
struct SameFields {
  const T &a, &b;
  template <typename M>
  void operator()(M T::* member, const fields::Field& field) const {
    if constexpr (std::is_arithmetic_v<M> || std::is_enum_v<M>)
      EXPECT_EQ(a.*member, b.*member) << field.name;
  }
};

/// The defaults are those of 5 cm: no length differs in a bit.
TEST(OptionFields, DefaultsAreThoseOfFiveCentimetres) {
  const PrepareOptions a, b = RegistrationOptions::from_voxel_size(0.05f).prepare;
  const EvidenceOptions c, d = RegistrationOptions::from_voxel_size(0.05f).evidence;
  fields::Fields<PrepareOptions>::visit(SameFields<PrepareOptions>{a, b});
  fields::Fields<EvidenceOptions>::visit(SameFields<EvidenceOptions>{c, d});
}

}  // namespace
}  // namespace gpureg
