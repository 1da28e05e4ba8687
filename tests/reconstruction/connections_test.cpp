// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/connections.hpp"

#include <gtest/gtest.h>

namespace gpureg::test {
namespace {

using reconstruction::certain_parts;
using reconstruction::Edge;
using reconstruction::Odometry;
using reconstruction::split_at_weak_links;

Edge edge(std::uint32_t source, std::uint32_t target, double confidence, bool accepted) {
  Edge out;
  out.source = source;
  out.target = target;
  out.confidence = out.pair_confidence = confidence;
  out.accepted = accepted;
  return out;
}

constexpr double kConfidence = 0.9;

// One edge that looks certain joins two halves of a map first; others between the halves
// contradict it.
struct TwoHalves {
  TwoHalves() {
    for (std::uint32_t k = 0; k < 16; ++k)
      for (std::uint32_t m = k < 8 ? 0 : 8; m < k; ++m) edges.push_back(edge(k, m, 0.96, true));
    edges.push_back(edge(12, 3, 0.9995, true));
    for (const std::uint32_t k : {8u, 9u, 10u, 11u, 13u, 14u})
      for (const std::uint32_t m : {k - 8, (k - 7) % 8})
        if (m != 3) edges.push_back(edge(k, m, 0.9, false));
    parts = certain_parts(16, edges, {}, kConfidence);
  }
  std::vector<Edge> edges;
  std::vector<std::uint32_t> parts;
};

TEST(WeakLinks, AreSplitWhereTheWholePartsDisagree) {
  TwoHalves map;
  ASSERT_EQ(map.parts, std::vector<std::uint32_t>(16, 0)) << "joined edge by edge";
  split_at_weak_links(map.edges, {}, kConfidence, map.parts);
  std::vector<std::uint32_t> halves(16, 0);
  std::fill(halves.begin() + 8, halves.end(), 8u);
  EXPECT_EQ(map.parts, halves);
}

TEST(WeakLinks, OdometryHolds) {
  TwoHalves map;
  Odometry step;
  step.source = 8;
  step.target = 7;
  split_at_weak_links(map.edges, {step}, kConfidence, map.parts);
  EXPECT_EQ(map.parts[7], map.parts[8]);
}

TEST(WeakLinks, StayWhereTheyAreConfidentEnough) {
  TwoHalves map;
  for (Edge& e : map.edges)
    if (!e.accepted) e.confidence = e.pair_confidence = 0.05;
  split_at_weak_links(map.edges, {}, kConfidence, map.parts);
  EXPECT_EQ(map.parts, std::vector<std::uint32_t>(16, 0));
}

}  // namespace
}  // namespace gpureg::test
