// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

constexpr const char* kTruth =
    "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 1 1 0 0 0 0 1\n3 0 1 0 0 0 0 1\n";

TEST(EvaluateTrajectoryCommand, KnownAnswer) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.txt", kTruth);
  const std::string estimate = folder.write(
      "estimate.txt", "0 5 0 0 0 0 0 1\n1 6 0 0 0 0 0 1\n2 6 1 0.4 0 0 0 1\n3 5 1 0 0 0 0 1\n");
  const Outcome outcome = run({"evaluate-trajectory", estimate, "--ground-truth", truth,
                               "--no-align", "--json", folder / "out.json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"4 matched of 4", "ATE metres", "RPE metres"});
  const auto document = json_of(folder / "out.json");
  // Three poses are 5 m off, one sqrt(25.16) m; sums of squares: 100.16 / 4.
  EXPECT_NEAR(document.at("ate").at("metres").at("rmse").get<double>(), std::sqrt(25.04), 1e-12);
  EXPECT_NEAR(document.at("rpe").at("metres").at("max").get<double>(), 0.4, 1e-12);
  EXPECT_EQ(document.at("poses").at("matched"), 4);
  EXPECT_FALSE(document.at("options").at("align").get<bool>());
}

TEST(EvaluateTrajectoryCommand, ErrorsAreNamed) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.txt", kTruth);
  const std::string bad = folder.write("bad.txt", "0 1 2\n");
  const std::string far = folder.write("far.txt", "70 0 0 0 0 0 0 1\n");
  expect_refused({"evaluate-trajectory", bad, "--ground-truth", truth}, {"bad.txt:1", "3 fields"});
  expect_refused({"evaluate-trajectory", far, "--ground-truth", truth}, {"0 of 1 poses"});
  expect_refused({"evaluate-trajectory", truth, "--ground-truth", folder / "none.txt"},
                 {"none.txt"});
  expect_refused({"evaluate-trajectory", truth, "--ground-truth", truth, "--delta", "0.5"},
                 {"delta", "whole"});
  expect_refused({"evaluate-trajectory", truth, "--ground-truth", truth, "--json", truth},
                 {"--json"});
}

}  // namespace
}  // namespace gpureg::test
