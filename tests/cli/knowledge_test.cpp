// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <sstream>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "support/cube.hpp"

namespace gpureg::test {
namespace {

/// What a user knows of the clouds: viewpoints, the vertical direction, and that one is a mesh.
class Knowledge : public ::testing::Test {
 protected:
  void refused(const std::vector<std::string>& more, std::initializer_list<std::string> words) {
    expect_refused(joined(joined({"register", source_, target_}, kSmall), more), words);
  }
  nlohmann::json aligned(const std::vector<std::string>& more) {
    const std::string path = folder_ / "r.json";
    const Outcome outcome =
        run(joined(joined({"register", source_, target_, "--json", path}, kSmall), more));
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    return json_of(path);
  }

  const TemporaryFolder folder_;
  const std::string source_ = write_cloud(folder_, "source.ply", room_scan(0));
  const std::string target_ = write_cloud(folder_, "target.ply", room_scan(1));
};

TEST_F(Knowledge, ViewpointsAreSaidOrNot) {
  const auto decision = [](const nlohmann::json& json, const char* cloud) {
    return json[cloud]["prepare"]["viewpoint"];
  };
  const auto said = aligned({"--source-viewpoint", "0,0,0"});
  EXPECT_EQ(decision(said, "source"), "given");
  EXPECT_NE(decision(said, "target"), "given");
  const auto none = aligned({"--source-viewpoint", "none", "--target-viewpoint", "none"});
  EXPECT_EQ(decision(none, "source"), "none");
  EXPECT_EQ(decision(none, "target"), "none");
}

TEST_F(Knowledge, WrongViewpointsAreNamed) {
  for (const char* option : {"--source-viewpoint", "--target-viewpoint"})
    for (const char* value :
         {"0,0", "0,0,0,0", "0,0,nan", "inf,0,0", "0,0,1e999", "here", "", ",,", "1;2;3", "0,0,x"})
      refused({option, value},
              {option, std::string(" is ") + value, "x,y,z (finite), model, none or auto"});
}

TEST_F(Knowledge, AViewpointThatIsTooFarIsNamed) {
  refused({"--source-viewpoint", "1e30,0,0"}, {"source", "viewpoint", "1e+30", "normal_radius"});
}

TEST_F(Knowledge, AViewpointInAWallIsSaid) {
  const PointCloud scan = room_scan(0);
  std::ostringstream point;  // on a surface that the scan has densely
  const Eigen::Vector3f p = scan.points[scan.points.size() / 2];
  point << p.x() << ',' << p.y() << ',' << p.z();
  const Outcome outcome =
      run(joined({"register", source_, target_, "--source-viewpoint", point.str()}, kSmall));
  expect_holds(outcome.err, {"note: --source-viewpoint " + point.str(), "surface", source_});
  EXPECT_EQ(run(joined({"register", source_, target_, "--source-viewpoint", "0,0,0"}, kSmall)).err,
            "");
}

TEST_F(Knowledge, ViewpointsOfABatch) {
  const TemporaryFolder scans;
  write_scans(scans, 2, false);
  expect_refused({"batch", scans.path(), "-o", scans / "r.log", "--viewpoint", "0,0,0"},
                 {"--viewpoint", "0,0,0"});
  const std::string json = scans / "r.json";
  ASSERT_EQ(run(joined({"batch", scans.path(), "-o", scans / "r.log", "--json", json, "--viewpoint",
                        "none"},
                       kSmall))
                .status,
            0);
  for (const auto& fragment : json_of(json)["fragments"]) EXPECT_EQ(fragment["viewpoint"], "none");
}

TEST_F(Knowledge, WrongVerticalDirectionsAreNamed) {
  const auto up = [&](const std::string& value, const std::string& expected) {
    refused({"--up", value}, {"--up is " + value, expected});
    const TemporaryFolder scans;
    write_scans(scans, 2, false);
    expect_refused({"batch", scans.path(), "-o", scans / "r.log", "--up", value},
                   {"--up is " + value, expected});
  };
  up("0,0,0", "not 0");
  up("0,0,nan", "finite");
  up("0,0,inf", "finite");
  up("0,1", "x,y,z or x,y,z,degrees");
  up("0,0,1,5,6", "x,y,z or x,y,z,degrees");
  up("z", "x,y,z");
  up("0,0,1,0", "(0, 180]");
  up("0,0,1,-3", "(0, 180]");
  up("0,0,1,181", "(0, 180]");
  up("0,0,1,nan", "(0, 180]");
  refused({"--up", "0,0,1", "--time-budget", "100"}, {"--up", "--time-budget"});
}

TEST_F(Knowledge, TheVerticalDirectionExcludesPoses) {
  const Eigen::Isometry3d truth = scan_from_room(1) * scan_from_room(0).inverse();
  const auto text = [](const Eigen::Vector3d& v, double degrees) {
    std::ostringstream out;
    out << v.x() << ',' << v.y() << ',' << v.z() << ',' << degrees;
    return out.str();
  };
  // The axis of the rotation is the same direction in both clouds.
  const Eigen::Vector3d axis = Eigen::AngleAxisd(truth.linear()).axis();
  EXPECT_EQ(aligned({"--up", text(axis, 5)})["result"]["status"], "aligned");
  const double turned = Eigen::AngleAxisd(truth.linear()).angle() * 180 / M_PI;
  ASSERT_GT(turned, 20);
  const Outcome wrong =
      run(joined({"register", source_, target_, "--up", text(axis.unitOrthogonal(), 5)}, kSmall));
  EXPECT_EQ(wrong.status, 1) << wrong.out;
  expect_holds(wrong.out, {"--source-up and --target-up"});
  // Any direction does, where each cloud has its own.
  const auto own = [](const Eigen::Vector3d& v) {
    std::ostringstream out;
    out << v.x() << ',' << v.y() << ',' << v.z();
    return out.str();
  };
  const Eigen::Vector3d up = axis.unitOrthogonal();
  EXPECT_EQ(aligned({"--source-up", own(up), "--target-up",
                     own(truth.linear() * up)})["result"]["status"],
            "aligned");
  EXPECT_EQ(
      aligned({"--up", text(up, 5), "--target-up", own(truth.linear() * up)})["result"]["status"],
      "aligned");
  refused({"--target-up", "0,0,1"}, {"--target-up needs --up or --source-up"});
  refused({"--up", "0,0,1", "--source-up", "0,0,1,5"}, {"--source-up is 0,0,1,5", "x,y,z"});
}

/// An L-shaped prism: closed, and without symmetry but for a mirror.
std::string bracket() {
  return "v 0 0 0\nv 1 0 0\nv 1 0.3 0\nv 0.25 0.3 0\nv 0.25 0.7 0\nv 0 0.7 0\n"
         "v 0 0 0.4\nv 1 0 0.4\nv 1 0.3 0.4\nv 0.25 0.3 0.5\nv 0.25 0.7 0.5\nv 0 0.7 0.5\n"
         "f 6 5 4 1\nf 4 3 2 1\nf 7 10 11 12\nf 7 8 9 10\nf 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\n"
         "f 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";
}

TEST(MeshInput, EveryVerbSamplesTheFaces) {
  const TemporaryFolder folder;
  const std::string a = folder.write("cloud_bin_0.obj", bracket());
  const std::string b = folder.write("cloud_bin_1.obj", bracket());
  const std::vector<std::string> size = {"--voxel-size", "0.02", "--backend", "cpu"};
  const Outcome info = run({"info", a});
  EXPECT_EQ(info.status, 0) << info.err;
  expect_holds(info.out, {"20,000, with normals", "--voxel-size"});
  expect_holds(info.err, {a, "faces were sampled by 20,000 points"});
  // Whatever the confidence: the reading of the faces is tested.
  const Outcome pair = run(joined({"register", a, b, "--min-confidence", "0"}, size));
  EXPECT_EQ(pair.status, 0) << pair.out << pair.err;
  const std::string json = folder / "r.json";
  const Outcome batch = run(joined(
      {"batch", folder.path(), "-o", folder / "r.log", "--json", json, "--min-confidence", "0"},
      size));
  EXPECT_EQ(batch.status, 0) << batch.out << batch.err;
  expect_holds(batch.err, {a, b, "faces were sampled"});
  for (const auto& fragment : json_of(json)["fragments"]) EXPECT_GT(fragment["points"], 2000);
}

TEST(MeshInput, WrongMeshesAreNamed) {
  const TemporaryFolder folder;
  const std::string good = write_cloud(folder, "cloud_bin_0.ply", room_scan(0));
  const auto refused = [&](const std::string& content, std::initializer_list<std::string> words) {
    const std::string bad = folder.write("cloud_bin_1.obj", content);
    for (const auto& arguments :
         std::vector<std::vector<std::string>>{{"register", bad, good},
                                               {"register", good, bad},
                                               {"info", bad},
                                               {"batch", folder.path(), "-o", folder / "r.log"}}) {
      expect_refused(arguments, {bad});
      expect_refused(arguments, words);
    }
  };
  refused("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", {"none of 1 has an area"});
  auto vertices = cube_vertices();
  vertices[2].x() = std::nan("");
  std::filesystem::remove(folder / "cloud_bin_1.obj");
  const std::string bad = folder.write("cloud_bin_1.ply", ply_text(vertices, cube_faces()));
  expect_refused({"register", good, bad}, {bad, "nan", "finite"});
  expect_refused({"batch", folder.path(), "-o", folder / "r.log"}, {bad, "nan", "finite"});
}

TEST(MeshInput, FlippedAndNonManifoldFacesAreSaid) {
  const TemporaryFolder folder;
  Triangles faces = cube_faces();
  std::swap(faces[0][0], faces[0][1]);
  faces.push_back({0, 1, 7});
  const Outcome info = run({"info", folder.write("cube.ply", ply_text(cube_vertices(), faces))});
  EXPECT_EQ(info.status, 0) << info.err;
  expect_holds(info.err, {"cube.ply", "not closed", "1 faces pointed the wrong way",
                          "1 edges belong to more than two faces"});
}

TEST(KittiInput, IsAFragmentOfABatch) {
  const TemporaryFolder folder;
  for (int k = 0; k < 2; ++k) {
    std::string bytes;
    for (const Eigen::Vector3f& p : room_scan(k).points)
      for (const float value : {p.x(), p.y(), p.z(), 0.f})
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    folder.write("cloud_bin_" + std::to_string(k) + ".bin", bytes);
  }
  EXPECT_EQ(run(joined({"batch", folder.path(), "-o", folder / "r.log"}, kSmall)).status, 0);
  const std::string bad = folder.write("cloud_bin_1.bin", "three bytes");
  expect_refused({"batch", folder.path(), "-o", folder / "r.log"}, {bad, "11 bytes", "16 bytes"});
}

}  // namespace
}  // namespace gpureg::test
