// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "algorithm/inlier.hpp"
#include "api/with_settings.hpp"
#include "cpu/common/cell_summary.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg::cpu {
namespace {

Pose<float> random_pose(std::mt19937& random, float angle, float shift) {
  std::normal_distribution<float> normal;
  Pose<float> p{1,
                angle * normal(random),
                angle * normal(random),
                angle * normal(random),
                shift * normal(random),
                shift * normal(random),
                shift * normal(random)};
  const float n = std::sqrt(p.w * p.w + p.x * p.x + p.y * p.y + p.z * p.z);
  p.w /= n;
  p.x /= n;
  p.y /= n;
  p.z /= n;
  return p;
}

/// Over all pairs of points, no grid.
Support exhaustive_support(const CpuCloud& source, const CpuCloud& target, const Rigid& pose,
                           const InlierTest& test) {
  Support s{0, 0, 0};
  for (std::size_t i = 0; i < source.points.size(); ++i) {
    const Vec3 q = apply(pose, source.points[i]);
    std::uint32_t best = kNoValue;
    float best2 = test.max_squared;
    for (std::uint32_t j = 0; j < target.points.size(); ++j) {
      const float d2 = squared_norm(target.points[j] - q);
      if (d2 < best2 || (best == kNoValue && d2 == best2)) {
        best = j;
        best2 = d2;
      }
    }
    if (best == kNoValue ||
        !normals_agree(rotate(pose, source.normals[i]), target.normals[best], test.min_cosine))
      continue;
    ++s.inliers;
    s.residual += fixed_residual(best2, test.inverse_max_squared);
  }
  return s;
}

class Score : public ::testing::Test {
 protected:
  Score() : random(1), exec(2) {
    // Two samplings of one surface.
    std::mt19937 shape(7);
    a = test::prepare_one(exec, test::raw_cloud(test::bumpy_sheet(shape, 6000, 1.5f)), options);
    shape.seed(7);
    std::vector<Vec3> again = test::bumpy_sheet(shape, 9000, 1.5f);
    again.erase(again.begin(), again.begin() + 3000);
    b = test::prepare_one(exec, test::raw_cloud(again), options);
  }
  std::mt19937 random;
  Exec exec;
  PrepareSettings options;
  std::shared_ptr<CpuCloud> a, b;
};

TEST_F(Score, SupportIsTheExhaustiveOne) {
  for (const float angle : {30.0f, 90.0f, 180.0f})
    for (const float distance : {0.075f, 0.04f}) {
      RegistrationSettings registration;
      registration.quadruples.max_normal_angle = angle;
      registration.prepare.max_correspondence_distance = distance;
      const InlierTest test = inlier_test(distance, angle);
      for (int k = 0; k < 40; ++k) {
        const Rigid pose =
            to_rigid(random_pose(random, k % 2 ? 0.02f : 1.0f, k % 2 ? 0.02f : 0.3f));
        const Support expected = exhaustive_support(*a, *b, pose, test);
        const Support found = measure_support(a->view(), b->view(), pose, registration);
        EXPECT_EQ(found.inliers, expected.inliers);
        EXPECT_EQ(found.residual, expected.residual);
      }
    }
}

TEST_F(Score, BoundsNeverLie) {
  const InlierTest test = inlier_test(options.max_correspondence_distance, 30);
  const SummaryLimits limits(30, true);
  std::size_t decided = 0, all = 0;
  for (int k = 0; k < 200; ++k) {
    const Rigid pose = to_rigid(random_pose(random, k % 2 ? 0.05f : 1.0f, 0.05f));
    for (std::size_t first = 0; first < a->order.x.size(); first += 64) {
      std::int32_t cells[64];
      locate_cells(a->order, first, pose, b->summaries, cells);
      const PointBounds bounds = bound_inliers(a->order, first, pose, b->summaries, limits, cells);
      for (std::size_t l = 0; l < 64; ++l) {
        const std::uint32_t i = a->order.index[first + l];
        const bool possible = bounds.possible >> l & 1, certain = bounds.certain >> l & 1;
        if (i == kNoValue) {
          EXPECT_FALSE(possible);
          continue;
        }
        const Closest c = find_closest(b->view().closest, b->points.data(),
                                       apply(pose, a->points[i]), test.max_squared);
        const bool inlier =
            c.index != kNoValue &&
            normals_agree(rotate(pose, a->normals[i]), b->normals[c.index], test.min_cosine);
        if (inlier) EXPECT_TRUE(possible);
        if (certain) EXPECT_TRUE(inlier);
        decided += possible == certain;
        ++all;
      }
    }
  }
  EXPECT_GT(decided, all / 2);
}

TEST_F(Score, BestIsTheBestOfAllByTheTotalOrder) {
  for (const float angle : {30.0f, 180.0f})
    for (const float distance : {0.075f, 0.05f}) {
      RegistrationSettings registration;
      registration.quadruples.max_normal_angle = angle;
      registration.prepare.max_correspondence_distance = distance;
      std::vector<Hypotheses> hypotheses(1);
      for (std::uint32_t k = 0; k < 700; ++k) {
        hypotheses[0].id.push_back(3 * k);
        // Every pose twice: equal support, so the lower index must win.
        hypotheses[0].pose.push_back(k % 2 ? hypotheses[0].pose.back()
                                           : random_pose(random, k % 3 ? 0.03f : 1.0f, 0.03f));
      }
      const PairView pair = test::pair_view(*a, *b);
      Support best{0, 0, 0};
      for (std::size_t k = 0; k < 700; ++k) {
        Support s = measure_support(pair.source, pair.target, to_rigid(hypotheses[0].pose[k]),
                                    registration);
        s.hypothesis = hypotheses[0].id[k];
        if (k == 0 || better(s, best)) best = s;
      }
      for (const unsigned threads : {1u, 2u, 7u}) {
        Exec pool(threads);
        const BestPose found = score_hypotheses(pool, {&pair, 1}, hypotheses, registration)[0];
        ASSERT_TRUE(found.found);
        EXPECT_EQ(found.support.inliers, best.inliers);
        EXPECT_EQ(found.support.residual, best.residual);
        EXPECT_EQ(found.support.hypothesis, best.hypothesis);
      }
    }
}

TEST_F(Score, NoHypothesesNoPose) {
  const PairView pair = test::pair_view(*a, *b);
  EXPECT_FALSE(score_hypotheses(exec, {&pair, 1}, std::vector<Hypotheses>(1),
                                resolve(RegistrationOptions{}))[0]
                   .found);
}

}  // namespace
}  // namespace gpureg::cpu
