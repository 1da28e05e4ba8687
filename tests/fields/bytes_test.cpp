// SPDX-License-Identifier: BSD-3-Clause
// The comparison of results sees a change of any field.
#include <gtest/gtest.h>

#include <array>

#include "support/member_count.hpp"
#include "support/result_bytes.hpp"
#include "support/same_evidence.hpp"

namespace gpureg {
namespace {

template <typename M>
void change(M& value) {
  if constexpr (std::is_same_v<M, std::array<double, 6>>)
    value[5] += 1;
  else if constexpr (std::is_same_v<M, bool>)
    value = !value;
  else
    value += 1;
}

TEST(ResultBytes, EachFieldOfTheEvidenceCounts) {
  RegistrationResult before;
  before.modes.resize(2);
  fields::each<PoseEvidence>([&](const std::string& name, auto member, const fields::Field&) {
    RegistrationResult after = before;
    change(after.modes[1].evidence.*member);
    EXPECT_NE(test::bytes(after), test::bytes(before)) << name;
    EXPECT_FALSE(test::same_evidence(after.modes[1].evidence, before.modes[1].evidence)) << name;
  });
  EXPECT_TRUE(test::same_evidence(before.modes[0].evidence, before.modes[1].evidence));
}

TEST(ResultBytes, EachFieldOfTheStatisticsCounts) {
  const RegistrationResult before;
  fields::each<RegistrationStatistics>(
      [&](const std::string& name, auto member, const fields::Field&) {
        RegistrationResult after = before;
        change(after.statistics.*member);
        EXPECT_NE(test::bytes(after), test::bytes(before)) << name;
      });
}

// A member that is new here belongs into result_bytes.hpp.
static_assert(test::member_count<RegistrationMode>() == 6);

}  // namespace
}  // namespace gpureg
