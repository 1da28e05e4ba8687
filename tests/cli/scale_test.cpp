// SPDX-License-Identifier: BSD-3-Clause
// --scale of register and batch.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

PointCloud divided(PointCloud cloud, float factor) {
  for (Eigen::Vector3f& p : cloud.points) p /= factor;
  return cloud;
}

double scale_of(const nlohmann::json& pose) {
  Eigen::Matrix3d m;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      m(row, column) = pose[static_cast<std::size_t>(4 * row + column)];
  return std::cbrt(m.determinant());
}

TEST(Scale, IsFoundAndWrittenIntoThePose) {
  const TemporaryFolder folder;
  const std::string source = write_cloud(folder, "a.ply", divided(room_scan(1), 250)),
                    target = write_cloud(folder, "b.ply", room_scan(0));
  const Outcome found = run(joined({"register", source, target, "--scale", "free", "--json",
                                    folder / "r.json", "--overlay", folder / "o.ply"},
                                   kSmall));
  EXPECT_EQ(found.status, 0) << found.out << found.err;
  expect_holds(found.out, {"status   aligned", "scale    2", "found, standard deviation"});
  EXPECT_EQ(found.err, "");  // no question of the units: the scale is not known
  const nlohmann::json result = json_of(folder / "r.json")["result"];
  EXPECT_NEAR(result["scale"].get<double>(), 250, 2.5);
  EXPECT_EQ(result["scale_status"], "found");
  nlohmann::json flat = nlohmann::json::array();
  for (const auto& row : result["target_from_source"])
    if (row.is_array())
      flat.insert(flat.end(), row.begin(), row.end());
    else
      flat.push_back(row);
  EXPECT_NEAR(scale_of(flat), result["scale"].get<double>(), 1e-6);

  const Outcome known = run(joined({"register", source, target, "--scale", "250"}, kSmall));
  EXPECT_EQ(known.status, 0) << known.out;
  expect_holds(known.out, {"scale    250 (known)"});
  const Outcome outside = run(joined({"register", source, target, "--scale", "1:3"}, kSmall));
  EXPECT_EQ(outside.status, 1) << outside.out;
}

TEST(Scale, IsOfEachPairOfABatch) {
  const TemporaryFolder folder;
  write_cloud(folder, "cloud_bin_0.ply", room_scan(0));
  write_cloud(folder, "cloud_bin_1.ply", divided(room_scan(1), 3));
  const Outcome found = run(joined({"batch", folder.path(), "-o", folder / "r.log", "--json",
                                    folder / "r.json", "--scale", "2:4", "--quiet"},
                                   kSmall));
  EXPECT_EQ(found.status, 0) << found.out << found.err;
  const nlohmann::json pair = json_of(folder / "r.json")["pairs"][0];
  EXPECT_EQ(pair["status"], "aligned");
  EXPECT_NEAR(pair["scale"].get<double>(), 3, 0.03);
}

TEST(Scale, IsOfEachScanOfAMap) {
  const TemporaryFolder folder, out;
  const double factors[] = {1, 1.6, 0.9};
  for (int k = 0; k < 3; ++k)
    write_cloud(folder, "cloud_bin_" + std::to_string(k) + ".ply",
                divided(room_scan(k), static_cast<float>(factors[k])));
  const Outcome found = run(joined({"reconstruct", folder.path(), "-o", out.path(), "--scale",
                                    "0.5:2", "--no-refine", "--quiet"},
                                   kSmall));
  EXPECT_EQ(found.status, 0) << found.out << found.err;
  const nlohmann::json map = json_of(out / "reconstruction.json");
  std::ifstream poses(out / "poses.txt");
  for (std::size_t k = 0; k < 3; ++k) {
    const nlohmann::json& scan = map["scans"][k];
    EXPECT_TRUE(scan["placed"]);
    EXPECT_NEAR(scan["scale"].get<double>() / factors[k], 1, 0.01);
    EXPECT_NEAR(scale_of(scan["island_from_scan"]), scan["scale"].get<double>(), 1e-9);
    int number = -1;
    Eigen::Matrix4d pose;
    poses >> number;
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) poses >> pose(row, column);
    EXPECT_EQ(number, static_cast<int>(k));
    EXPECT_NEAR(std::cbrt(pose.topLeftCorner<3, 3>().determinant()), scan["scale"].get<double>(),
                1e-9);
  }
  for (const nlohmann::json& edge : map["edges"]) {
    const auto scale = [&](const char* end) {
      return map["scans"][edge[end].get<std::size_t>()]["scale"].get<double>();
    };
    EXPECT_NEAR(scale_of(edge["T_ij"]), scale("j") / scale("i"), 1e-9);
  }
  EXPECT_FALSE(std::filesystem::exists(out / "pairs.json"));  // of scaled scans
  EXPECT_FALSE(std::filesystem::exists(out / "pairs.journal"));
}

TEST(Scale, RefusesWhatIsNone) {
  const TemporaryFolder folder;
  const std::string a = write_cloud(folder, "a.ply", room_scan(0));
  for (const std::string wrong : {"0", "-1", "nan", "inf", "0:2", "1:-2", "1:", "big"})
    expect_refused({"register", a, a, "--scale=" + wrong}, {"--scale is " + wrong, "expected"});
  expect_refused({"register", a, a, "--scale", "3:2"}, {"--scale is 3:2", "smaller end first"});
  expect_refused({"register", a, a, "--scale", "free", "--up", "0,0,1"}, {"--scale", "--up"});
  expect_refused({"register", a, a, "--scale", "free", "--time-budget", "5"},
                 {"--scale", "--time-budget"});
  expect_refused({"register", a, a, "--scale", "free", "--preset", "loopsmart"}, {"method"});
  expect_refused({"batch", folder.path(), "-o", folder / "r.log", "--scale", "0"},
                 {"--scale is 0"});
  expect_refused({"batch", folder.path(), "-o", folder / "r.log", "--scale", "free", "--resume"},
                 {"--scale", "--resume"});
  expect_refused({"reconstruct", folder.path(), "-o", folder / "map", "--scale", "2"},
                 {"--scale is 2", "free or MIN:MAX"});
  expect_refused({"reconstruct", folder.path(), "-o", folder / "map", "--scale", "free",
                  "--odometry", "poses.txt"},
                 {"--scale", "--odometry"});
}

}  // namespace
}  // namespace gpureg::test
