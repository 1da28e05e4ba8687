// SPDX-License-Identifier: BSD-3-Clause
// Free space: points in front of an observed surface violate it, weighted by their incidence.
#include <gtest/gtest.h>

#include "api/with_settings.hpp"
#include "pipeline/evidence_test.hpp"
#include "support/outcome_bytes.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg::cpu {
namespace {

using test::seen_from;

/// A square metre about its middle, spanned by two directions.
std::vector<Vec3> panel(Vec3 middle, Vec3 along, Vec3 up) {
  std::vector<Vec3> points;
  for (int y = -25; y <= 25; ++y)
    for (int x = -25; x <= 25; ++x)
      points.push_back(middle + along * (0.02f * static_cast<float>(x)) +
                       up * (0.02f * static_cast<float>(y)));
  return points;
}

SideEvidence source_evidence(Exec& exec, const CpuCloud& source, const CpuCloud& target) {
  return test::verified_in_place(exec, source, target).modes[0].source;
}

/// Mean incidence of the points of a term.
double mean(const SideEvidence& e, Term incidence) {
  return static_cast<double>(e[incidence]) / static_cast<double>(kIncidenceScale) /
         e.points(Term::tested);
}

TEST(Observations, IncidenceIsTheSquaredCosine) {
  EXPECT_FLOAT_EQ(incidence({0, 0, 1}, {0, 0, -7}), 1.0f);
  EXPECT_FLOAT_EQ(incidence({0, 0, 1}, {0, 3, 3}), 0.5f);
  EXPECT_FLOAT_EQ(incidence({0, 1, 0}, {5, 0, 2}), 0.0f);
  EXPECT_FLOAT_EQ(incidence({0, 0, 0}, {5, 0, 2}), 1.0f / 3.0f);
  EXPECT_EQ(fixed_incidence(1.0f), 65536u);
}

TEST(Observations, GrazingObservationsHardlyCount) {
  Exec exec(1);
  // A wall three metres away, and something a metre before it.
  std::vector<Vec3> wall;
  for (const float x : {-1.0f, 0.0f, 1.0f})
    for (const float y : {-1.0f, 0.0f, 1.0f}) {
      const auto part = panel({x, y, 3}, {1, 0, 0}, {0, 1, 0});
      wall.insert(wall.end(), part.begin(), part.end());
    }
  const auto target = seen_from(exec, wall, {0, 0, 0});
  const SideEvidence square = source_evidence(
      exec, *seen_from(exec, panel({0, 0, 2}, {1, 0, 0}, {0, 1, 0}), {0, 0, 0}), *target);
  EXPECT_EQ(square[Term::violating], square[Term::tested]);
  EXPECT_GT(mean(square, Term::incidence_violating), 0.9);
  EXPECT_EQ(square[Term::incidence_observed], square[Term::incidence_violating]);
  // The same panel parallel to the line of sight.
  const SideEvidence edge = source_evidence(
      exec, *seen_from(exec, panel({0, 0, 2}, {0, 0, 1}, {0, 1, 0}), {3, 0, 2}), *target);
  EXPECT_GT(edge[Term::violating], edge[Term::tested] / 2);
  EXPECT_LT(mean(edge, Term::incidence_violating), 0.05);
  // Where it touches a surface it is not before one.
  const SideEvidence on = source_evidence(
      exec, *seen_from(exec, panel({0, 0, 3}, {1, 0, 0}, {0, 1, 0}), {0, 0, 0}), *target);
  EXPECT_EQ(on[Term::violating], 0);
  EXPECT_EQ(on[Term::incidence_violating], 0);
  EXPECT_GT(mean(on, Term::incidence_observed), 0.9);
}

TEST(Observations, EvidenceInGroupsIsThatOfEachPoint) {
  std::mt19937 random(7);
  Exec exec(2);
  for (int trial = 0; trial < 3; ++trial) {
    const auto points_a = test::bumpy_sheet(random, 9000, 1.7f),
               points_b = test::bumpy_sheet(random, 7001, 2.0f);
    const auto a = seen_from(exec, points_a, {0.5f, 0.3f, 2.0f}),
               b = seen_from(exec, points_b, {1.5f, -0.2f, 1.0f});
    const ModeOutcome outcome = test::verified_in_place(exec, *a, *b).modes[0];
    const RegistrationSettings options;
    const EvidenceTest test = pipeline::evidence_test(options);
    const Rigid there = to_rigid(outcome.pose);
    const CloudView s = a->view(), t = b->view();
    SideEvidence forth{}, reverse{};
    for (std::uint32_t i = 0; i < s.size; ++i)
      verify_point(s, t, there, test, t.visibility.count, i, forth);
    for (std::uint32_t i = 0; i < t.size; ++i)
      verify_point(t, s, inverse(there), test, s.visibility.count, i, reverse);
    for (const auto& [expected, found] :
         {std::pair(forth, outcome.source), std::pair(reverse, outcome.target)}) {
      test::ByteWriter each, groups;
      add(each, expected);
      add(groups, found);
      EXPECT_EQ(each.all, groups.all);
      EXPECT_GT(found[Term::incidence_violating], 0);
      EXPECT_GT(found[Term::front_violation_near], 0);
    }
  }
}

TEST(Observations, RaysOfHardlyAnyLengthStayInTheirFace) {
  constexpr std::uint32_t kCentre = kMapEdge / 2 * kMapEdge + kMapEdge / 2;
  const Vec3 far = {0.3f, 0.7f, -1.0f};
  for (const float length : {1e-20f, 1e-29f, 1.0f, 1e20f})
    EXPECT_EQ(map_ray(far * length).cell, map_ray(far).cell) << length;
  for (const float length : {0.0f, 1e-45f, 1e-38f, 1e-37f}) {
    EXPECT_EQ(map_ray({length, 0, 0}).cell % kMapFace, kCentre) << length;
    EXPECT_EQ(map_ray({0, 0, -length}).depth, length);
  }
}

}  // namespace
}  // namespace gpureg::cpu
