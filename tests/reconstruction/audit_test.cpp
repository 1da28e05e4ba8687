// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/reconstruction/audit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "gpureg/error.hpp"
#include "gpureg/reconstruction.hpp"
#include "gpureg/reconstruction/mend.hpp"
#include "reconstruction/audit/blame.hpp"
#include "reconstruction/audit/edge_confidence.hpp"
#include "reconstruction/audit/in_units.hpp"
#include "reconstruction/audit/near_pairs.hpp"
#include "reconstruction/audit/pair_model.hpp"
#include "reconstruction/audit/pair_verdicts.hpp"
#include "support/audited_room.hpp"
#include "support/registration_result.hpp"

namespace gpureg::test {
namespace {

using namespace reconstruction;

AuditedPair pair_of(std::uint32_t source, std::uint32_t target, double ratio) {
  AuditedPair pair;
  pair.source = source;
  pair.target = target;
  pair.log_likelihood_ratio = ratio;
  pair.verdict = ratio > 0   ? PairVerdict::supports
                 : ratio < 0 ? PairVerdict::contradicts
                             : PairVerdict::silent;
  return pair;
}

/// Scans of a path, each of which agrees with the next two; `slip`: from there on with none before.
std::vector<AuditedPair> path_of(std::uint32_t scans, std::uint32_t slip) {
  std::vector<AuditedPair> pairs;
  for (std::uint32_t k = 0; k < scans; ++k)
    for (std::uint32_t m = k + 1; m < std::min(scans, k + 3); ++m)
      pairs.push_back(pair_of(m, k, k < slip && m >= slip ? -2.5 : 1.5));
  return pairs;
}

Audit judged(std::uint32_t scans, const std::vector<AuditedPair>& pairs,
             const std::vector<Bond>& bonds = {}) {
  Audit audit;
  audit.pairs = pairs;
  judge_connections(std::vector<std::uint32_t>(scans, 0), bonds, {}, in_units({}, 0.05f), audit);
  return audit;
}

TEST(Connections, ASlipIsFoundWhereItIs) {
  const Audit audit = judged(20, path_of(20, 14));
  const auto& connections = audit.connections;
  ASSERT_EQ(connections.size(), 19u);
  EXPECT_EQ(connections[0].verdict, ConnectionVerdict::contradicted);
  EXPECT_EQ(audit.scans_of(connections[0]), (std::vector<std::uint32_t>{14, 15, 16, 17, 18, 19}));
  EXPECT_EQ(connections[0].contradicting, 3u);
  for (std::size_t k = 1; k < connections.size(); ++k)
    EXPECT_EQ(connections[k].verdict, ConnectionVerdict::confirmed) << k;
}

TEST(Connections, OnePairIsNoContradictionAmongMany) {
  std::vector<AuditedPair> pairs = path_of(20, 20);
  pairs[10] = pair_of(pairs[10].source, pairs[10].target, -3.5);
  for (const AuditedConnection& connection : judged(20, pairs).connections)
    EXPECT_NE(connection.verdict, ConnectionVerdict::contradicted);
}

TEST(Connections, OneScanAmongOthersIsNamed) {
  std::vector<AuditedPair> pairs = path_of(12, 12);
  for (AuditedPair& pair : pairs)
    if (pair.source == 5 || pair.target == 5) pair = pair_of(pair.source, pair.target, -2.5);
  const Audit audit = judged(12, pairs);
  EXPECT_EQ(audit.connections[0].verdict, ConnectionVerdict::contradicted);
  EXPECT_EQ(audit.scans_of(audit.connections[0]), std::vector<std::uint32_t>{5});
}

TEST(Connections, PartsThatDoNotSeeEachOtherAreUndecided) {
  std::vector<AuditedPair> pairs = path_of(10, 5);
  for (AuditedPair& pair : pairs)
    if (pair.log_likelihood_ratio < 0) pair = pair_of(pair.source, pair.target, 0);
  EXPECT_EQ(judged(10, pairs).count(ConnectionVerdict::undecided), 1u);
}

// Accepted edges look right: that is why they were accepted.
TEST(Connections, EdgesDoNotConfirmThemselves) {
  std::vector<AuditedPair> pairs = path_of(20, 10);
  std::vector<Bond> bonds;
  for (std::uint32_t k = 0; k + 1 < 20; ++k) bonds.push_back({k, k + 1, 0.99});
  for (AuditedPair& pair : pairs)
    if (pair.source == pair.target + 1)
      pair = pair_of(pair.source, pair.target, 1.5);
    else if (pair.log_likelihood_ratio < 0)
      pair = pair_of(pair.source, pair.target, -3.5);
  const Audit audit = judged(20, pairs, bonds);
  EXPECT_EQ(audit.connections[0].verdict, ConnectionVerdict::contradicted);
  EXPECT_EQ(audit.connections[0].size, 10u);
}

// All pairs that overlap were registered: there is no other support.
TEST(Connections, ManyEdgesOutweighFewContradictions) {
  const auto audit_with = [](std::uint32_t contradictions) {
    std::vector<AuditedPair> pairs;
    std::vector<Bond> bonds;
    for (std::uint32_t k = 0; k < 40; ++k)
      for (std::uint32_t m = k + 1; m < 40; ++m) {
        const bool across = k < 20 && m >= 20;
        const bool contradicts = m == k + 20 && k < contradictions;
        if (across && !contradicts && (k + m) % 4 != 0) continue;
        pairs.push_back(pair_of(m, k, contradicts ? -2.5 : 0.7));
        if (!contradicts) bonds.push_back({m, k, across ? 0.95 : 0.99});
      }
    return judged(40, pairs, bonds);
  };
  const Audit few = audit_with(3);
  EXPECT_NE(few.verdict(), AuditVerdict::contradicted);
  EXPECT_LT(few.connections[0].confidence, 0.2) << "edges do not confirm themselves";
  EXPECT_EQ(audit_with(20).verdict(), AuditVerdict::contradicted);
}

// A corner of scan 0 is bent: it contradicts six scans a little, and fits the fourteen that it was
// registered with.
TEST(Connections, ABentCornerIsNoWrongPlace) {
  std::vector<AuditedPair> pairs;
  std::vector<Bond> bonds;
  for (std::uint32_t k = 1; k <= 20; ++k) {
    for (std::uint32_t m = std::max(1u, k - std::min(k - 1, 3u)); m < k; ++m)
      pairs.push_back(pair_of(k, m, 0.7));
    pairs.push_back(pair_of(k, 0, k <= 14 ? 0.7 : -1));
    if (k <= 14) bonds.push_back({k, 0, 0.99});
  }
  EXPECT_NE(judged(21, pairs, bonds).verdict(), AuditVerdict::contradicted);
}

// Each pair is within the margin of the audit, but all across one place ask for the same motion.
TEST(Connections, ACommonShiftContradicts) {
  const std::uint32_t kScans = 20, kSlip = 12;
  const auto judged_with = [&](double common, double own) {
    Audit audit;
    for (std::uint32_t k = 0; k < kScans; ++k)
      for (std::uint32_t m = k + 1; m < std::min(kScans, k + 5); ++m)
        audit.pairs.push_back(pair_of(m, k, 0.7));
    std::vector<UnalignedIsometry3d> poses(kScans, UnalignedIsometry3d::Identity());
    for (std::uint32_t k = 0; k < kScans; ++k) poses[k].translation().x() = 0.5 * k;
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0, own);
    for (AuditedPair& pair : audit.pairs) {
      pair.target_from_source = poses[pair.target].inverse() * poses[pair.source];
      pair.refined = pair.target_from_source;
      Eigen::Vector3d shift(noise(random), noise(random), noise(random));
      if ((pair.source >= kSlip) != (pair.target >= kSlip)) shift.y() += common;
      pair.refined.translation() += shift;
      pair.shift = shift.norm();
      pair.overlap_spread = Eigen::Matrix3d::Identity();
    }
    judge_connections(std::vector<std::uint32_t>(kScans, 0), {}, poses, in_units({}, 0.05f), audit);
    return audit;
  };
  const Audit slipped = judged_with(0.1, 0.01);
  ASSERT_EQ(slipped.connections[0].verdict, ConnectionVerdict::contradicted);
  EXPECT_EQ(slipped.connections[0].size, kScans - kSlip);
  EXPECT_NE(slipped.connections[1].verdict, ConnectionVerdict::contradicted);
  EXPECT_NE(judged_with(0.01, 0.03).verdict(), AuditVerdict::contradicted);
}

// A list of its scans for each connection would be 2.5 billion numbers.
TEST(Connections, AHundredThousandScansOfACorridor) {
  constexpr std::uint32_t kScans = 100000, kSlip = 40000;
  std::vector<AuditedPair> pairs = path_of(kScans, kSlip);
  for (AuditedPair& pair : pairs) pair.overlap = pair.source == pair.target + 1 ? 0.6 : 0.3;
  const Audit audit = judged(kScans, pairs);
  ASSERT_EQ(audit.connections.size(), kScans - 1);
  EXPECT_EQ(audit.count(ConnectionVerdict::contradicted), 1u);
  const std::vector<std::uint32_t> part = audit.scans_of(audit.connections[0]);
  ASSERT_EQ(part.size(), kSlip);
  EXPECT_EQ(part.back(), kSlip - 1);
  for (const AuditedConnection& connection : audit.connections)
    ASSERT_LE(2 * connection.size, kScans);
}

// Without an overlap that tells them apart, even and odd scans are two strands of the tree that
// meet at its end: most pairs are across most connections.
TEST(Connections, StrandsThatMeetFarAwayTakeBoundedTime) {
  constexpr std::uint32_t kScans = 8000;
  EXPECT_NE(judged(kScans, path_of(kScans, kScans)).verdict(), AuditVerdict::contradicted);
  const Audit audit = judged(kScans, path_of(kScans, 3000));
  EXPECT_EQ(audit.verdict(), AuditVerdict::contradicted);
  const std::vector<std::uint32_t> part = audit.scans_of(audit.connections[0]);
  EXPECT_TRUE(part.front() >= 2998 || part.back() <= 3001) << "beside the slip";
}

/// Edges between the scans of a tree; the connections of an audit are those of the same tree.
TEST(MapConfidence, IsThatOfTheWeakestConnectionOnTheWay) {
  Reconstruction map;
  map.scans.resize(7);
  Audit audit;
  // 3 holds 1, 4 and 5; 1 holds 0 and 2; 5 holds 6.
  audit.order = {3, 1, 0, 2, 4, 5, 6};
  const struct {
    std::size_t first, size;
    double confidence;
  } parts[] = {{1, 3, 0.6}, {2, 1, 0.9}, {3, 1, 0.5}, {4, 1, 0.8}, {5, 2, 0.7}, {6, 1, 0.95}};
  for (const auto& [first, size, confidence] : parts) {
    audit.connections.emplace_back();
    audit.connections.back().first = first;
    audit.connections.back().size = size;
    audit.connections.back().confidence = confidence;
  }
  for (Scan& scan : map.scans) {
    scan.placed = true;
    scan.island = 0;
    scan.island_from_scan = UnalignedIsometry3d::Identity();
  }
  const struct {
    std::uint32_t source, target;
    double weakest;
  } edges[] = {{6, 5, 0.95}, {6, 3, 0.7}, {6, 4, 0.7}, {0, 1, 0.9}, {0, 6, 0.6},
               {2, 0, 0.5},  {3, 4, 0.8}, {1, 3, 0.6}, {2, 6, 0.5}};
  for (const auto& [source, target, weakest] : edges) {
    map.edges.emplace_back();
    map.edges.back().source = source;
    map.edges.back().target = target;
    map.edges.back().target_from_source = UnalignedIsometry3d::Identity();
    map.edges.back().confidence = 0.99;
  }
  judge_edges(audit, in_units({}, 0.05f), false, map);
  for (std::size_t k = 0; k < map.edges.size(); ++k)
    EXPECT_EQ(map.edges[k].map_confidence, edges[k].weakest) << k;
}

TEST(MapConfidence, OfRejectedPosesIsLessWherePlacesLookAlike) {
  Reconstruction map;
  map.scans.resize(2);
  for (std::uint32_t k = 0; k < 2; ++k) {
    map.scans[k].placed = true;
    map.scans[k].island = k;
  }
  map.edges.resize(1);
  map.edges[0].source = 1;
  const auto of_rejected = [&](double confidence, bool places_look_alike) {
    map.edges[0].confidence = confidence;
    judge_edges(Audit(), in_units({}, 0.05f), places_look_alike, map);
    return map.edges[0].map_confidence;
  };
  EXPECT_EQ(of_rejected(0.999, false), 0.9) << "at most";
  EXPECT_EQ(of_rejected(0.999, true), 0.2);
  EXPECT_NEAR(of_rejected(0.4, false), 1.0 / 7, 1e-12) << "odds of 2 to 3, then of 1 to 6";
  EXPECT_NEAR(of_rejected(0.4, true), 1.0 / 19, 1e-12);
}

// A map bends: what is a decimetre more at ten metres still agrees.
TEST(MapConfidence, TheMarginGrowsWithTheDistanceOfTheScans) {
  for (const double metres : {1.0, 10.0}) {
    Reconstruction map;
    map.scans.resize(2);
    for (Scan& scan : map.scans) {
      scan.placed = true;
      scan.island = 0;
      scan.island_from_scan = UnalignedIsometry3d::Identity();
    }
    map.scans[1].island_from_scan.translation().x() = metres + 0.25;
    map.edges.resize(1);
    map.edges[0].source = 1;
    map.edges[0].target = 0;
    map.edges[0].confidence = 0.99;
    map.edges[0].target_from_source = UnalignedIsometry3d::Identity();
    map.edges[0].target_from_source.translation().x() = metres;
    judge_edges(Audit(), in_units({}, 0.05f), false, map);
    EXPECT_EQ(map.edges[0].map_confidence, metres > 5 ? 1.0 : 0.0);
  }
}

/// The connections of two islands: so many of each verdict.
Audit with_connections(std::vector<std::pair<std::uint32_t, ConnectionVerdict>> given) {
  Audit audit;
  audit.islands = {{{0, 1, 2, 3}}, {{4, 5, 6}}};
  for (const auto& [island, verdict] : given) {
    audit.connections.emplace_back();
    audit.connections.back().island = island;
    audit.connections.back().verdict = verdict;
  }
  return audit;
}

TEST(AuditVerdicts, OnlyWhatIsConfirmedIsSound) {
  constexpr auto confirmed = ConnectionVerdict::confirmed, undecided = ConnectionVerdict::undecided,
                 contradicted = ConnectionVerdict::contradicted;
  const auto verdict_of = [](const Audit& audit) {
    return std::string(to_string(audit.verdict()));
  };
  Audit audit = with_connections(
      {{0, undecided}, {0, confirmed}, {0, confirmed}, {1, confirmed}, {1, confirmed}});
  EXPECT_EQ(verdict_of(audit), "sound");
  audit.connections.back().verdict = undecided;
  EXPECT_EQ(verdict_of(audit), "undecided") << "as many are undecided as confirmed";
  EXPECT_EQ(audit.verdicts(),
            (std::vector<AuditVerdict>{AuditVerdict::sound, AuditVerdict::undecided}));
  audit.connections.back().verdict = contradicted;
  EXPECT_EQ(verdict_of(audit), "contradicted");
  EXPECT_EQ(audit.verdicts()[0], AuditVerdict::sound);
  audit = with_connections({{0, confirmed}, {0, confirmed}, {0, confirmed}});
  audit.islands[1].scans = {4};
  EXPECT_EQ(verdict_of(audit), "sound") << "a scan alone has no connection";
  audit.islands.clear();
  audit.connections.clear();
  EXPECT_EQ(verdict_of(audit), "undecided");
}

TEST_F(AuditedRoom, ARightMapIsSound) {
  const Audit result = audited(world_from_scan);
  EXPECT_EQ(result.pairs.size(), 15u);
  EXPECT_EQ(result.verdict(), AuditVerdict::sound);
  for (const AuditedPair& pair : result.pairs) EXPECT_EQ(pair.verdict, PairVerdict::supports);
  for (const AuditedConnection& connection : result.connections)
    EXPECT_EQ(connection.verdict, ConnectionVerdict::confirmed);
}

// Every island has a frame of its own. In one frame, their scans would lie in each other.
TEST_F(AuditedRoom, IslandsAreMapsOfTheirOwn) {
  std::vector<UnalignedIsometry3d> poses = world_from_scan;
  for (const std::size_t k : {3, 4, 5}) poses[k].translation() += Eigen::Vector3d(0.4, 0.3, 0.1);
  EXPECT_EQ(audited(poses).verdict(), AuditVerdict::contradicted);
  const Reconstruction map = map_of_poses(poses, {0, 0, 0, 1, 1, 1});
  const Audit result = audit(context, clouds, map, options, AuditOptions{});
  EXPECT_EQ(result.verdict(), AuditVerdict::sound);
  EXPECT_EQ(result.pairs.size(), 6u);
  ASSERT_EQ(result.islands.size(), 2u);
  EXPECT_EQ(result.islands[1].scans, (std::vector<std::uint32_t>{3, 4, 5}));
  EXPECT_THROW(map_of_poses(poses, {0, 0}), InvalidArgument);
  EXPECT_THROW(map_of_poses(poses, {0, 0, 0, 1, 1, 6}), InvalidArgument);
}

TEST_F(AuditedRoom, IsEndedByItsCaller) {
  const Audit found = audited(with_slip(3, 0.6));
  AuditOptions stopped;
  int asked = 0;
  stopped.should_stop = [&] { return ++asked == 2; };
  EXPECT_THROW(mend(context, clouds, with_slip(3, 0.6), found, options, stopped), Cancelled);
  EXPECT_EQ(asked, 2);
  // Of so many pairs an audit takes seconds.
  std::vector<PreparedCloud> many;
  std::vector<UnalignedIsometry3d> poses;
  for (std::size_t k = 0; k < 300; ++k) {
    many.push_back(clouds[k % 6]);
    poses.push_back(world_from_scan[k % 6]);
  }
  asked = 0;
  EXPECT_THROW(audit(context, many, poses, options, stopped), Cancelled);
  std::vector<Pair> pairs;
  std::vector<RegistrationResult> results;
  for (std::uint32_t k = 0; k + 1 < many.size(); ++k) {
    pairs.push_back({k + 1, k});
    results.push_back(result_of(UnalignedIsometry3d(poses[k].inverse() * poses[k + 1]), 0.98));
  }
  asked = 0;
  EXPECT_THROW(reconstruct(context, many, pairs, results, {}, {}, options, stopped), Cancelled);
}

TEST_F(AuditedRoom, AScanAtAWrongPlaceIsNamed) {
  for (const double metres : {0.3, 0.5, 1.0}) {
    const Audit result = audited(with_slip(3, metres));
    EXPECT_EQ(result.verdict(), AuditVerdict::contradicted) << metres;
    ASSERT_FALSE(result.connections.empty());
    EXPECT_EQ(result.scans_of(result.connections[0]), std::vector<std::uint32_t>{3}) << metres;
    for (const std::size_t k : result.connections[0].contradictions)
      EXPECT_TRUE(result.pairs[k].source == 3 || result.pairs[k].target == 3);
  }
}

TEST_F(AuditedRoom, ScansWithoutAPoseAreLeftOut) {
  std::vector<UnalignedIsometry3d> poses = world_from_scan;
  poses[4] = no_pose();
  const Audit result = audited(poses);
  EXPECT_EQ(result.pairs.size(), 10u);
  EXPECT_EQ(result.verdict(), AuditVerdict::sound);
}

TEST_F(AuditedRoom, BadPosesAreNamed) {
  std::vector<UnalignedIsometry3d> poses = world_from_scan;
  poses.pop_back();
  EXPECT_THROW(audited(poses), InvalidArgument);
  poses = world_from_scan;
  poses[2].linear() *= 1.1;
  try {
    audited(poses);
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("world_from_scan[2]"), std::string::npos);
  }
  poses = world_from_scan;
  poses[1].linear().col(0) *= -1;
  EXPECT_THROW(audited(poses), InvalidArgument);
  AuditOptions bad;
  bad.max_shift = -1;
  EXPECT_THROW(audit(context, clouds, world_from_scan, options, bad), InvalidArgument);
}

TEST_F(AuditedRoom, PosesOfOtherScansAreNotConfirmed) {
  std::vector<UnalignedIsometry3d> poses = world_from_scan;
  std::rotate(poses.begin(), poses.begin() + 1, poses.end());
  const Audit result = audited(poses);
  EXPECT_EQ(result.count(PairVerdict::supports), 0u);
  EXPECT_EQ(result.count(ConnectionVerdict::confirmed), 0u);
}

// Each pose is a rigid motion; the map is none of the room.
TEST_F(AuditedRoom, AMirroredMapIsNotConfirmed) {
  const Eigen::Matrix3d mirror = Eigen::Vector3d(1, -1, 1).asDiagonal();
  std::vector<UnalignedIsometry3d> poses = world_from_scan;
  for (UnalignedIsometry3d& pose : poses) {
    pose.linear() = mirror * pose.linear() * mirror;
    pose.translation() = mirror * pose.translation();
  }
  EXPECT_EQ(audited(poses).count(ConnectionVerdict::confirmed), 0u);
}

TEST_F(AuditedRoom, AScaledMapIsNotConfirmed) {
  for (const double scale : {0.001, 0.9, 1.1, 1000.0}) {
    std::vector<UnalignedIsometry3d> poses = world_from_scan;
    for (UnalignedIsometry3d& pose : poses) pose.translation() *= scale;
    const Audit result = audited(poses);
    EXPECT_EQ(result.count(ConnectionVerdict::confirmed), 0u) << scale;
    if (scale == 0.9 || scale == 1.1)
      EXPECT_EQ(result.verdict(), AuditVerdict::contradicted) << scale;
  }
}

TEST_F(AuditedRoom, ScansWithoutPointsSayNothing) {
  clouds[2] = PreparedCloud();
  const float none = 0;
  PointCloudView empty;
  empty.points = &none;
  clouds[4] = prepare(context, empty, options);
  const Audit result = audited(world_from_scan);
  EXPECT_EQ(result.count(PairVerdict::supports), 6u) << "of four scans";
  EXPECT_EQ(result.count(ConnectionVerdict::undecided), 2u);
}

// As of poses in other units: a cell holds all scans.
TEST_F(AuditedRoom, ScansOnTopOfEachOtherHaveFewPairsEach) {
  const std::vector<PreparedCloud> same(20000, clouds[0]);
  const std::vector<UnalignedIsometry3d> poses(same.size(), world_from_scan[0]);
  const std::vector<Pair> pairs = near_pairs(same, poses, {}, 4);
  EXPECT_GE(pairs.size(), 2 * same.size());
  EXPECT_LE(pairs.size(), 4 * same.size());
}

// Three edges agree on a wrong place of the last two scans; nobody registered the other pairs.
TEST_F(AuditedRoom, EdgesOfAContradictedConnectionAreTakenOut) {
  const auto relative = [&](std::uint32_t source, std::uint32_t target) {
    UnalignedIsometry3d wrong = world_from_scan[source];
    if (source >= 4 && target < 4) wrong.translation() += Eigen::Vector3d(0.6, 0.5, 0.2);
    return UnalignedIsometry3d(world_from_scan[target].inverse() * wrong);
  };
  std::vector<Pair> pairs;
  std::vector<RegistrationResult> results;
  const auto add = [&](std::uint32_t source, std::uint32_t target) {
    pairs.push_back({source, target});
    results.push_back(result_of(relative(source, target), 0.98));
  };
  for (std::uint32_t k = 0; k < 4; ++k)
    for (std::uint32_t m = k + 1; m < 4; ++m) add(m, k);
  add(5, 4);
  add(4, 0);
  add(5, 1);
  add(4, 2);
  EXPECT_EQ(reconstruct_from_poses(6, pairs, results).islands.size(), 1u);
  const AuditedReconstruction out =
      reconstruct(context, clouds, pairs, results, {}, {}, options, AuditOptions{});
  ASSERT_EQ(out.map.islands.size(), 2u);
  EXPECT_EQ(out.map.islands[1].scans, (std::vector<std::uint32_t>{4, 5}));
  EXPECT_EQ(out.audit.verdict(), AuditVerdict::sound);
  ASSERT_EQ(out.map.edges.size(), pairs.size());
  for (const Edge& edge : out.map.edges) {
    EXPECT_EQ(edge.accepted, (edge.source < 4) == (edge.target < 4));
    EXPECT_EQ(edge.map_confidence > 0.9, edge.accepted);
  }
}

PairVerdict verdict_of(double confidence, float any_normal, float observed, float violation) {
  PoseVerification pose;
  pose.confidence = confidence;
  pose.evidence.source_overlap = pose.evidence.target_overlap = any_normal;
  pose.evidence.source_overlap_any_normal = pose.evidence.target_overlap_any_normal = any_normal;
  pose.evidence.source_observed = pose.evidence.target_observed = observed;
  pose.evidence.source_free_space_violation = violation;
  AuditedPair pair;
  judge_pair(pose, nullptr, 0.15, pair);
  return pair.verdict;
}

TEST(Audit, FreeSpaceContradictsAndSurfacesSupport) {
  EXPECT_EQ(verdict_of(0.99, 0.5f, 0.5f, 0.001f), PairVerdict::supports);
  EXPECT_EQ(verdict_of(0.02, 0.5f, 0.5f, 0.2f), PairVerdict::contradicts);
  EXPECT_EQ(verdict_of(0, 0, 0.5f, 0.2f), PairVerdict::contradicts);
}

// A floor and a wall fit anywhere along them: the confidence of a right pose is low. What lies at
// the other scan's surfaces is then little.
TEST(Audit, LowConfidenceContradictsByWhatIsShared) {
  EXPECT_EQ(verdict_of(0.05, 0.05f, 0.5f, 0.001f), PairVerdict::silent);
  EXPECT_EQ(verdict_of(0.05, 0.5f, 0.5f, 0.001f), PairVerdict::contradicts);
}

// Scans of a LiDAR that are a metre off along a street violate no free space.
TEST(Audit, ABetterPlaceBeyondTheMarginContradicts) {
  PoseVerification given, refined;
  given.target_from_source = refined.target_from_source = UnalignedIsometry3d::Identity();
  for (PoseVerification* pose : {&given, &refined})
    pose->evidence.source_overlap_any_normal = pose->evidence.source_observed = 0.6f;
  given.confidence = 0.6;
  given.evidence.source_free_space_violation = 0.01f;
  refined.confidence = 0.97;
  refined.source_moments.count = 100;
  const auto verdict_at = [&](double shift) {
    refined.target_from_source.translation().x() = shift;
    AuditedPair pair;
    judge_pair(given, &refined, 0.3, pair);
    return pair.verdict;
  };
  EXPECT_EQ(verdict_at(0.2), PairVerdict::supports);
  EXPECT_EQ(verdict_at(1), PairVerdict::contradicts);
}

TEST(Audit, ScansThatDoNotSeeEachOtherAreSilent) {
  EXPECT_EQ(verdict_of(0, 0, 0, 0), PairVerdict::silent);
}

TEST(Audit, LikelihoodIsMonotone) {
  const ImpliedPairEvidence worst{0, 1, 1, 1};
  for (int k = 0; k < 100; ++k) {
    const double share = k / 100.0, next = (k + 1) / 100.0;
    EXPECT_LE(log_likelihood_ratio({share, 0.3, 0.05, 0.01}),
              log_likelihood_ratio({next, 0.3, 0.05, 0.01}));
    EXPECT_GE(log_likelihood_ratio({0.5, 0.3, share, 0.01}),
              log_likelihood_ratio({0.5, 0.3, next, 0.01}));
    EXPECT_GE(log_likelihood_ratio({0.5, 0.3, 0.05, share}),
              log_likelihood_ratio({0.5, 0.3, 0.05, next}));
    EXPECT_LE(log_likelihood_ratio(worst), log_likelihood_ratio({share, 1, 1, 1}));
  }
}

TEST_F(AuditedRoom, NearPairsAreThoseThatMeet) {
  std::vector<UnalignedIsometry3d> poses = world_from_scan;
  poses[5].translation().x() += 100;
  EXPECT_EQ(near_pairs(clouds, poses, {}, 40).size(), 10u);
  EXPECT_EQ(near_pairs(clouds, poses, {0, 0, 0, 1, 1, 1}, 40).size(), 4u);
  EXPECT_LE(near_pairs(clouds, poses, {}, 2).size(), 10u);
}

}  // namespace
}  // namespace gpureg::test
