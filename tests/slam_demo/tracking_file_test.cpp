// SPDX-License-Identifier: BSD-3-Clause
#include "tracking/tracking_file.hpp"

#include <gtest/gtest.h>
#include <gpureg/error.hpp>

#include <functional>
#include <random>

#include "io/mutate.hpp"
#include "output/output.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace slam_demo {
namespace {

using gpureg::test::content_of;
using gpureg::test::expect_error;
using gpureg::test::TemporaryFolder;

std::shared_ptr<Features> features(int count) {
  auto out = std::make_shared<Features>();
  for (int k = 0; k < count; ++k) {
    out->keys.emplace_back(10.f + 5.f * static_cast<float>(k), 20.f, 31.f);
    out->keys.back().octave = 0;
  }
  out->descriptors.resize(at(count));
  out->depth.assign(at(count), 1.5f);
  out->index();
  return out;
}

/// Two keyframes that see two points.
Tracking tracking() {
  Tracking t;
  for (int k = 0; k < 2; ++k) {
    Keyframe keyframe;
    keyframe.frame = k;
    keyframe.time = k;
    keyframe.features = features(3);
    keyframe.points = {0, kNone, 1};
    keyframe.covisible = {{1 - k, 2}};
    t.map.keyframes.push_back(keyframe);
    t.frames.push_back({static_cast<double>(k), 0, k});
  }
  for (int point = 0; point < 2; ++point) {
    MapPoint p;
    p.first_keyframe = 0;
    p.observations = {{0, 2 * point}, {1, 2 * point}};
    t.map.points.push_back(p);
  }
  t.map.links.push_back({0, 1, Eigen::Isometry3d::Identity(), information_of(0.1, 0.1)});
  BuiltFragment fragment;
  fragment.keyframe = 1;
  fragment.cloud.points = {{1, 2, 3}};
  fragment.cloud.normals = {{0, 0, 1}};
  t.fragments.push_back(fragment);
  return t;
}

TEST(TrackingFile, ReadsBack) {
  const TemporaryFolder folder;
  Tracking written = tracking();
  write_tracking(folder / "a", written);
  Tracking again = read_tracking(folder / "a");
  write_tracking(folder / "b", again);
  EXPECT_EQ(content_of(folder / "a"), content_of(folder / "b"));
}

TEST(TrackingFile, IndicesOfWhatIsNotThereAreRefused) {
  const std::vector<std::pair<const char*, std::function<void(Tracking&)>>> damages = {
      {"sees a point", [](Tracking& t) { t.map.keyframes[0].points[2] = 2; }},
      {"sees a point", [](Tracking& t) { t.map.keyframes[0].points[2] = -2; }},
      {"points without features", [](Tracking& t) { t.map.keyframes[0].points.pop_back(); }},
      {"shares points", [](Tracking& t) { t.map.keyframes[0].covisible = {{2, 1}}; }},
      {"no session", [](Tracking& t) { t.map.keyframes[0].session = kNone; }},
      {"a point is of no keyframe", [](Tracking& t) { t.map.points[0].first_keyframe = 9; }},
      {"no feature", [](Tracking& t) { t.map.points[0].observations[0].keyframe = -1; }},
      {"no feature", [](Tracking& t) { t.map.points[0].observations[0].key = 3; }},
      {"a link", [](Tracking& t) { t.map.links[0].b = 1 << 20; }},
      {"a frame", [](Tracking& t) { t.frames[1].reference = kNone; }},
      {"a fragment", [](Tracking& t) { t.fragments[0].keyframe = kNone; }},
      {"a fragment", [](Tracking& t) { t.fragments[0].cloud.normals.resize(2); }},
      {"a count", [](Tracking& t) { t.lost = -1; }},
      {"lists of features",
       [](Tracking& t) {
         auto f = features(3);
         f->depth.pop_back();
         t.map.keyframes[0].features = f;
       }},
      {"outside the image", [](Tracking& t) {
         auto f = features(3);
         f->keys[1].pt.x = 1e9f;
         t.map.keyframes[0].features = f;
       }}};
  for (const auto& [what, damage] : damages) {
    SCOPED_TRACE(what);
    const TemporaryFolder folder;
    Tracking t = tracking();
    damage(t);
    write_tracking(folder / "a", t);
    expect_error<gpureg::IoError>([&] { read_tracking(folder / "a"); },
                                  {folder / "a", "is damaged", what});
  }
}

TEST(TrackingFile, AnyBytesAreReadOrRefused) {
  const TemporaryFolder folder;
  Tracking t = tracking();
  write_tracking(folder / "a", t);
  const std::string whole = content_of(folder / "a");
  std::mt19937_64 random(4);
  for (int k = 0; k < 3000; ++k) {
    const std::string path = folder.write("b", gpureg::test::mutate(whole, random));
    try {
      read_tracking(path);
    } catch (const gpureg::IoError& error) {
      ASSERT_NE(std::string(error.what()).find(path), std::string::npos);
    }
  }
}

// A run of an hour must not be lost because of the name of its folder.
TEST(Output, NamesThatAreNoUtf8OrLookLikeScripts) {
  const TemporaryFolder folder;
  RunResult result;
  result.sequence = "/scans/\xff\xfe <!--<script>";
  Slam slam(gpureg::Context::cpu(1), result.rig, SlamOptions{});
  write_results(folder / "out", slam, result);
  EXPECT_NE(content_of(folder / "out/loops.json").find("/scans/"), std::string::npos);
  const std::string page = content_of(folder / "out/report.html");
  EXPECT_EQ(page.find("<!--<script>"), std::string::npos);
  EXPECT_NE(page.find("\\u003c!--\\u003cscript>"), std::string::npos);
}

}  // namespace
}  // namespace slam_demo
