// SPDX-License-Identifier: BSD-3-Clause
// What users get wrong, and the words that have to tell them so: each row is a run of the command,
// its exit status, and what stderr and stdout must say together.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

using Words = std::vector<std::string>;

struct Use {
  const char* name;
  Words arguments;  ///< files without a slash are those of the folder
  int status;
  Words says;
};

std::ostream& operator<<(std::ostream& stream, const Use& use) { return stream << use.name; }

PointCloud scaled(PointCloud cloud, float factor) {
  for (Eigen::Vector3f& p : cloud.points) p *= factor;
  return cloud;
}

PointCloud turned(PointCloud cloud) {  // z up becomes y up
  for (Eigen::Vector3f& p : cloud.points) p = Eigen::Vector3f(p.x(), p.z(), -p.y());
  return cloud;
}

PointCloud plane() {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-3, 3);
  PointCloud cloud;
  for (int k = 0; k < 20'000; ++k) cloud.points.emplace_back(place(random), place(random), 0.f);
  return cloud;
}

/// The room beside four others.
PointCloud house() {
  PointCloud cloud = room_scan(0);
  for (int k = 1; k < 5; ++k)
    for (const Eigen::Vector3f& p :
         room_scan(k, Eigen::Vector3f(1.6f, 0.5f + 0.1f * k, 1.3f)).points)
      cloud.points.emplace_back(p + Eigen::Vector3f(15.f * k, 0, 0));
  return cloud;
}

std::string rows_of(const Eigen::Matrix4d& pose) {
  std::ostringstream text;
  text.precision(17);
  text << pose << "\n";
  return text.str();
}

Eigen::Matrix4d truth() { return (scan_from_room(1) * scan_from_room(0).inverse()).matrix(); }

Eigen::Matrix4d truth_in_millimetres() {
  Eigen::Matrix4d pose = truth();
  pose.topRightCorner<3, 1>() = Eigen::Vector3d(1200, 800, 100);
  return pose;
}

/// The files of all rows.
class WrongUses : public testing::TestWithParam<Use> {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    const PointCloud a = room_scan(0), b = room_scan(1);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    PointCloud nans = a, one, line;
    for (Eigen::Vector3f& p : nans.points) p.x() = nan;
    PointCloud mostly_nan = nans;
    std::copy_n(a.points.begin(), 3, mostly_nan.points.begin());
    one.points = {a.points.front()};
    for (int k = 0; k < 3000; ++k)
      line.points.emplace_back(0.002f * static_cast<float>(k), 0.f, 0.f);
    const std::pair<const char*, PointCloud> clouds[] = {{"a.ply", a},
                                                         {"b.ply", b},
                                                         {"millimetres.ply", scaled(b, 1000)},
                                                         {"centimetres.ply", scaled(b, 100)},
                                                         {"feet.ply", scaled(b, 3.28084f)},
                                                         {"y_up.ply", turned(b)},
                                                         {"sticks.ply", sticks()},
                                                         {"plane.ply", plane()},
                                                         {"nan.ply", nans},
                                                         {"mostly_nan.ply", mostly_nan},
                                                         {"house.ply", house()},
                                                         {"one.ply", one},
                                                         {"empty.ply", {}},
                                                         {"line.ply", line}};
    for (const auto& [name, cloud] : clouds) write_cloud(*folder_, name, cloud);
    std::ifstream whole(*folder_ / "a.ply", std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(whole)), {});
    folder_->write("half.ply", bytes.substr(0, bytes.size() / 2));
    folder_->write("zero.ply", "");
    folder_->write("text.txt", "hello\n");
    folder_->write("good.txt", rows_of(truth()));
    folder_->write("transposed.txt", rows_of(truth_in_millimetres().transpose()));
    folder_->write("inverse.txt", rows_of(truth().inverse()));
    folder_->write("millimetres.txt", rows_of(truth_in_millimetres()));
    folder_->write("angles.txt", "1.2 0.8 0.1 0 0 45\n");
    folder_->write("quaternion.txt", "1.2 0.8 0.1 0 0 0.38 0.92\n");
    std::filesystem::create_directory(*folder_ / "none");
    std::filesystem::create_directory(*folder_ / "scans");
    std::string poses, cameras;
    for (int k = 0; k < 2; ++k) {
      write_cloud(*folder_, "scans/cloud_bin_" + std::to_string(k) + ".ply", k == 0 ? a : b);
      cameras += std::to_string(k) + " 0 512.5 -81 30 0 0 0 1\n";
    }
    folder_->write("scans/cameras.txt", cameras);
    std::filesystem::create_directory(*folder_ / "small");
    for (const char* name : {"small/first.ply", "small/second.ply"})
      write_cloud(*folder_, name, scaled(a, 0.1f));
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static TemporaryFolder* folder_;
};

TemporaryFolder* WrongUses::folder_ = nullptr;

TEST_P(WrongUses, AreSaid) {
  Words arguments;
  for (const std::string& word : GetParam().arguments) {
    const bool file =
        std::filesystem::exists(*folder_ / word) && word != GetParam().arguments.front();
    arguments.push_back(file ? *folder_ / word : word);
  }
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.status, GetParam().status) << outcome.out << outcome.err;
  for (const std::string& words : GetParam().says)
    expect_holds(outcome.err + outcome.out, {words.c_str()});
}

Words align(const char* source, const char* target, const Words& more = kSmall) {
  return joined({"register", source, target}, more);
}

Words with(const char* option, const char* value) { return joined(kSmall, {option, value}); }

INSTANTIATE_TEST_SUITE_P(
    Table, WrongUses,
    testing::Values(
        // Units and sizes.
        Use{"Millimetres",
            align("a.ply", "millimetres.ply"),
            1,
            {"try      are the units different? target is 1", "millimetres and metres",
             "no_usable_features"}},
        Use{"MillimetresAndAuto",
            align("a.ply", "millimetres.ply", {"--voxel-size", "auto", "--backend", "cpu"}),
            2,
            {"are the units different?", "--voxel-size (auto)", "a.ply"}},
        Use{"MillimetresAndTheDefault",
            align("millimetres.ply", "millimetres.ply", {"--backend", "cpu"}),
            0,
            {"voxels   ", ", chosen from the clouds"}},
        Use{"Centimetres",
            align("centimetres.ply", "a.ply", {"--voxel-size", "0.5", "--backend", "cpu"}),
            1,
            {"are the units different? source is ", "centimetres and metres"}},
        Use{"Feet",
            align("a.ply", "feet.ply"),
            1,
            {"are the units different?", "feet and metres", "not_aligned"}},
        Use{"VoxelLargerThanTheCloud",
            align("a.ply", "b.ply", {"--voxel-size", "50"}),
            2,
            {"--voxel-size is 50", "extends over", "gpureg info"}},
        Use{"VoxelTooLarge",
            align("a.ply", "b.ply", {"--voxel-size", "2", "--backend", "cpu"}),
            1,
            {"too_few_points", "points after downsampling", "try", "a smaller --voxel-size"}},
        Use{"VoxelTooSmall",
            align("a.ply", "b.ply", {"--voxel-size", "0.000001"}),
            2,
            {"--voxel-size is 1e-06, from which follows"}},
        Use{"VoxelWithAUnit",
            align("a.ply", "b.ply", {"--voxel-size", "5cm"}),
            2,
            {"--voxel-size: '5cm', expected FLOAT or auto"}},
        // Files.
        Use{"NoCloud", align("a.ply", "text.txt"), 2, {"text.txt", "expected a row of x y z"}},
        Use{"NoFile", align("a.ply", "b.pyl"), 2, {"TARGET: cannot read", "No such file"}},
        Use{"AFolder", align("a.ply", "scans"), 2, {"scans", "folder"}},
        Use{"HalfOfADownload", align("a.ply", "half.ply"), 2, {"half.ply", "truncated", "only"}},
        Use{"NoBytes", align("a.ply", "zero.ply"), 2, {"zero.ply", "empty"}},
        Use{"NoFolderForTheOutput",
            align("a.ply", "b.ply", with("--json", "there/is/none.json")),
            2,
            {"there is no folder there/is"}},
        Use{"AFullDisk",
            align("a.ply", "b.ply", with("--json", "/dev/full")),
            2,
            {"cannot write /dev/full", "No space left"}},
        // Clouds.
        Use{"Empty",
            align("a.ply", "empty.ply"),
            1,
            {"too_few_target_points", "the target has no usable points"}},
        Use{"NotANumber",
            align("nan.ply", "a.ply"),
            1,
            {"not finite, dropped", "the source has no usable points",
             "of the source are not finite", "try      points with coordinates"}},
        Use{"MostlyNotANumber",
            align("a.ply", "mostly_nan.ply"),
            1,
            {"the target has 3 usable points", "of the target are not finite"}},
        Use{"NotANumberInAMap",
            joined({"locate", "mostly_nan.ply", "a.ply"}, kSmall),
            1,
            {"mostly_nan.ply: ", "points are not finite"}},
        Use{"OnePoint", align("a.ply", "one.ply"), 1, {"the target has 1 usable points"}},
        Use{"ALine",
            align("a.ply", "line.ply"),
            1,
            {"no_usable_features", "lines and single points cannot be aligned"}},
        Use{"APlane",
            align("plane.ply", "plane.ply"),
            1,
            {"underconstrained", "is one plane, in which the pose can slide and turn", "corners"}},
        Use{"NoOverlap",
            align("a.ply", "sticks.ply"),
            1,
            {"not_aligned: too_little_overlap", "of the source and", "more of the same place"}},
        Use{"TheSameFileTwice",
            align("a.ply", "a.ply"),
            0,
            {"note: SOURCE and TARGET are the same file", "aligned"}},
        // Knowledge.
        Use{"AnotherUp",
            align("a.ply", "y_up.ply", with("--up", "0,0,1")),
            1,
            {"is up the same direction in both clouds? Else --source-up and --target-up"}},
        Use{"HalfAnUp",
            align("a.ply", "y_up.ply", with("--source-up", "0,0,1")),
            2,
            {"--source-up needs --up or --target-up"}},
        Use{"AViewpointInTheWorld",
            align("a.ply", "b.ply", with("--source-viewpoint", "512,-81,30")),
            0,
            {"note: the viewpoint of", "away from its points", "frame of the cloud"}},
        Use{"CamerasOfAnotherScene",
            joined({"batch", "scans", "-o", "/dev/null"}, kSmall),
            1,
            {"note: the viewpoint of", "away from its points", "1 more"}},
        Use{"APoseWithAngles",
            align("a.ply", "b.ply", with("--initial", "angles.txt")),
            2,
            {"6 fields, as a position with three angles; expected a 4 x 4 matrix"}},
        Use{"APoseWithAQuaternion",
            align("a.ply", "b.ply", with("--initial", "quaternion.txt")),
            2,
            {"7 fields, as a position with a quaternion; expected a 4 x 4 matrix"}},
        Use{"ATransposedPose",
            align("a.ply", "b.ply", with("--initial", "transposed.txt")),
            2,
            {"it looks transposed"}},
        Use{"AnInvertedPose",
            align("a.ply", "b.ply", with("--initial", "inverse.txt")),
            1,
            {"try      the pose looks inverted: its inverse has a confidence of ",
             "expected target_from_source"}},
        Use{"APoseInMillimetres",
            align("a.ply", "b.ply", with("--initial", "millimetres.txt")),
            1,
            {"no_candidate, no pose brings points of both clouds together",
             "in the unit of the clouds?"}},
        Use{"AMapInMillimetres",
            joined({"locate", "a.ply", "millimetres.ply"}, kSmall),
            2,
            {"millimetres"}},
        Use{"MapAndScanExchanged",
            joined({"locate", "house.ply", "b.ply"}, kSmall),
            1,
            {"status   in_question: only ", "the scan extends over 6",
             "is the map the last argument"}},
        Use{"AnotherPlace",
            joined({"locate", "sticks.ply", "a.ply"}, kSmall),
            1,
            {"not_found", "is the scan of this place, in the unit of the map",
             "sizes    the scan extends over 10", ", the map over "}},
        // Words.
        Use{"AnOptionMisspelt",
            align("a.ply", "b.ply", {"--voxelsize", "0.1"}),
            2,
            {"unknown option --voxelsize, did you mean --voxel-size?"}},
        Use{"AVerbMisspelt", {"regsiter", "a.ply", "b.ply"}, 2, {"did you mean register?"}},
        Use{"AFieldMisspelt",
            align("a.ply", "b.ply", with("--set", "prepare.depth_map=4")),
            2,
            {"did you mean depth_maps?"}},
        Use{"NegativeThreads",
            align("a.ply", "b.ply", with("--threads", "-1")),
            2,
            {"--threads: '-1', expected a whole number, 0 or more (0: all)"}},
        Use{"AllThreads", align("a.ply", "b.ply", with("--threads", "0")), 0, {"aligned"}},
        Use{"ASeedOfLetters",
            align("a.ply", "b.ply", with("--seed", "first")),
            2,
            {"--seed: 'first', expected a whole number, 0 or more"}}),
    [](const testing::TestParamInfo<Use>& use) { return std::string(use.param.name); });

}  // namespace
}  // namespace gpureg::test
