// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>

#include "gpureg/reconstruction/reconstruct.hpp"
#include "sets/small_set.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::test {
namespace {

using namespace reconstruction;

MapOptions quick() { return {quick_options()}; }

std::vector<Eigen::Matrix4d> poses(const Reconstruction& map) {
  std::vector<Eigen::Matrix4d> out;
  for (const Scan& scan : map.scans)
    if (scan.placed) out.push_back(scan.island_from_scan.matrix());
  return out;
}

TEST(MapOfSet, IsThatOfItsPairs) {
  const SmallSet set(5);
  const Context context = Context::cpu();
  MapOptions options = quick();
  options.with_surfaces = true;
  std::size_t steps = 0;
  MapCallbacks callbacks;
  callbacks.on_progress = [&](MapStep, std::size_t done, std::size_t total) {
    EXPECT_LE(done, total);
    ++steps;
  };
  const MapOfSet made = reconstruct(context, set, {}, options, callbacks);
  ASSERT_EQ(made.map.islands.size(), 1u);
  EXPECT_EQ(made.map.placed(), 5u);
  EXPECT_EQ(made.aligned_here, 10u);
  EXPECT_EQ(made.surfaces.size(), 5u);
  EXPECT_TRUE(made.audit && made.refinement);
  EXPECT_GT(steps, 10u);
  // From results, as a file keeps them.
  MapInput input;
  input.pairs = made.pairs;
  input.results = made.results;
  const MapOfSet again = reconstruct(context, set, input, options);
  EXPECT_TRUE(poses(again.map) == poses(made.map));
  options.with_audit = options.with_refinement = options.with_surfaces = false;
  EXPECT_EQ(reconstruct(context, set, input, options).map.placed(), 5u);
}

TEST(MapOfSet, GoesOnAfterACancellation) {
  const SmallSet set(5);
  const TemporaryFolder folder;
  const Context context = Context::cpu(1);
  MapOptions options = quick();
  const MapOfSet whole = reconstruct(context, set, {}, options);
  options.journal = folder / "pairs.journal";
  std::size_t done = 0;
  MapCallbacks callbacks;
  callbacks.on_progress = [&](MapStep step, std::size_t pairs, std::size_t) {
    if (step == MapStep::align) done = pairs;
  };
  callbacks.should_stop = [&] { return done >= 3; };
  EXPECT_THROW(reconstruct(context, set, {}, options, callbacks), Cancelled);
  const MapOfSet parts = reconstruct(context, set, {}, options);
  EXPECT_GE(10u - parts.aligned_here, 3u);
  EXPECT_TRUE(poses(parts.map) == poses(whole.map));
  EXPECT_TRUE(std::filesystem::exists(options.journal));
  parts.journal->remove();
  EXPECT_FALSE(std::filesystem::exists(options.journal));
}

TEST(MapOfSet, LeavesOutWhatCannotBeRead) {
  SmallSet set(5);
  const Context context = Context::cpu();
  MapOptions options = quick();
  options.with_refinement = false;
  set.bad = {1};
  MapInput input;
  for (std::size_t k = 0; k < 5; ++k) input.world_from_scan.push_back(no_pose());
  for (const std::size_t k : {0u, 1u, 2u}) input.world_from_scan[k].setIdentity();
  input.odometry.push_back({3, 1});
  const MapOfSet made = reconstruct(context, set, input, options);
  EXPECT_EQ(made.scans, (std::vector<std::size_t>{0, 2, 3, 4}));
  EXPECT_EQ(made.unusable.at(1), "scan 1 is truncated");
  EXPECT_EQ(made.map.scans.size(), 4u);
  // Consecutive are those that can be used.
  ASSERT_EQ(made.odometry.size(), 1u);
  EXPECT_EQ(std::minmax(made.odometry[0].source, made.odometry[0].target), std::minmax(0u, 1u));
  set.bad = {0, 1, 2, 3};
  EXPECT_THROW(reconstruct(context, set, {}, options), IoError);
}

TEST(MapOfSet, RefusesWhatIsOfNoScan) {
  const SmallSet set(2);
  MapInput input;
  input.pairs = {{2, 0}};
  EXPECT_THROW(reconstruct(Context::cpu(), set, input, quick()), InvalidArgument);
  input.pairs = {{1, 0}};
  input.results.emplace();
  EXPECT_THROW(reconstruct(Context::cpu(), set, input, quick()), InvalidArgument);
}

}  // namespace
}  // namespace gpureg::test
