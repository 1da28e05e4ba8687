// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/surface_graph.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "spacing/slabs.hpp"
#include "spacing/spacing_spread.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg {
namespace {

struct Sheet {
  std::vector<Vec3> points, normals;
};

/// Points near a bumpy sheet with noisy normals of both signs; some without a normal, some twice.
Sheet noisy_sheet(std::mt19937& random, std::size_t size) {
  std::normal_distribution<float> noise(0, 0.3f);
  std::bernoulli_distribution flipped(0.3), unknown(0.02);
  Sheet sheet{test::bumpy_sheet(random, size, 2.5f), {}};
  for (std::size_t i = 0; i + 50 < size; i += 50) sheet.points[i + 1] = sheet.points[i];
  for (std::size_t i = 0; i < size; ++i) {
    const Vec3 n = normalized_or_zero({noise(random), noise(random), 1});
    sheet.normals.push_back(unknown(random) ? Vec3{0, 0, 0} : flipped(random) ? -n : n);
  }
  return sheet;
}

TEST(SurfaceEdges, AreTheTwelveNearestWithinTheRadius) {
  std::mt19937 random(1);
  const float radius = 0.1f;
  for (const std::size_t size : {1, 2, 40, 3000}) {
    const Sheet sheet = noisy_sheet(random, size);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> expected;
    for (std::uint32_t i = 0; i < size; ++i) {
      if (is_zero(sheet.normals[i])) continue;
      std::vector<std::pair<float, std::uint32_t>> near;
      for (std::uint32_t j = 0; j < size; ++j) {
        const Vec3 d = sheet.points[i] - sheet.points[j];
        const float squared = d.x * d.x + d.y * d.y + d.z * d.z;
        if (j != i && !is_zero(sheet.normals[j]) && squared <= radius * radius)
          near.emplace_back(squared, j);
      }
      std::sort(near.begin(), near.end());
      near.resize(std::min<std::size_t>(near.size(), 12));
      for (const auto& [squared, j] : near) expected.emplace_back(std::min(i, j), std::max(i, j));
    }
    std::sort(expected.begin(), expected.end());
    expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
    for (const std::size_t threads : {1, 2, 7}) {
      ThreadGroup group(threads);
      const auto edges = surface_edges(sheet.points, sheet.normals, radius, group);
      ASSERT_EQ(edges.size(), expected.size());
      for (std::size_t k = 0; k < edges.size(); ++k) {
        ASSERT_EQ(std::make_pair(edges[k].a, edges[k].b), expected[k]);
        ASSERT_NEAR(edges[k].cosine, dot(sheet.normals[edges[k].a], sheet.normals[edges[k].b]),
                    1e-6f);
      }
    }
  }
}

/// The share that SurfaceGraph::contradictions() documents, in double and edge by edge.
double contradiction(const Sheet& sheet, const std::vector<SurfaceEdge>& edges, Vec3 viewpoint) {
  double bad = 0, all = 0;
  const auto cosine = [&](std::uint32_t i) {
    const Vec3 n = sheet.normals[i], d = viewpoint - sheet.points[i];
    const double length = std::sqrt(double(d.x) * d.x + double(d.y) * d.y + double(d.z) * d.z);
    return length > 0 ? (double(n.x) * d.x + double(n.y) * d.y + double(n.z) * d.z) / length : 0;
  };
  for (const SurfaceEdge& e : edges) {
    if (std::fabs(e.cosine) < 0.5f) continue;
    const double a = cosine(e.a), b = cosine(e.b);
    const double weight = double(e.cosine) * e.cosine * std::min(std::fabs(a), std::fabs(b));
    all += weight;
    if ((a < 0) != ((b < 0) != (e.cosine < 0))) bad += weight;
  }
  return bad / all;
}

TEST(SurfaceGraph, ContradictionsAgreeWithDouble) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> place(-3, 3);
  const Sheet sheet = noisy_sheet(random, 3000);
  ThreadGroup threads(2);
  const SurfaceGraph graph(sheet.points, sheet.normals, 0.1f, threads);
  const auto edges = surface_edges(sheet.points, sheet.normals, 0.1f, threads);
  ASSERT_LT(edges.size(), 40'000u);  // all are counted
  std::vector<Vec3> viewpoints{sheet.points[7], {0, 0, 1000}};
  for (int k = 0; k < 19; ++k) viewpoints.push_back({place(random), place(random), place(random)});
  const std::vector<double> shares = graph.contradictions(viewpoints);
  ASSERT_EQ(shares.size(), viewpoints.size());
  for (std::size_t k = 0; k < viewpoints.size(); ++k) {
    EXPECT_NEAR(shares[k], contradiction(sheet, edges, viewpoints[k]), 1e-5);
    EXPECT_EQ(shares[k], graph.contradiction(viewpoints[k]));
  }
  EXPECT_GT(*std::max_element(shares.begin(), shares.end()), 0.01);
}

TEST(SurfaceGraph, ContradictionsAboveALimitMayBeInfinite) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-3, 3);
  Sheet sheet = noisy_sheet(random, 6000);
  // Half of the normals tell nothing: from the front, hardly any edge contradicts.
  for (std::size_t i = 0; i < sheet.normals.size(); ++i)
    if (i % 2) sheet.normals[i] = {0, 0, 1};
  ThreadGroup threads(3);
  const SurfaceGraph graph(sheet.points, sheet.normals, 0.2f, threads);
  std::vector<Vec3> viewpoints;
  for (int k = 0; k < 64; ++k) viewpoints.push_back({place(random), place(random), 2});
  for (int k = 0; k < 64; ++k) viewpoints.push_back({place(random), place(random), 0});
  const std::vector<double> shares = graph.contradictions(viewpoints);
  std::size_t infinite = 0;
  for (const double limit : {0.0, 0.001, shares[0], shares[70], 1.0}) {
    const std::vector<double> limited = graph.contradictions(viewpoints, limit);
    for (std::size_t k = 0; k < shares.size(); ++k) {
      if (std::isinf(limited[k])) {
        EXPECT_GT(shares[k], limit);
        ++infinite;
      } else {
        EXPECT_EQ(limited[k], shares[k]);
      }
    }
  }
  EXPECT_GT(infinite, 0u);
}

TEST(SurfaceGraph, AFlatSheetHasNoContradiction) {
  Sheet sheet;
  for (int x = 0; x < 30; ++x)
    for (int y = 0; y < 30; ++y) {
      sheet.points.push_back({0.05f * static_cast<float>(x), 0.05f * static_cast<float>(y), 0});
      sheet.normals.push_back({0, 0, (x + y) % 3 == 0 ? -1.0f : 1.0f});
    }
  ThreadGroup threads(1);
  const SurfaceGraph graph(sheet.points, sheet.normals, 0.11f, threads);
  EXPECT_EQ(graph.contradiction(Vec3{0.7f, 0.3f, 2}), 0);
  EXPECT_EQ(graph.contradiction(graph.consistent_signs()), 0);
  EXPECT_GT(graph.contradiction(SurfaceGraph::Signs(sheet.points.size(), 1)), 0.3);
}

TEST(SpacingSpread, AgreesWithDouble) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit;
  std::vector<Vec3> points;  // fewer than the sample: every row counts
  for (int k = 0; k < 900; ++k) points.push_back({unit(random), unit(random), unit(random)});
  points[5] = points[6];  // a point twice has no neighbour at distance 0
  points[8].x = std::numeric_limits<float>::quiet_NaN();
  const Vec3 viewpoint{3, -1, 2};
  std::vector<double> plain, radial;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double nearest = INFINITY;
    for (const Vec3& q : points) {
      const double x = double(q.x) - points[i].x, y = double(q.y) - points[i].y,
                   z = double(q.z) - points[i].z, d = std::sqrt(x * x + y * y + z * z);
      if (d > 0) nearest = std::min(nearest, d);
    }
    if (!std::isfinite(nearest)) continue;
    plain.push_back(nearest);
    radial.push_back(nearest / norm(points[i] - viewpoint));
  }
  ASSERT_EQ(plain.size(), 899u);
  const auto ratio = [](std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    return values[values.size() * 3 / 4] / values[values.size() / 4];
  };
  const SpacingSpread spread = spacing_spread(test::raw_cloud(points), viewpoint);
  EXPECT_NEAR(spread.plain, ratio(plain), 1e-5);
  EXPECT_NEAR(spread.radial, ratio(radial), 1e-5);
}

TEST(SpacingSpread, FarRowsAndRowsAtOnePlaceCountAsWell) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> unit;
  std::vector<Vec3> points;
  for (int k = 0; k < 3000; ++k) points.push_back({unit(random), unit(random), 0});
  const SpacingSpread near = spacing_spread(test::raw_cloud(points), {0, 0, 5});
  points.push_back({1e30f, 0, 0});
  points.push_back({-1e38f, 0, 0});
  const SpacingSpread with_far = spacing_spread(test::raw_cloud(points), {0, 0, 5});
  EXPECT_NEAR(with_far.plain, near.plain, 0.1 * near.plain);
  points.assign(500, {1, 2, 3});
  const SpacingSpread none = spacing_spread(test::raw_cloud(points), {0, 0, 5});
  EXPECT_EQ(none.plain, 1);
  EXPECT_EQ(none.radial, 1);
}

/// Clouds most of whose rows are in few slabs: walls across x, a pole, one place.
TEST(Slabs, CrowdsAgreeWithAllRows) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> unit;
  const auto at = [&] { return 9 * unit(random); };
  const auto by_coordinates = [](Vec3 a, Vec3 b) {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
  };
  for (const std::size_t scattered : {0, 400, 4000}) {
    std::vector<Vec3> points;
    for (int k = 0; k < 40'000; ++k) points.push_back({1, at(), at()});
    for (int k = 0; k < 40'000; ++k) points.push_back({3, 2, at()});
    for (int k = 0; k < 20'000; ++k) points.push_back({4, 5 + 1e-4f * at(), 6});
    for (int k = 0; k < 30'000; ++k) points.push_back({6, 6, 6});
    for (std::size_t k = 0; k < scattered; ++k) points.push_back({at(), at(), at()});
    std::shuffle(points.begin(), points.end(), random);
    const Slabs slabs(test::raw_cloud(points));
    std::sort(points.begin(), points.end(), by_coordinates);
    const auto rows = slabs.evenly_spaced(300);
    ASSERT_EQ(rows.size(), 300u);
    for (std::size_t s = 0; s < rows.size(); ++s) {
      const Vec3 p = rows[s].position, expected = points[s * points.size() / rows.size()];
      ASSERT_FALSE(by_coordinates(p, expected) || by_coordinates(expected, p)) << s;
      float nearest = INFINITY;
      for (const Vec3& q : points) {
        const Vec3 d = q - p;
        const float squared = d.x * d.x + d.y * d.y + d.z * d.z;
        if (squared > 0) nearest = std::min(nearest, squared);
      }
      ASSERT_EQ(slabs.nearest_squared(rows[s]), nearest) << s;
    }
  }
}

// Took minutes where each row was compared with all.
TEST(Slabs, MillionsOfRowsAtOnePlaceHaveNoSpacing) {
  const std::vector<Vec3> points(3'000'000, Vec3{1, 2, 3});
  EXPECT_EQ(spacing_spread(test::raw_cloud(points), {0, 0, 5}).plain, 1);
}

TEST(SpacingSpread, DoesNotDependOnTheOrderOfTheRows) {
  // Rows of a mesh from voxels share their x.
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit;
  std::vector<Vec3> points;
  for (int k = 0; k < 7000; ++k)
    points.push_back({0.1f * static_cast<float>(k % 13 - 6), unit(random), unit(random)});
  const SpacingSpread expected = spacing_spread(test::raw_cloud(points), {0, 0, 5});
  EXPECT_GT(expected.plain, 1.2);
  for (int trial = 0; trial < 3; ++trial) {
    std::shuffle(points.begin(), points.end(), random);
    const SpacingSpread spread = spacing_spread(test::raw_cloud(points), {0, 0, 5});
    EXPECT_EQ(spread.plain, expected.plain);
    EXPECT_EQ(spread.radial, expected.radial);
  }
}

}  // namespace
}  // namespace gpureg
