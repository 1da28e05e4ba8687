// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/io.hpp"

namespace gpureg::test {
namespace {

/// A floor of 1 x 1 m, one point each 2 cm.
PointCloud floor_at(float height) {
  PointCloud cloud;
  for (int y = 0; y <= 50; ++y) {
    for (int x = 0; x <= 50; ++x) {
      cloud.points.emplace_back(0.02f * static_cast<float>(x), 0.02f * static_cast<float>(y),
                                height);
      cloud.normals.emplace_back(0, 0, 1);
    }
  }
  return cloud;
}

TEST(EvaluateSurfaceCommand, ShiftedPlane) {
  const TemporaryFolder folder;
  io::write_point_cloud(folder / "map.ply", floor_at(0.015f));
  io::write_point_cloud(folder / "truth.ply", floor_at(0));
  const Outcome outcome = run({"evaluate-surface", folder / "map.ply", "--surface",
                               folder / "truth.ply", "--json", folder / "out.json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"2601, 0 beyond 0.200 m", "tangent planes", "0.0150"});
  const auto document = json_of(folder / "out.json");
  EXPECT_NEAR(document.at("metres").at("mean").get<double>(), 0.015, 1e-8);
  EXPECT_NEAR(document.at("metres").at("median").get<double>(), 0.015, 1e-8);
  EXPECT_EQ(document.at("points"), 2601);
}

TEST(EvaluateSurfaceCommand, TrajectoriesAlignTheMap) {
  const TemporaryFolder folder;
  io::write_point_cloud(folder / "map.ply", floor_at(3));
  io::write_point_cloud(folder / "truth.ply", floor_at(0));
  const std::string estimate = folder.write(
      "estimate.txt", "0 0 0 4 0 0 0 1\n1 1 0 4 0 0 0 1\n2 1 1 4 0 0 0 1\n3 0 1 4 0 0 0 1\n");
  const std::string truth = folder.write(
      "truth.txt", "0 0 0 1 0 0 0 1\n1 1 0 1 0 0 0 1\n2 1 1 1 0 0 0 1\n3 0 1 1 0 0 0 1\n");
  const Outcome outcome =
      run({"evaluate-surface", folder / "map.ply", "--surface", folder / "truth.ply",
           "--trajectory", estimate, "--ground-truth", truth, "--json", folder / "out.json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  // The map moves by floats of 3 m.
  EXPECT_LT(json_of(folder / "out.json").at("metres").at("max").get<double>(), 1e-6);
}

TEST(EvaluateSurfaceCommand, ErrorsAreNamed) {
  const TemporaryFolder folder;
  io::write_point_cloud(folder / "map.ply", floor_at(0));
  const std::string map = folder / "map.ply";
  expect_refused({"evaluate-surface", map, "--surface", folder / "none.ply"}, {"none.ply"});
  expect_refused({"evaluate-surface", map, "--surface", map, "--trajectory", "t.txt"},
                 {"--ground-truth is missing"});
  expect_refused({"evaluate-surface", map, "--surface", map, "--json", map}, {"--json"});
  expect_refused({"evaluate-surface", map, "--surface", map, "--max-distance", "0"},
                 {"--max-distance"});
}

}  // namespace
}  // namespace gpureg::test
