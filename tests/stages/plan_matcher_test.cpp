// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/plan_matcher.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "pipeline/engine.hpp"
#include "support/random_plan.hpp"

namespace gpureg::test {
namespace {

using plan::Place;

constexpr std::size_t kMost = 700;

/// All cells and headings, one wall after another.
std::vector<Place> all_cells(const RandomPlan& map, const plan::Scan& scan) {
  std::vector<Place> out;
  for (int heading = 0; heading < scan.headings; ++heading) {
    const plan::Heading turn = plan::heading_of(heading, scan.headings);
    for (int y = scan.low[1]; y < scan.high[1]; ++y)
      for (int x = scan.low[0]; x < scan.high[0]; ++x) {
        int score = 0;
        for (const plan::Wall& wall : scan.coarse_walls) {
          const plan::Turned at = plan::turned(wall, turn);
          score += map.coarse_bit(scan.has_sides ? at.direction : 16 + at.direction % 8, x + at.dx,
                                  y + at.dy);
        }
        if (score > 0) out.push_back({score, x, y, heading});
      }
  }
  std::sort(out.begin(), out.end(), [](const Place& a, const Place& b) {
    return std::tuple(-a.score, a.heading, a.y, a.x) < std::tuple(-b.score, b.heading, b.y, b.x);
  });
  return out;
}

/// The best ones; of the last score all or none.
std::vector<Place> best_of(std::vector<Place> all, std::size_t most) {
  if (all.size() <= most) return all;
  const int next = all[most].score;
  all.resize(most);
  while (!all.empty() && all.back().score == next) all.pop_back();
  return all;
}

Place refined(const RandomPlan& map, const plan::Scan& scan, const Place& coarse) {
  Place best{-1, 0, 0, 0};
  for (int heading = 2 * coarse.heading - 2; heading <= 2 * coarse.heading + 2; ++heading)
    for (int y = 2 * coarse.y - 3; y <= 2 * coarse.y + 3; ++y)
      for (int x = 2 * coarse.x - 3; x <= 2 * coarse.x + 3; ++x) {
        int score = 0;
        for (const plan::Wall& wall : scan.walls) {
          const plan::Turned at = plan::turned(wall, plan::heading_of(heading, 2 * scan.headings));
          std::uint32_t bits = 1u << at.direction;
          if (!scan.has_sides) bits |= 1u << (at.direction + 8) % 16;
          score += (map.faces(x + at.dx, y + at.dy) & bits) != 0;
        }
        if (score > best.score) best = {score, x, y, heading};
      }
  return best;
}

class PlanMatcherTest : public ::testing::TestWithParam<std::tuple<int, int, unsigned>> {};

TEST_P(PlanMatcherTest, FindsWhatAnExhaustiveSearchFinds) {
  const auto [width, height, threads] = GetParam();
  const RandomPlan map(width, height, static_cast<unsigned>(width));
  const auto engine = make_cpu_engine(threads);
  const auto matcher = engine->match_plan(map.view());
  const auto cells = matcher->best_cells(span_of(map.scans), kMost);
  ASSERT_EQ(cells.size(), map.scans.size());
  std::vector<std::vector<Place>> some;
  for (std::size_t s = 0; s < cells.size(); ++s) {
    const std::vector<Place> all = all_cells(map, map.scans[s]);
    EXPECT_EQ(cells[s], best_of(all, kMost)) << s;
    some.push_back({all.begin(), all.begin() + std::min<std::ptrdiff_t>(20, all.size())});
  }
  EXPECT_TRUE(cells[3].empty());
  EXPECT_TRUE(cells[5].empty());
  const auto fine = matcher->refine(span_of(map.scans), some);
  for (std::size_t s = 0; s < some.size(); ++s)
    for (std::size_t k = 0; k < some[s].size(); ++k)
      EXPECT_EQ(fine[s][k], refined(map, map.scans[s], some[s][k])) << s << " " << k;
}

INSTANTIATE_TEST_SUITE_P(Sizes, PlanMatcherTest,
                         ::testing::Values(std::tuple(5, 4, 1), std::tuple(33, 60, 2),
                                           std::tuple(290, 21, 3)));

TEST(PlanMatcher, ScoresThatTooManyCellsShareAreLeftOut) {
  const RandomPlan map(64, 64, 1);
  const auto engine = make_cpu_engine(2);
  const auto matcher = engine->match_plan(map.view());
  const auto few = matcher->best_cells(span_of(map.scans), 3);
  for (std::size_t s = 0; s < few.size(); ++s)
    EXPECT_EQ(few[s], best_of(all_cells(map, map.scans[s]), 3)) << s;
}

}  // namespace
}  // namespace gpureg::test
