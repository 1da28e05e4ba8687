// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/path.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <optional>

#include "pair_results.hpp"
#include "reconstruction/audit/alike_model.hpp"

namespace gpureg::test {
namespace {

using namespace reconstruction;

constexpr std::uint32_t kStations = 40, kBay = 14, kSecond = 26;

std::vector<Eigen::Vector3d> sensors() {
  return std::vector<Eigen::Vector3d>(kStations, Eigen::Vector3d::Zero());
}

bool looks_alike(double contradicted, double edges_per_scan, double jumps) {
  return alike_log_odds({contradicted, edges_per_scan, jumps}) > 0;
}

/// A path through two bays that look alike: scans 0 to 13 and 26 to 39, of which those 26 numbers
/// apart see the same. One step between the bays is registered hardly, and the many aliases agree.
struct TwinBays : PairResults {
  explicit TwinBays(const std::vector<std::uint32_t>& number) : PairResults(0) {
    world_from_scan.resize(kStations);
    for (std::uint32_t k = 0; k < kStations; ++k) {
      UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
      pose.translation().x() = k;
      pose.rotate(Eigen::AngleAxisd(0.2 * k, Eigen::Vector3d::UnitZ()));
      world_from_scan[number[k]] = pose;
    }
    const auto alias = [&](std::uint32_t target, std::uint32_t source) {
      const UnalignedIsometry3d& moved = world_from_scan[number[source - kSecond]];
      return UnalignedIsometry3d(world_from_scan[number[target]].inverse() * moved);
    };
    for (std::uint32_t t = 0; t < kStations; ++t)
      for (std::uint32_t s = t + 1; s < kStations; ++s) {
        const bool twins = t < kBay && s >= kSecond && s - kSecond + 2 >= t && s - kSecond <= t + 2;
        if (s - t <= 2)
          add_correct(number[s], number[t], s == 20 || t == 20 ? 0.6 : 0.99);
        else if (twins)
          add(number[s], number[t], 0.98, alias(t, s));
        else if (t == 17 && s == 21)
          add_correct(number[s], number[t], 0.95);
        else
          add_too_few_points(number[s], number[t], true);
      }
  }

  bool right(std::uint32_t source, std::uint32_t target, const UnalignedIsometry3d& pose) const {
    return (truth(source, target).translation() - pose.translation()).norm() < 0.35;
  }

  std::size_t wrong_edges(const Reconstruction& map) const {
    return static_cast<std::size_t>(
        std::count_if(map.edges.begin(), map.edges.end(), [&](const Edge& edge) {
          return edge.accepted && !right(edge.source, edge.target, edge.target_from_source);
        }));
  }

  std::optional<std::vector<char>> trusted() const {
    return pairs_along_the_path(sensors(), pairs, results, {});
  }

  bool look_alike() const { return look_alike(reconstruct_from_poses(kStations, pairs, results)); }
  bool look_alike(const Reconstruction& map) const {
    return looks_alike(map.agreement.contradicted, map.agreement.edges_per_scan, jumps(map));
  }
  double jumps(const Reconstruction& map) const {
    return jumps_along_the_path(map, sensors(), pairs, results);
  }
};

std::vector<std::uint32_t> in_order() {
  std::vector<std::uint32_t> number(kStations);
  std::iota(number.begin(), number.end(), 0u);
  return number;
}

TEST(Path, AliasesCollapseAMapAndShow) {
  const TwinBays set(in_order());
  const Reconstruction map = reconstruct_from_poses(kStations, set.pairs, set.results);
  EXPECT_GT(set.wrong_edges(map), 10u);
  EXPECT_TRUE(set.look_alike(map));
}

TEST(Path, AMapWithoutContradictionHasNoPlacesThatLookAlike) {
  TwinBays set(in_order());
  for (std::size_t k = 0; k < set.pairs.size(); ++k)
    if (set.pairs[k].source >= set.pairs[k].target + kBay)
      set.results[k].target_from_source = no_pose();
  EXPECT_FALSE(set.look_alike());
}

TEST(Path, PairsThatContradictEachOtherShowAliases) {
  // The more pairs a scan has, the fewer are wrong in the end where places differ.
  EXPECT_FALSE(looks_alike(0.01, 5, 0));
  EXPECT_TRUE(looks_alike(0.1, 5, 0));
  EXPECT_FALSE(looks_alike(0.04, 2, 0));
  EXPECT_TRUE(looks_alike(0.3, 2, 0));
  EXPECT_FALSE(looks_alike(0.2, 1, 0));
  EXPECT_FALSE(looks_alike(0, 9, 0));
}

/// Agreement::jumps of a map of all scans at two places, as aliases make it.
double jumps_of_folded_path(const TwinBays& set) {
  Reconstruction map = reconstruct_from_poses(kStations, set.pairs, set.results);
  map.islands.resize(1);
  for (std::uint32_t k = 0; k < kStations; ++k) {
    map.scans[k].placed = true;
    map.scans[k].island = 0;
    map.scans[k].island_from_scan = set.world_from_scan[k];
    if (k >= kSecond) map.scans[k].island_from_scan.translation().x() += k < 33 ? -26 : 26;
  }
  return set.jumps(map);
}

TEST(Path, ScansThatJumpAlongAPathShowAliases) {
  EXPECT_DOUBLE_EQ(jumps_of_folded_path(TwinBays(in_order())), 2.0 / 39);
  EXPECT_FALSE(looks_alike(0.02, 3, 0));
  EXPECT_TRUE(looks_alike(0.02, 3, 0.5));
}

TEST(Path, OnlyPairsThatContinueThePathAreTrusted) {
  TwinBays set(in_order());
  ASSERT_TRUE(set.trusted().has_value());
  const std::vector<char> trusted = *set.trusted();
  for (std::size_t k = 0; k < set.pairs.size(); ++k) {
    const std::uint32_t gap = set.pairs[k].source - set.pairs[k].target;
    if (!set.results[k].has_pose()) continue;
    EXPECT_EQ(trusted[k] != 0, gap <= 4) << set.pairs[k].target << " " << set.pairs[k].source;
    if (!trusted[k]) set.results[k].target_from_source = no_pose();
  }
  const Reconstruction map = reconstruct_from_poses(kStations, set.pairs, set.results);
  EXPECT_EQ(set.wrong_edges(map), 0u);
  ASSERT_FALSE(map.islands.empty());
  EXPECT_GE(map.islands[0].scans.size(), kStations - 1);
}

/// A permutation in which no numbers that follow each other are neighbours.
std::vector<std::uint32_t> in_any_order() {
  std::vector<std::uint32_t> number(kStations);
  for (std::uint32_t k = 0; k < kStations; ++k) number[k] = (17 * k + 5) % 40;
  return number;
}

TEST(Path, NumbersInAnyOrderSayNothing) {
  const TwinBays set(in_any_order());
  EXPECT_FALSE(set.trusted().has_value());
  EXPECT_EQ(jumps_of_folded_path(set), 0);
}

}  // namespace
}  // namespace gpureg::test
