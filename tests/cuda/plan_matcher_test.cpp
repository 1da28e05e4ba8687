// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/plan_matcher.hpp"

#include "api/access.hpp"
#include "cuda/gpu.hpp"
#include "support/random_plan.hpp"

namespace gpureg::test {
namespace {

void expect_equal_places(int width, int height) {
  const RandomPlan map(width, height, static_cast<unsigned>(width));
  const Context cpu = Context::cpu(2), cuda = Context::cuda();
  const auto expected = Access::engine(cpu)->match_plan(map.view());
  const auto matcher = Access::engine(cuda)->match_plan(map.view());
  for (const std::size_t most : {3, 700, 20000}) {
    const auto cells = expected->best_cells(span_of(map.scans), most);
    EXPECT_EQ(matcher->best_cells(span_of(map.scans), most), cells) << width << " " << most;
    EXPECT_EQ(matcher->refine(span_of(map.scans), cells),
              expected->refine(span_of(map.scans), cells));
  }
  EXPECT_TRUE(matcher->best_cells({}, 8).empty());
}

TEST(PlanMatcherOnCuda, PlacesInSmallMapsDoNotDependOnTheBackend) {
  GPUREG_GPU_OR_SKIP();
  expect_equal_places(5, 4);
  expect_equal_places(33, 20);
}

TEST(PlanMatcherOnCuda, PlacesInALargeMapDoNotDependOnTheBackend) {
  GPUREG_GPU_OR_SKIP();
  expect_equal_places(700, 400);
}

}  // namespace
}  // namespace gpureg::test
