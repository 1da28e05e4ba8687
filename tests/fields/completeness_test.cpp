// SPDX-License-Identifier: BSD-3-Clause
// Each member of a described struct is described: what is made of the descriptions leaves none out.
#include <gtest/gtest.h>

#include <set>

#include "fields/audit.hpp"
#include "fields/evidence.hpp"
#include "fields/localization.hpp"
#include "fields/loop_closure.hpp"
#include "fields/statistics.hpp"
#include "settings/fields.hpp"
#include "support/member_count.hpp"

namespace gpureg {
namespace {

struct Two {
  double first = 0;
  bool second = false;
};
struct Three {
  double first = 0;
  bool second = false, third = false;
};

}  // namespace

template <>
struct fields::Fields<Two> {
  static constexpr const char* kName = "Two";
  template <typename V>
  static void visit(V&& v) {
    v(&Two::first, {"first", ""});
    v(&Two::second, {"second", ""});
  }
};
template <>
struct fields::Fields<Three> {
  static constexpr const char* kName = "Three";
  template <typename V>
  static void visit(V&& v) {
    v(&Three::first, {"first", ""});
    v(&Three::second, {"second", ""});
  }
};

namespace {

/// Addresses within an object: the same member twice is one.
template <typename T>
std::size_t described() {
  const T object{};
  std::set<const void*> members;
  fields::each<T>([&](const std::string&, auto member, const fields::Field&) {
    members.insert(&(object.*member));
  });
  return members.size();
}

/// left_out: members that no document can hold, such as functions.
template <typename T>
void expect_complete(std::size_t left_out = 0) {
  EXPECT_EQ(described<T>() + left_out, test::member_count<T>()) << fields::Fields<T>::kName;
}

TEST(Fields, AMemberThatIsNotDescribedIsNoticed) {
  EXPECT_EQ(test::member_count<Two>(), 2u);
  EXPECT_EQ(described<Two>(), 2u);
  // The third member hides in the padding, and is counted all the same.
  static_assert(sizeof(Two) == sizeof(Three));
  EXPECT_EQ(test::member_count<Three>(), 3u);
  EXPECT_EQ(described<Three>(), 2u);
}

TEST(Fields, EveryMemberIsDescribed) {
  expect_complete<PoseEvidence>();
  expect_complete<RegistrationStatistics>();
  expect_complete<StageTimings>();
  expect_complete<PrepareStatistics>();
  expect_complete<ConfidenceCalibration>();
  expect_complete<PrepareOptions>();
  expect_complete<RegistrationOptions>();
  expect_complete<LoopConsistencyOptions>();
  expect_complete<PairConsistency>();
  expect_complete<pose_graph::DriftOptions>();
  expect_complete<pose_graph::LoopNoiseOptions>();
  expect_complete<pose_graph::GncOptions>();
  expect_complete<pose_graph::LineProcessOptions>();
  expect_complete<pose_graph::SolverOptions>();
  expect_complete<pose_graph::Options>(2);  // marginals, should_stop
  expect_complete<reconstruction::EdgeNoiseOptions>();
  expect_complete<reconstruction::Options>();
  expect_complete<reconstruction::RefineOptions>(1);  // should_stop
  expect_complete<reconstruction::AuditOptions>(1);   // should_stop
  expect_complete<loop_closure::ProposalOptions>();
  expect_complete<loop_closure::AcceptanceOptions>();
  expect_complete<loop_closure::Options>();
  expect_complete<localization::MapOptions>();
  expect_complete<localization::LocateOptions>();
  expect_complete<localization::ChangeOptions>();
  expect_complete<PrepareSettings>();
  expect_complete<QuadrupleSettings>();
  expect_complete<RefineSettings>();
  expect_complete<CompatibilitySettings>();
  expect_complete<EvidenceSettings>();
  expect_complete<RegistrationSettings>();
}

}  // namespace
}  // namespace gpureg
