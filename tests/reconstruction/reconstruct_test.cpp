// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "pose_graph/se3.hpp"
#include "reconstruction/edge_noise.hpp"
#include "reconstruction/pair_results.hpp"
#include "support/expect_error.hpp"

namespace gpureg::test {
namespace {

using reconstruction::EdgeReason;
using reconstruction::ScanReason;

/// Errors of single pairs are at most 4 mm; over a chain of a dozen scans with loops they stay
/// below that many times the reach of a lever arm of some metres.
constexpr double kTolerance = 0.05;

TEST(Reconstruct, PlacesAllScans) {
  PairResults data(12);
  data.add_chain(0, 12, 3);
  const auto map = data.map();
  ASSERT_EQ(map.islands.size(), 1u);
  EXPECT_EQ(map.placed(), 12u);
  EXPECT_LT(largest_error(map, data.world_from_scan, 0), kTolerance);
  for (const auto& edge : map.edges) EXPECT_TRUE(edge.accepted);
  for (const auto& scan : map.scans) EXPECT_GT(scan.confidence, 0.5);
}

TEST(Reconstruct, RejectsFalsePairs) {
  PairResults data(12);
  data.add_chain(0, 12, 3);
  data.add_false(11, 0, 0.9);
  data.add_false(10, 2, 0.9);
  const auto map = data.map();
  EXPECT_EQ(map.placed(), 12u);
  EXPECT_LT(largest_error(map, data.world_from_scan, 0), kTolerance);
  for (const auto& edge : map.edges) EXPECT_EQ(edge.accepted, edge.source - edge.target <= 3);
  EXPECT_NEAR(map.agreement.contradicted,
              2 * std::log(0.1) / (30 * std::log(0.05) + 2 * std::log(0.1)), 1e-9);
  EXPECT_DOUBLE_EQ(map.agreement.edges_per_scan, 30.0 / 12);
}

TEST(Reconstruct, TwoHousesStayTwoIslands) {
  PairResults data(12);
  data.add_chain(0, 7, 3);
  data.add_chain(7, 12, 3);
  data.add_false(7, 0, 0.6);
  data.add_false(9, 2, 0.5);
  const auto map = data.map();
  ASSERT_EQ(map.islands.size(), 2u);
  EXPECT_EQ(map.islands[0].scans.size(), 7u);
  EXPECT_EQ(map.islands[1].scans.size(), 5u);
  EXPECT_EQ(map.scans[7].island_from_scan.matrix(), Eigen::Matrix4d::Identity());
  EXPECT_LT(largest_error(map, data.world_from_scan, 0), kTolerance);
  EXPECT_LT(largest_error(map, data.world_from_scan, 1), kTolerance);
}

TEST(Reconstruct, OneAliasSeenByNeighboursDoesNotJoinTwoHouses) {
  // Scans 4, 5 and 6 see a place that looks like one that scan 12 sees; their wrong poses agree.
  PairResults data(16);
  data.add_chain(0, 8, 3);
  data.add_chain(8, 16, 3);
  for (const std::uint32_t k : {4u, 5u, 6u}) data.add_correct(12, k, 0.72);
  auto map = data.map();
  ASSERT_EQ(map.islands.size(), 2u);
  EXPECT_EQ(map.islands[0].scans.size(), 8u);
  for (std::size_t k = map.edges.size() - 3; k < map.edges.size(); ++k) {
    EXPECT_GT(map.edges[k].confidence, 0.8);  // loop consistency believes them
    EXPECT_NEAR(map.edges[k].pair_confidence, 0.72, 1e-12);
    EXPECT_FALSE(map.edges[k].accepted);
    EXPECT_EQ(map.edges[k].reason, EdgeReason::unconfirmed);
  }
  // Other scans of both houses that agree with them do.
  data.add_correct(11, 3, 0.72);
  data.add_correct(13, 7, 0.72);
  map = data.map();
  EXPECT_EQ(map.islands.size(), 1u);
  EXPECT_EQ(map.placed(), 16u);
}

TEST(Reconstruct, LeavesOutForeignScansWithAReason) {
  PairResults data(11);
  data.add_chain(0, 7, 3);
  data.add_false(7, 1, 0.01);           // fits nothing
  data.add_false(8, 3, 0.6);            // one doubtful pair
  data.add_too_few_points(9, 0, true);  // hardly any point
  const auto map = data.map();          // and 10 has no pair
  EXPECT_EQ(map.placed(), 7u);
  EXPECT_EQ(map.scans[0].reason, ScanReason::none);
  EXPECT_EQ(map.scans[7].reason, ScanReason::no_confident_pair);
  EXPECT_FALSE(map.scans[8].placed);
  EXPECT_TRUE(map.scans[8].reason == ScanReason::unconfirmed ||
              map.scans[8].reason == ScanReason::contradicted);
  EXPECT_EQ(map.scans[9].reason, ScanReason::too_few_points);
  EXPECT_EQ(map.scans[10].reason, ScanReason::not_tried);
  EXPECT_TRUE(map.scans[8].island_from_scan.matrix().hasNaN());
}

TEST(Reconstruct, ALoneDoubtfulPairContradictsNothing) {
  PairResults data(6);
  data.add_chain(0, 5, 3);
  data.add_correct(5, 4, 0.8);
  const auto map = data.map();
  EXPECT_FALSE(map.scans[5].placed);
  EXPECT_EQ(map.scans[5].reason, ScanReason::unconfirmed);
  EXPECT_EQ(map.edges.back().reason, EdgeReason::unconfirmed);
}

TEST(Reconstruct, FurtherModesConnectAScan) {
  PairResults data(8);
  data.add_chain(0, 7, 3);
  data.add_correct(7, 5);
  data.add_false(7, 6, 0.5);
  RegistrationMode correct;
  correct.target_from_source = data.truth(7, 6);
  correct.confidence = 0.45;
  data.results.back().modes.push_back(correct);
  const auto map = data.map();
  EXPECT_TRUE(map.scans[7].placed);
  EXPECT_TRUE(map.edges.back().accepted);
  EXPECT_EQ(map.edges.back().mode, 1u);
}

TEST(Reconstruct, NothingToPlace) {
  EXPECT_TRUE(PairResults(0).map().scans.empty());
  const auto map = PairResults(3).map();
  EXPECT_EQ(map.placed(), 0u);
  EXPECT_TRUE(map.islands.empty());
  for (const auto& scan : map.scans) EXPECT_EQ(scan.reason, ScanReason::not_tried);
}

TEST(Reconstruct, RefusesBadInput) {
  PairResults data(3);
  data.add_correct(1, 0);
  data.add_correct(0, 1);
  EXPECT_THROW(data.map(), InvalidArgument);
  PairResults beyond(3);
  beyond.add_correct(1, 0);
  beyond.pairs[0].source = 3;
  EXPECT_THROW(beyond.map(), InvalidArgument);
  reconstruction::Options options;
  options.min_connection_confidence = 0;
  EXPECT_THROW(PairResults(1).map(options), InvalidArgument);
  EXPECT_THROW(PairResults(1).map(reconstruction::Options{-1}), InvalidArgument);
}

TEST(Reconstruct, GraphHasThePlacedScansAndAcceptedEdges) {
  PairResults data(5);
  data.add_chain(0, 4, 2);
  const auto map = data.map();
  const auto graph = reconstruction::graph_of(map, {10, 11, 12, 13, 14});
  EXPECT_EQ(graph.nodes.size(), 4u);
  EXPECT_EQ(graph.edges.size(), 5u);
  EXPECT_EQ(graph.nodes[3].id, 13);
  graph.validate();
  EXPECT_THROW(reconstruction::graph_of(map, {1}), InvalidArgument);
}

TEST(EdgeNoise, IsWeakAlongACorridor) {
  RegistrationMode mode;
  mode.evidence.information_eigenvalues = {1, 90, 100, 100, 110, 120};
  mode.evidence.weakest_direction = {0, 0, 0, 1, 0, 0};
  const reconstruction::EdgeNoiseOptions noise;
  const pose_graph::Matrix6d covariance =
      reconstruction::edge_information(mode, Eigen::Vector3d::Zero(), noise, 1.0).inverse();
  // A hundred times less information: ten times the standard deviation, within the inversion's
  // rounding and the ratio 100 / 90 of the second eigenvalue.
  EXPECT_NEAR(std::sqrt(covariance(3, 3)), 10 * noise.translation, 0.1 * noise.translation * 10);
  EXPECT_NEAR(std::sqrt(covariance(4, 4)), noise.translation, 0.1 * noise.translation);
}

TEST(EdgeNoise, OfAScanInAPlaneIsByItsMotionsInThePlane) {
  RegistrationMode mode;
  mode.evidence.information_eigenvalues = {90, 100, 2000, 2191, 2191, 2191};
  mode.evidence.weakest_direction = {0, 0, 0, 1, 0, 0};
  const reconstruction::EdgeNoiseOptions noise;
  const pose_graph::Matrix6d covariance =
      reconstruction::edge_information(mode, Eigen::Vector3d::Zero(), noise, 1.0, true).inverse();
  // A rotation moves far points by metres, and nothing holds what a scan cannot do.
  for (int k = 3; k < 6; ++k)
    EXPECT_NEAR(std::sqrt(covariance(k, k)), noise.translation, 0.1 * noise.translation);
}

TEST(EdgeNoise, AppliesAtTheCentreOfTheOverlap) {
  RegistrationMode mode;
  std::mt19937 random(3);
  mode.target_from_source = random_pose(random);
  const reconstruction::EdgeNoiseOptions noise;
  const Eigen::Vector3d centre(4, 0, 0);
  const pose_graph::Matrix6d covariance =
      reconstruction::edge_information(mode, centre, noise, 1.0).inverse();
  // Displacement of the centre by a residual (omega, v) is v - centre x omega.
  Eigen::Matrix<double, 3, 6> displacement;
  displacement << -pose_graph::skew(centre), Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d at_centre = displacement * covariance * displacement.transpose();
  const Eigen::Matrix3d expected =
      noise.translation * noise.translation * Eigen::Matrix3d::Identity();
  // Rounding of two inversions.
  EXPECT_LT((at_centre - expected).norm(), 1e-9);
}

}  // namespace
}  // namespace gpureg::test
