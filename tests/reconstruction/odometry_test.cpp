// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "reconstruction/pair_results.hpp"
#include "support/expect_error.hpp"

namespace gpureg::test {
namespace {

using reconstruction::EdgeReason;
using reconstruction::Odometry;
using reconstruction::ScanReason;

constexpr std::size_t kScans = 10;

/// Odometry between consecutive scans, each a little off.
std::vector<Odometry> odometry_of(const PairResults& data, double metres) {
  std::vector<Odometry> out = reconstruction::odometry_of_poses(data.world_from_scan);
  for (Odometry& edge : out) edge.target_from_source.translation().x() += metres;
  return out;
}

reconstruction::Reconstruction map_of(const PairResults& data,
                                      const std::vector<Odometry>& odometry,
                                      const reconstruction::Options& options = {}) {
  return reconstruction::reconstruct_from_poses(data.world_from_scan.size(), data.pairs,
                                                data.results, options, odometry);
}

TEST(Odometry, PlacesScansWithoutPairsAndSaysSo) {
  const PairResults data(kScans);
  const auto map = map_of(data, odometry_of(data, 0));
  ASSERT_EQ(map.islands.size(), 1u);
  EXPECT_EQ(map.placed(), kScans);
  for (const auto& scan : map.scans) EXPECT_EQ(scan.reason, ScanReason::odometry_only);
  EXPECT_LT(largest_error(map, data.world_from_scan, 0), 1e-6);
  // Nine steps of .99.
  EXPECT_NEAR(map.scans.back().confidence, std::pow(0.99, 9), 1e-12);
}

TEST(Odometry, LoopsCorrectItsDrift) {
  PairResults data(kScans);
  const double open = largest_error(map_of(data, odometry_of(data, 0.02)), data.world_from_scan, 0);
  data.add_correct(9, 0);
  data.add_correct(8, 1);
  const auto map = map_of(data, odometry_of(data, 0.02));
  EXPECT_LT(largest_error(map, data.world_from_scan, 0), 0.7 * open);
  for (const auto& edge : map.edges) EXPECT_TRUE(edge.accepted);
  EXPECT_EQ(map.scans[9].reason, ScanReason::none);
  EXPECT_EQ(map.scans[5].reason, ScanReason::odometry_only);
}

TEST(Odometry, RejectsPairsThatContradictIt) {
  PairResults data(kScans);
  data.add_correct(9, 0);
  data.add_false(8, 1, 0.95);
  const auto map = map_of(data, odometry_of(data, 0.005));
  EXPECT_TRUE(map.edges[0].accepted);
  EXPECT_FALSE(map.edges[1].accepted);
  EXPECT_EQ(map.edges[1].reason, EdgeReason::inconsistent);
  EXPECT_EQ(map.placed(), kScans);
}

TEST(Odometry, GapsAreClosedByPairs) {
  PairResults data(kScans);
  std::vector<Odometry> odometry = odometry_of(data, 0);
  odometry.erase(odometry.begin() + 4);  // between scans 4 and 5
  EXPECT_EQ(map_of(data, odometry).islands.size(), 2u);
  data.add_correct(6, 3);
  EXPECT_EQ(map_of(data, odometry).islands.size(), 1u);
}

TEST(Odometry, PosesThatAreNotKnownLeaveAGap) {
  PairResults data(4);
  data.world_from_scan[2] = no_pose();
  const auto odometry = reconstruction::odometry_of_poses(data.world_from_scan);
  ASSERT_EQ(odometry.size(), 2u);
  EXPECT_EQ(odometry[1].target, 1u);
  EXPECT_EQ(odometry[1].source, 3u);
}

TEST(Odometry, GraphHoldsIt) {
  PairResults data(3);
  data.add_correct(2, 0);
  const auto graph = reconstruction::graph_of(map_of(data, odometry_of(data, 0)));
  ASSERT_EQ(graph.edges.size(), 3u);
  EXPECT_EQ(graph.edges[0].kind, pose_graph::EdgeKind::odometry);
  EXPECT_TRUE(graph.edges[0].information.has_value());
  EXPECT_EQ(graph.edges[2].kind, pose_graph::EdgeKind::loop);
}

TEST(Odometry, ErrorsNameTheEntry) {
  const PairResults data(3);
  const auto refused = [&](const Odometry& edge, std::initializer_list<std::string> parts) {
    expect_error<InvalidArgument>([&] { map_of(data, {{1, 0}, edge}); }, parts);
  };
  refused({3, 0}, {"odometry[1]", "scan 3 of 3"});
  refused({2, 2}, {"odometry[1]", "itself"});
  Odometry edge{2, 1};
  edge.target_from_source = no_pose();
  refused(edge, {"odometry[1]"});
  edge = {2, 1};
  edge.information = -pose_graph::UnalignedMatrix6d::Identity();
  refused(edge, {"odometry[1]", "information"});
  edge = {2, 1};
  edge.confidence = 0;
  refused(edge, {"odometry[1]", "confidence"});
  reconstruction::Options options;
  options.drift.translation_per_metre = -1;
  expect_error<InvalidArgument>([&] { map_of(data, {}, options); }, {"drift"});
}

TEST(WeakestLinks, FindsTheBridge) {
  PairResults data(8);
  data.add_chain(0, 4, 3);
  data.add_chain(4, 8, 3);
  data.add_correct(5, 2, 0.93);  // the only edge between the halves
  const auto map = data.map();
  ASSERT_EQ(map.islands.size(), 1u);
  const auto links = reconstruction::weakest_links(map);
  ASSERT_EQ(links.size(), 7u);
  const auto weakest =
      std::min_element(links.begin(), links.end(),
                       [](const auto& a, const auto& b) { return a.confidence < b.confidence; });
  EXPECT_EQ(weakest->scans, (std::vector<std::uint32_t>{4, 5, 6, 7}));
  EXPECT_EQ(weakest->accepted, 1u);
  EXPECT_EQ(weakest->rejected, 0u);
  EXPECT_NEAR(weakest->confidence, map.edges.back().confidence, 1e-9);
}

}  // namespace
}  // namespace gpureg::test
