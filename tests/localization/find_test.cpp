// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/localization/find.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "localization/find/part_confidence.hpp"
#include "support/cpu_context.hpp"
#include "support/expect_error.hpp"
#include "support/tray.hpp"

namespace gpureg::test {
namespace {

using namespace localization;
using namespace tray;

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

TEST(FindPart, TheSameSharesOfFewerCellsAreLessCertain) {
  PartEvidence e;
  e.viewpoint_known = true;
  e.supported = e.contour = 1;
  e.contour_length = 3;
  e.area = 0.25;
  e.residual = 0.1;
  e.weakest = 0.1;
  e.third_weakest = 0.2;
  e.votes = 40;
  double before = 1;
  for (const double cell : {0.025, 0.05, 0.1, 0.2, 0.4, 1.0, 10.0}) {
    e.cell = cell;
    const double confidence = part_confidence(e);
    EXPECT_LT(confidence, before) << cell;
    before = confidence;
    if (cell == 0.025) EXPECT_GT(confidence, 0.95);
  }
  EXPECT_LT(before, 0.5);  // next to no cell
  e.cell = 0;              // nothing was judged
  EXPECT_LT(part_confidence(e), 0.5);
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
