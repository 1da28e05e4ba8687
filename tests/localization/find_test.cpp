// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/localization/find.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "support/cpu_context.hpp"
#include "support/expect_error.hpp"

namespace gpureg::test {
namespace {

using namespace localization;

/// Axis-parallel in a frame of its own.
struct Box {
  Eigen::Vector3d middle, half;
};

/// Boxes that move together.
struct Body {
  std::vector<Box> boxes;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();

  double hit(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) const {
    const Eigen::Vector3d o = pose.inverse() * eye, d = pose.linear().transpose() * ray;
    double first = std::numeric_limits<double>::infinity();
    for (const Box& box : boxes) {
      double near = 0, far = first;
      for (int k = 0; k < 3; ++k) {
        const double a = (box.middle[k] - box.half[k] - o[k]) / d[k],
                     b = (box.middle[k] + box.half[k] - o[k]) / d[k];
        near = std::max(near, std::min(a, b));
        far = std::min(far, std::max(a, b));
      }
      if (near > 0 && near < far) first = near;
    }
    return first;
  }
};

/// A base, a wall at its end and a post, 8 cm long.
std::vector<Box> stepped() {
  return {{{0, 0, .01}, {.04, .025, .01}},
          {{-.03, 0, .035}, {.01, .025, .015}},
          {{.02, .01, .035}, {.009, .009, .015}}};
}

/// Points on the boxes' faces, also on those inside other boxes, as CAD files have them.
PointCloud model_of(const std::vector<Box>& boxes) {
  PointCloud cloud;
  cloud.model = true;
  std::mt19937 random(1);
  const auto uniform = [&] { return static_cast<double>(random()) / 2147483648.0 - 1; };
  for (const Box& box : boxes)
    for (int k = 0; k < 6000; ++k) {
      const int axis = k % 3;
      const double side = k % 2 == 0 ? 1 : -1;
      Eigen::Vector3d at(uniform(), uniform(), uniform());
      at[axis] = side;
      cloud.points.push_back((box.middle + box.half.cwiseProduct(at)).cast<float>());
      cloud.normals.push_back((side * Eigen::Vector3d::Unit(axis)).cast<float>());
    }
  return cloud;
}

Eigen::Isometry3d placed(double turn, double tilt, const Eigen::Vector3d& at) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = (Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  pose.translation() = at;
  return pose;
}

Eigen::Isometry3d camera_from_world() {
  Eigen::Isometry3d world_from_camera = Eigen::Isometry3d::Identity();
  world_from_camera.linear() =
      Eigen::AngleAxisd(M_PI + .2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  world_from_camera.translation() = Eigen::Vector3d(0, -.1, .5);
  return world_from_camera.inverse();
}

/// A tray with bodies in it as a depth camera sees it from above, noise 0.4 mm.
PointCloud scene_of(const std::vector<Body>& bodies) {
  std::vector<Body> all = bodies;
  all.push_back({{{{0, 0, -.01}, {.16, .12, .01}},
                  {{0, .12, .02}, {.16, .005, .04}},
                  {{0, -.12, .02}, {.16, .005, .04}}}});
  const Eigen::Isometry3d camera = camera_from_world(), world = camera.inverse();
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 0.0004);
  PointCloud cloud;
  cloud.viewpoints = {Eigen::Vector3f::Zero()};
  for (int v = -90; v < 90; ++v)
    for (int u = -120; u < 120; ++u) {
      const Eigen::Vector3d ray = Eigen::Vector3d(u + .5, v + .5, 300).normalized();
      double range = std::numeric_limits<double>::infinity();
      for (const Body& body : all)
        range = std::min(range, body.hit(world.translation(), world.linear() * ray));
      if (std::isfinite(range))
        cloud.points.push_back((ray * (range + noise(random))).cast<float>());
    }
  return cloud;
}

std::vector<Body> three_parts() {
  return {{stepped(), placed(.4, 0, {-.1, .04, 0})},
          {stepped(), placed(2.3, 0, {.09, .05, 0})},
          {stepped(), placed(-1.2, M_PI / 2, {.02, -.06, .026})}};
}

/// Something else of boxes.
Body clutter(double turn, const Eigen::Vector3d& at) {
  return {{{{0, 0, .02}, {.02, .015, .02}}, {{.02, .02, .01}, {.03, .01, .01}}},
          placed(turn, 0, at)};
}

/// Displacement of the part's far corner, metres.
double error(const FoundPart& found, const Body& body) {
  const Eigen::Vector3d corner(.04, .025, .05);
  const Eigen::Isometry3d truth = camera_from_world() * body.pose;
  return std::max((found.scene_from_part * corner - truth * corner).norm(),
                  (found.scene_from_part.translation() - truth.translation()).norm());
}

TEST(FindPart, FindsEveryInstanceOnceAmongClutter) {
  const std::vector<Body> bodies = three_parts();
  std::vector<Body> all = bodies;
  all.push_back(clutter(.7, {-.01, .08, 0}));
  all.push_back(clutter(-2, {.11, -.07, 0}));
  const PointCloud part = model_of(stepped()), scene = scene_of(all);
  const FindResult result = find(context(), part.view(), scene.view());
  EXPECT_EQ(result.status, FindStatus::found);
  ASSERT_EQ(result.instances.size(), bodies.size()) << explain(result);
  for (const Body& body : bodies) {
    double least = 1;
    for (const FoundPart& found : result.instances) least = std::min(least, error(found, body));
    EXPECT_LT(least, 0.002);  // half a voxel
  }
  for (const FoundPart& found : result.instances) {
    EXPECT_TRUE(found.evidence.viewpoint_known);
    EXPECT_GT(found.evidence.supported, 0.8);
  }
}

TEST(FindPart, FindsNoneWhereThereIsNone) {
  const PointCloud part = model_of(stepped()),
                   scene = scene_of({clutter(.7, {-.01, .08, 0}), clutter(-2, {.11, -.07, 0}),
                                     clutter(1, {.04, 0, 0})});
  const FindResult result = find(context(), part.view(), scene.view());
  EXPECT_EQ(result.status, FindStatus::not_found);
  EXPECT_TRUE(result.instances.empty()) << result.instances.front().confidence;
}

TEST(FindPart, TheNumberOfThreadsDoesNotMatter) {
  const PointCloud part = model_of(stepped()), scene = scene_of({three_parts()[0]});
  FindOptions options;
  options.quality = 0;
  const FindResult two = find(context(), part.view(), scene.view(), options),
                   one = find(Context::cpu(1), part.view(), scene.view(), options);
  ASSERT_EQ(one.instances.size(), two.instances.size());
  for (std::size_t k = 0; k < two.instances.size(); ++k) {
    EXPECT_EQ(one.instances[k].scene_from_part.matrix(), two.instances[k].scene_from_part.matrix());
    EXPECT_EQ(one.instances[k].confidence, two.instances[k].confidence);
  }
}

TEST(FindPart, WithoutAViewpointTheSurfaceAloneDecides) {
  const std::vector<Body> bodies{three_parts()[0]};
  PointCloud scene = scene_of(bodies);
  scene.viewpoints.clear();
  PointCloudView view = scene.view();
  view.infer_viewpoint = false;
  FindOptions options;
  options.min_confidence = 0;
  const FindResult result = find(context(), model_of(stepped()).view(), view, options);
  ASSERT_FALSE(result.instances.empty());
  EXPECT_FALSE(result.instances.front().evidence.viewpoint_known);
  EXPECT_LT(error(result.instances.front(), bodies.front()), 0.002);
}

TEST(FindPart, PosesThatASymmetryMakesEqualAreOneInstance) {
  const std::vector<Box> box{{{0, 0, .015}, {.04, .025, .015}}};
  const std::vector<Body> bodies{{box, placed(.4, 0, {-.08, .04, 0})},
                                 {box, placed(1.9, 0, {.07, -.03, 0})}};
  const FindResult result = find(context(), model_of(box).view(), scene_of(bodies).view());
  const Eigen::Vector3d middle(0, 0, .015);
  std::uint32_t equivalent = 0;
  for (const Body& body : bodies) {
    int here = 0;
    for (const FoundPart& found : result.instances) {
      const Eigen::Vector3d truth = camera_from_world() * body.pose * middle;
      if ((found.scene_from_part * middle - truth).norm() > 0.02) continue;
      EXPECT_LT((found.scene_from_part * middle - truth).norm(), 0.002);
      ++here;
      equivalent += found.equivalent_poses;
    }
    EXPECT_EQ(here, 1);
  }
  EXPECT_GT(equivalent, 0u);
}

TEST(FindPart, AHiddenPartSupportsLessAndIsOccluded) {
  std::vector<Body> bodies{three_parts()[0]};
  const PointCloud part = model_of(stepped());
  const FindResult open = find(context(), part.view(), scene_of(bodies).view());
  ASSERT_EQ(open.instances.size(), 1u);
  // A bar above a third of the part.
  bodies.push_back({{{{-.1, .02, .1}, {.05, .012, .01}}}});
  const FindResult hidden = find(context(), part.view(), scene_of(bodies).view());
  ASSERT_FALSE(hidden.instances.empty());
  EXPECT_LT(error(hidden.instances.front(), bodies.front()), 0.003);
  EXPECT_GT(hidden.instances.front().evidence.occluded,
            open.instances.front().evidence.occluded + 0.1);
}

TEST(FindPart, SaysWhatIsWrongWithItsInput) {
  const PointCloud part = model_of(stepped()), scene = scene_of(three_parts());
  const PointCloud nothing;
  FindResult result = find(context(), nothing.view(), scene.view());
  EXPECT_EQ(result.status, FindStatus::too_few_part_points);
  EXPECT_NE(explain(result).find("the part has 0 points"), std::string::npos) << explain(result);
  result = find(context(), part.view(), nothing.view());
  EXPECT_EQ(result.status, FindStatus::too_few_scene_points);
  EXPECT_NE(explain(result).find("the scene has 0 points"), std::string::npos) << explain(result);
  result = find(context(), scene.view(), part.view());
  EXPECT_EQ(result.status, FindStatus::scene_smaller_than_part);
  EXPECT_NE(explain(result).find("is the part the first argument"), std::string::npos);

  FindOptions options;
  options.voxel_size = 0.05f;
  expect_error<InvalidArgument>([&] { find(context(), part.view(), scene.view(), options); },
                                {"voxel_size is 0.05", "a twentieth"});
  options.voxel_size = -1;
  expect_error<InvalidArgument>([&] { find(context(), part.view(), scene.view(), options); },
                                {"voxel_size is -1"});
  options = {};
  options.min_confidence = 2;
  expect_error<InvalidArgument>([&] { find(context(), part.view(), scene.view(), options); },
                                {"min_confidence is 2"});
  PointCloud millimetres = scene;
  for (Eigen::Vector3f& p : millimetres.points) p *= 10'000;
  expect_error<InvalidArgument>([&] { find(context(), part.view(), millimetres.view()); },
                                {"scene", "part", "unit"});
}

}  // namespace
}  // namespace gpureg::test
