// SPDX-License-Identifier: BSD-3-Clause
#include "localization/search.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "localization/building.hpp"

namespace gpureg::test {
namespace {

using localization::MapState;
using localization::Scan;

/// Six rooms in so many tiles that coarser voxels, of 20 cm, choose some of them.
class LargeMap : public testing::Test {
 protected:
  LargeMap() {
    given_.coarse_factor = 1;
    given_.coarse_tiles = 2;
    options_ = localization::resolve(given_);
  }

  Scan scan_in_voxels(double coarsest) const {
    const auto prepared = [&](const PrepareSettings& options) {
      return prepare_batch(context(), {query_.scan.view()}, options).front();
    };
    Scan scan = localization::scan_of(prepared(state_.options.prepare), {});
    scan.coarse = scan.cloud;
    scan.coarsest = prepared(localization::prepare_for(state_, coarsest));
    return scan;
  }
  static std::size_t searched(const Scan& scan) {
    return static_cast<std::size_t>(
        std::count_if(scan.best.begin(), scan.best.end(), [](double best) { return best > 0; }));
  }

  PreparedMap map_ = building({1, 2, 3, 4, 5, 6}, map_options(4));
  const MapState& state_ = MapState::of(map_);
  LocateOptions given_{RegistrationOptions{kVoxel}};
  localization::LocateSettings options_;
  Query query_{5, 4, 3};
};

TEST_F(LargeMap, TheBestTilesOfACoarserSearchAreSearched) {
  ASSERT_GT(map_.tiles(), 2u);
  const double factor = localization::coarsest_factor(state_, options_);
  EXPECT_EQ(factor, 2);
  std::vector<Scan> scans{scan_in_voxels(factor)};
  ASSERT_GE(scans[0].coarsest.size(), localization::kTellingPoints);
  localization::search_all_tiles(context(), state_, options_, scans);
  EXPECT_EQ(scans[0].tiles, map_.tiles());
  EXPECT_LE(searched(scans[0]), 2u);
  ASSERT_FALSE(scans[0].candidates.empty());
  LocatedPose pose;
  pose.map_from_scan = scans[0].candidates.front().map_from_scan;
  EXPECT_LT(query_.error(pose), 0.1);
}

TEST_F(LargeMap, ScansOfFewPointsAreSearchedInAllTiles) {
  std::vector<Scan> scans{scan_in_voxels(6)};
  ASSERT_LT(scans[0].coarsest.size(), localization::kTellingPoints);
  localization::search_all_tiles(context(), state_, options_, scans);
  EXPECT_GT(searched(scans[0]), 2u);
}

TEST_F(LargeMap, SmallMapsAndLargeNumbersNeedNoCoarserSearch) {
  options_.coarse_tiles = static_cast<std::uint32_t>(map_.tiles());
  EXPECT_EQ(localization::coarsest_factor(state_, options_), 0);
}

TEST_F(LargeMap, WhatTooCoarseVoxelsLoseIsSearchedInThoseOfTheMap) {
  options_.coarse_factor = 8;  // 80 cm: a room has no features left
  std::vector<Scan> scans{scan_in_voxels(6)};
  scans[0].coarse =
      prepare_batch(context(), {query_.scan.view()}, localization::prepare_for(state_, 8)).front();
  localization::search_all_tiles(context(), state_, options_, scans);
  localization::search_best_tiles(context(), state_, options_, {0}, scans);
  ASSERT_FALSE(scans[0].candidates.empty());
  LocatedPose pose;
  pose.map_from_scan = scans[0].candidates.front().map_from_scan;
  EXPECT_LT(query_.error(pose), 0.1);
}

TEST_F(LargeMap, FindsTheScanWithTheSameBitsForOtherScansAndThreads) {
  const Query other(2, 1, 1), foreign(50, 0, 3);
  const auto together = locate(
      Context::cpu(1), {foreign.scan.view(), query_.scan.view(), other.scan.view()}, map_, given_);
  EXPECT_EQ(together[0].status, LocateStatus::not_found);
  ASSERT_EQ(together[1].status, LocateStatus::found);
  EXPECT_LT(query_.error(together[1].poses.front()), 0.05);
  const LocateResult alone = locate(Context::cpu(3), {query_.scan.view()},
                                    building({1, 2, 3, 4, 5, 6}, map_options(4)), given_)
                                 .front();
  EXPECT_EQ(numbers_of(alone), numbers_of(together[1]));
}

}  // namespace
}  // namespace gpureg::test
