// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/io.hpp"

namespace gpureg::test {
namespace {

std::string comma(const Eigen::Vector3d& p) {
  std::ostringstream text;
  text.precision(17);
  text << p.x() << ',' << p.y() << ',' << p.z();
  return text.str();
}

class Register : public ::testing::Test {
 protected:
  Outcome align(const std::vector<std::string>& more) const {
    return run(joined(joined({"register", source_, target_}, kSmall), more));
  }

  const TemporaryFolder folder_;
  const std::string source_ = write_cloud(folder_, "source.ply", room_scan(0));
  const std::string target_ = write_cloud(folder_, "target.ply", room_scan(1));
};

TEST_F(Register, ReportsTheResult) {
  const Outcome outcome = align({});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.err, "");
  expect_holds(outcome.out,
               {source_, target_, "backend  cpu", "status   aligned", "target_from_source\n",
                "confidence", "inliers", "correspondences", "hypotheses 512", "survivors",
                "features", "depth maps", "match", "refine"});
}

TEST_F(Register, NumbersOfAFarPoseStayApart) {
  PointCloud far = room_scan(1);
  for (Eigen::Vector3f& point : far.points) point += Eigen::Vector3f(-201112, -301112, -401112);
  const Outcome outcome = run(joined(
      {"register", source_, write_cloud(folder_, "far.ply", far), "--json", folder_ / "r.json"},
      kSmall));
  const auto pose = json_of(folder_ / "r.json")["result"]["target_from_source"];
  ASSERT_EQ(pose.size(), 16u) << outcome.out << outcome.err;
  std::istringstream printed(outcome.out.substr(outcome.out.find("target_from_source\n") + 19));
  for (const auto& expected : pose) {
    std::string number;  // read as one, as a reader that splits at spaces does
    ASSERT_TRUE(printed >> number);
    std::size_t end = 0;
    EXPECT_NEAR(std::stod(number, &end), expected.get<double>(), 1e-6);
    EXPECT_EQ(end, number.size()) << number;
  }
}

const Eigen::Vector3d kOnMap(512345, 5403210, 310);

TEST_F(Register, APoseOfMapCoordinatesReadsBack) {
  std::vector<std::string> files;
  for (int k = 0; k < 2; ++k) {
    PointCloud cloud = room_scan(k);
    cloud.origin = kOnMap;
    files.push_back(write_cloud(folder_, std::to_string(k) + ".ply", cloud));
  }
  const Outcome outcome =
      run(joined({"register", files[0], files[1], "--json", folder_ / "r.json"}, kSmall));
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const auto exact = json_of(folder_ / "r.json")["result"]["target_from_source"];
  std::istringstream printed(outcome.out.substr(outcome.out.find("target_from_source\n") + 19));
  Eigen::Matrix4d pose, expected;
  for (int k = 0; k < 16; ++k) {
    printed >> pose(k / 4, k % 4);
    expected(k / 4, k % 4) = exact[static_cast<std::size_t>(k)].get<double>();
  }
  // Six decimals of the rotation are metres there.
  EXPECT_EQ(pose, expected) << outcome.out;
}

TEST_F(Register, FloatCoordinatesOfAMapAreNoted) {
  PointCloud cloud = room_scan(0);
  for (Eigen::Vector3f& p : cloud.points) p += kOnMap.cast<float>();
  const std::string file = write_cloud(folder_, "float.ply", cloud);
  const auto noted = [&](const std::vector<std::string>& arguments) {
    expect_holds(run(arguments).err, {"note: " + file, "resolve 0.5 in float32", "double"});
  };
  noted({"info", file});
  noted(joined({"register", file, target_}, kSmall));
  noted(joined({"locate", file, target_}, kSmall));
  noted({"evaluate-surface", file, "--surface", target_});
  EXPECT_EQ(run({"info", target_}).err, "");
}

// As a scanner writes them: coordinates of a map, in double.
TEST_F(Register, MapCoordinatesCostNothing) {
  const auto error_at = [&](const Eigen::Vector3d& source_place,
                            const Eigen::Vector3d& target_place) {
    const auto at = [&](const char* name, int number, const Eigen::Vector3d& place) {
      PointCloud cloud = room_scan(number);
      cloud.origin = place;
      cloud.set_viewpoints({place});
      return write_cloud(folder_, name, cloud);
    };
    const std::string path = folder_ / "far.json";
    const Outcome outcome =
        run(joined({"register", at("a.ply", 0, source_place), at("b.ply", 1, target_place),
                    "--source-viewpoint", comma(source_place), "--target-viewpoint",
                    comma(target_place), "--json", path, "--overlay", folder_ / "o.ply"},
                   kSmall));
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    const auto values = json_of(path)["result"]["target_from_source"].get<std::vector<double>>();
    const Eigen::Matrix4d pose = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>(values.data());
    const Eigen::Isometry3d truth = scan_from_room(1) * scan_from_room(0).inverse();
    double worst = 0;  // at the corners of 6 m around the source
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3d p(k & 1 ? 3 : -3, k & 2 ? 3 : -3, k & 4 ? 3 : -3);
      const Eigen::Vector3d there = (pose * (p + source_place).homogeneous()).head<3>();
      worst = std::max(worst, (there - target_place - truth * p).norm());
    }
    return worst;
  };
  const double here = error_at({0, 0, 0}, {0, 0, 0});
  EXPECT_LT(here, 0.02);  // a fifth of the voxel
  // Rounding of rows moves voxels' means by 1e-7 m, and hypotheses hence differ a little.
  EXPECT_NEAR(error_at({1e6, 1e6, 0}, {1e6, 1e6, 0}), here, 2e-3);
  EXPECT_NEAR(error_at({691000, 5.2e6, 300}, {691020, 5.2e6, 310}), here, 2e-3);
  const PointCloud overlay = io::read_point_cloud(folder_ / "o.ply");
  EXPECT_LT((overlay.origin - Eigen::Vector3d(691020, 5.2e6, 310)).norm(), 10);
  expect_holds(run({"info", folder_ / "b.ply"}).out, {"extent", "from 6910", " 519999"});
}

TEST_F(Register, VoxelSizeByTheClouds) {
  const std::string path = folder_ / "auto.json";
  const Outcome outcome = run({"register", source_, target_, "--backend", "cpu", "--json", path});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"voxels   0.", ", chosen from the clouds"});
  const auto json = json_of(path);
  EXPECT_NE(json["options"]["voxel_size"], 0.05);  // some 15,000 points in a small room
  for (const char* cloud : {"source", "target"}) {
    EXPECT_GE(json[cloud]["prepare"]["points"], 3000);
    EXPECT_LE(json[cloud]["prepare"]["points"], 20000);
  }
  PointCloud one_place;
  one_place.points.assign(5, {1, 2, 3});
  const std::string bad = write_cloud(folder_, "one_place.ply", one_place);
  const Outcome nothing = run({"register", bad, bad, "--backend", "cpu"});
  EXPECT_EQ(nothing.status, 1) << nothing.err;
  expect_holds(nothing.out, {"too_few_source_points"});
  expect_refused({"register", bad, bad, "--voxel-size", "auto"},
                 {"--voxel-size auto", bad, "one place"});
  expect_refused({"register", source_, target_, "--voxel-size", "automatic"},
                 {"--voxel-size", "automatic"});
}

TEST_F(Register, TimeBudget) {
  const std::string path = folder_ / "budget.json";
  const Outcome outcome = align({"--time-budget", "60000", "--json", path});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"budget   60000.0 ms", "levels of quality up to"});
  const auto budget = json_of(path)["time_budget"];
  EXPECT_EQ(budget["ms"], 60000);
  EXPECT_GE(budget["levels"], 2);
  EXPECT_LE(budget["quality"], budget["highest_quality"]);
  expect_refused({"register", source_, target_, "--time-budget", "0"}, {"--time-budget is 0"});
  expect_refused({"register", source_, target_, "--time-budget", "5", "--preset", "loopsmart"},
                 {"quadruples"});
}

TEST_F(Register, Json) {
  const std::string path = folder_ / "r.json";
  ASSERT_EQ(align({"--json", path, "--seed", "7"}).status, 0);
  const auto json = json_of(path);
  EXPECT_EQ(json["options"]["seed"], 7);
  EXPECT_EQ(json["options"]["voxel_size"], 0.1);
  EXPECT_EQ(json["environment"]["backend"], "cpu");
  EXPECT_EQ(json["source"]["file"], source_);
  EXPECT_EQ(json["source"]["prepare"]["input_points"], room_scan(0).points.size());
  double parts = 0;
  for (const char* stage :
       {"downsample", "normals", "features", "grid", "depth_maps", "surface_sides"})
    parts += json["source"]["prepare"]["ms"][stage].get<double>();
  EXPECT_DOUBLE_EQ(json["source"]["prepare"]["ms"]["total"].get<double>(), parts);
  const auto& result = json["result"];
  EXPECT_EQ(result["status"], "aligned");
  EXPECT_EQ(result["reason"], "none");
  EXPECT_GT(result["confidence"], 0.5);
  EXPECT_EQ(result["target_from_source"].size(), 16u);
  EXPECT_EQ(result["information_redwood"].size(), 36u);
  // Redwood counts the correspondences in the first entry, Open3D behind the rotation block;
  // inliers also pass the normal test.
  EXPECT_EQ(result["information_redwood"][0], result["information_open3d"][21]);
  EXPECT_GE(result["information_redwood"][0], result["statistics"]["inliers"]);
  EXPECT_LE(result["information_redwood"][0], result["statistics"]["source_points"]);
}

TEST_F(Register, VerifiesPosesOfAFile) {
  const std::string path = folder_ / "r.json", poses = folder_ / "poses.txt";
  ASSERT_EQ(align({"--json", path}).status, 0);
  const auto found = json_of(path)["result"];
  std::ostringstream text;
  text.precision(17);
  text << "# the pose of align, and the same a metre beside\n";
  for (const double shift : {0.0, 1.0})
    for (std::size_t k = 0; k < 16; ++k)
      text << found["target_from_source"][k].get<double>() + (k == 3 ? shift : 0.0)
           << (k % 4 == 3 ? "\n" : " ");
  std::ofstream(poses) << text.str();
  const Outcome outcome = align({"--initial", poses, "--json", path});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"status   aligned", "pose 1 of " + poses, "pose 2 of " + poses});
  const auto verified = json_of(path)["result"];
  EXPECT_EQ(verified["target_from_source"], found["target_from_source"]);
  EXPECT_EQ(verified["confidence"], found["confidence"]);
  EXPECT_EQ(verified["modes"].size(), 2u);
  EXPECT_EQ(verified["modes"][0]["evidence"]["overlap"], found["modes"][0]["evidence"]["overlap"]);
  EXPECT_LT(verified["modes"][1]["confidence"], 0.1);
  EXPECT_EQ(align({"--initial", poses, "--refine-initial", "--ignore-alternatives"}).status, 0);

  const auto refused = [&](const std::string& content, std::initializer_list<std::string> words) {
    std::ofstream(poses) << content;
    expect_refused(joined({"register", source_, target_, "--initial", poses}, kSmall), words);
  };
  refused("", {poses, "no pose"});
  refused("1 0 0 0\n0 1 0 0\n", {poses + ":2", "ends within a 4 x 4 block"});
  refused("1 0 0 0\n0 1 0\n", {poses + ":2", "3 fields", "a row of a pose"});
  refused("1 0 0 x\n", {poses + ":1", "'x'"});
  refused("2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n", {poses + ":4", "no rigid motion"});
  expect_refused(joined({"register", source_, target_, "--refine-initial"}, kSmall), {"--initial"});
}

TEST_F(Register, SeedDecidesAndThreadsDoNot) {
  const auto result = [&](const std::vector<std::string>& more) {
    EXPECT_EQ(align(joined({"--json", folder_ / "r.json"}, more)).status, 0);
    auto json = json_of(folder_ / "r.json")["result"];
    json.erase("ms");
    return json;
  };
  const auto one = result({"--threads", "1"});
  EXPECT_EQ(one, result({"--threads", "7"}));
  EXPECT_NE(one["modes"], result({"--seed", "2"})["modes"]);
  EXPECT_EQ(result(kLoopsmart)["statistics"]["refine_iterations"], 0);
}

TEST_F(Register, MinimalScoreIsTheThreshold) {
  const std::string path = folder_ / "r.json";
  const Outcome none = align({"--min-confidence", "1", "--json", path});
  EXPECT_EQ(none.status, 1);
  expect_holds(none.out, {"not_aligned: confidence_too_low", "try      ", "--min-confidence",
                          "best candidate"});
  EXPECT_EQ(json_of(path)["options"]["min_confidence"], 1.0);
  align(joined(kLoopsmart, {"--min-confidence", "0.9", "--json", path}));
  EXPECT_EQ(json_of(path)["options"]["min_confidence"], 0.9);
  const std::string other = write_cloud(folder_, "sticks.ply", sticks());
  const std::vector<std::string> without_overlap = joined({"register", source_, other}, kSmall);
  EXPECT_EQ(run(without_overlap).status, 1);
  EXPECT_EQ(run(joined(without_overlap, {"--min-confidence", "0"})).status, 0);
}

TEST_F(Register, Overlay) {
  const std::string path = folder_ / "overlay.ply";
  ASSERT_EQ(align({"--overlay", path}).status, 0);
  const PointCloud overlay = io::read_point_cloud(path);
  EXPECT_EQ(overlay.points.size(), room_scan(0).points.size() + room_scan(1).points.size());
  expect_holds(content_of(path).substr(0, 400), {"property uchar red"});
}

// Width and height stand at fixed places of a PNG, high byte first.
std::pair<unsigned, unsigned> png_size(const std::string& bytes) {
  const auto number = [&](std::size_t at) {
    unsigned value = 0;
    for (std::size_t k = at; k < at + 4; ++k)
      value = value << 8 | static_cast<unsigned char>(bytes[k]);
    return value;
  };
  return {number(16), number(20)};
}

TEST_F(Register, Image) {
  const std::string path = folder_ / "picture.png";
  ASSERT_EQ(align({"--image", path}).status, 0);
  const std::string bytes = content_of(path);
  ASSERT_EQ(bytes.substr(0, 8), "\x89PNG\r\n\x1a\n");
  const auto [width, height] = png_size(bytes);
  EXPECT_GT(width, 800u);
  EXPECT_GT(height, 300u);
  EXPECT_GT(bytes.size(), 20000u) << "an empty picture compresses to less";
}

TEST_F(Register, WithoutAPoseThereIsNoOverlayButAPicture) {
  PointCloud nothing;
  const Outcome outcome =
      run(joined({"register", write_cloud(folder_, "none.ply", nothing), target_, "--overlay",
                  folder_ / "o.ply", "--image", folder_ / "p.png", "--json", folder_ / "r.json"},
                 kSmall));
  EXPECT_EQ(outcome.status, 1);
  expect_holds(outcome.err, {"no overlay written"});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "o.ply"));
  EXPECT_EQ(content_of(folder_ / "p.png").substr(1, 3), "PNG");
  EXPECT_TRUE(json_of(folder_ / "r.json")["result"]["target_from_source"].is_null());
}

}  // namespace
}  // namespace gpureg::test
