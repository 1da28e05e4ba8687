// SPDX-License-Identifier: BSD-3-Clause
// Ranges, messages and lengths that come from the descriptions.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "fields/in_units.hpp"
#include "fields/localization.hpp"
#include "fields/loop_closure.hpp"
#include "gpureg/error.hpp"
#include "loop_closure/options.hpp"
#include "reconstruction/audit/in_units.hpp"
#include "settings/fields.hpp"
#include "settings/resolve.hpp"
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
  EXPECT_EQ(message([](auto& o) { o.voxel_size = -1; }),
            "voxel_size is -1, expected a length in [1e-6, 1e6]");
  EXPECT_EQ(message([](auto& o) { o.prepare.normal_radius = 0; }),
            "prepare.normal_radius is 0, expected a number of voxels in [0.001, 1000]");
  EXPECT_EQ(message([](auto& o) { o.prepare.depth_maps = 65; }),
            "prepare.depth_maps is 65, expected at most 64");
  EXPECT_EQ(message([](auto& o) { o.prepare.wide_feature_radius = 50; }),
            "prepare.wide_feature_radius is 50, expected at most 4 times prepare.feature_radius");
  EXPECT_EQ(message([](auto& o) { o.quadruples = 0; }), "quadruples is 0, expected 1 to 2^30");
  EXPECT_EQ(message([](auto& o) { o.refine_iterations = 1001; }),
            "refine_iterations is 1001, expected at most 1000");
  EXPECT_EQ(message([](auto& o) { o.tune = "evidence.mode_angle=181"; }),
            "tune: evidence.mode_angle is 181, expected degrees in (0, 180]");
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
  expect_bounds<RegistrationOptions>();
  expect_bounds<PrepareSettings>();
  expect_bounds<QuadrupleSettings>();
  expect_bounds<RefineSettings>();
  expect_bounds<CompatibilitySettings>();
  expect_bounds<EvidenceSettings>();
  expect_bounds<RegistrationSettings>();
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
  for (const float v : {0.05f, 0.1f, 0.0123f, 7.0f, 2e-6f, 333.3f}) {
    const RegistrationSettings o = resolve(RegistrationOptions{v});
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

TEST(OptionFields, LengthsOfMapsHaveTheBitsOfTheirFormulas) {
  for (const float v : {0.05f, 0.1f, 0.0123f, 7.0f}) {
    const double scale = static_cast<double>(v) / 0.05;
    const LoopConsistencyOptions l = fields::in_units(LoopConsistencyOptions{v}, v);
    EXPECT_TRUE(same_bits(l.closing_distance, 3.0f * v));
    const auto r = fields::in_units(reconstruction::Options{v}, v);
    EXPECT_EQ(r.noise.translation, 0.03 * scale);
    EXPECT_EQ(r.noise.max_translation, 0.4 * scale);
    EXPECT_EQ(r.information_unit, 1.0 * scale);
    EXPECT_EQ(r.drift.min_translation, 0.01);
    const auto f = fields::in_units(reconstruction::RefineOptions{v}, v);
    EXPECT_EQ(f.initial_distance, 0.15 * scale);
    EXPECT_EQ(f.final_distance, 0.05 * scale);
    EXPECT_EQ(f.kernel_width, 0.02 * scale);
    EXPECT_EQ(f.point_noise, 0.01 * scale);
    EXPECT_EQ(f.max_edge_error, 0.2 * scale);
    const auto c = loop_closure::in_units(loop_closure::Options{RegistrationOptions{v}});
    EXPECT_EQ(c.registration.prepare.feature_radius, 5) << "options of pairs stay in voxels";
    EXPECT_EQ(c.proposals.coarse_voxel_size, 0.5 * scale);
    EXPECT_EQ(c.proposals.max_dilation, 3 * scale);
    EXPECT_EQ(c.proposals.min_uncertainty, 0.03 * scale);
    EXPECT_EQ(c.noise.translation, 0.03 * scale);
    EXPECT_EQ(c.noise.max_translation, 0.4 * scale);
    EXPECT_EQ(c.information_unit, scale);
    EXPECT_EQ(c.graph.loop_noise.translation, 0.05 * scale);
    EXPECT_EQ(c.graph.drift.min_translation, 0.01);
    EXPECT_EQ(c.drift_correlation, 10 * scale);
  }
}

TEST(OptionFields, ShiftsOfAnAuditGrowMoreSlowlyThanVoxelsBeyondFiveCentimetres) {
  EXPECT_NEAR(reconstruction::in_units({}, 0.025f).max_shift, 0.075, 1e-8);
  EXPECT_NEAR(reconstruction::in_units({}, 0.8f).max_shift, 0.15 * 2, 1e-8);
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
  const RegistrationSettings a, b = resolve(RegistrationOptions{});
  fields::Fields<PrepareSettings>::visit(SameFields<PrepareSettings>{a.prepare, b.prepare});
  fields::Fields<CompatibilitySettings>::visit(
      SameFields<CompatibilitySettings>{a.compatibility, b.compatibility});
  fields::Fields<RefineSettings>::visit(SameFields<RefineSettings>{a.refine, b.refine});
  fields::Fields<EvidenceSettings>::visit(SameFields<EvidenceSettings>{a.evidence, b.evidence});
}

/// Lengths in voxels that became lengths of maps had these values for voxels of 5 cm.
TEST(OptionFields, NumbersOfVoxelsHaveTheBitsOfTheirLengths) {
  for (const auto& [voxels, length] : {std::pair{400.0, 20.0},
                                       {80, 4},
                                       {10, 0.5},
                                       {1, 0.05},
                                       {0.1, 0.005},
                                       {2, 0.1},
                                       {0.6, 0.03},
                                       {3, 0.15}})
    for (const float v : {0.05f, 0.1f, 0.0123f})
      EXPECT_EQ(fields::length_of(voxels, v), length * (static_cast<double>(v) / 0.05));
}

}  // namespace
}  // namespace gpureg
