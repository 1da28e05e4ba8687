// SPDX-License-Identifier: BSD-3-Clause
// Preparations that give their surfaces before their end: the host decides about unknown viewpoints
// meanwhile, with the same results.
#include <gtest/gtest.h>

#include <random>

#include "api/access.hpp"
#include "api/with_settings.hpp"
#include "common/in_halves.hpp"
#include "gpureg/registration.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

/// The CPU's engine as if it were a device. Gives the surfaces of every `stride`-th cloud, and
/// where `fails`, no batch but single clouds gets ready after that.
class WatchedEngine final : public Engine {
 public:
  WatchedEngine(std::size_t stride, bool fails) : stride_(stride), fails_(fails) {}

  Backend backend() const override { return cpu_->backend(); }
  unsigned threads() const override { return 1; }
  unsigned host_threads() const override { return 3; }
  bool leaves_host_idle() const override { return true; }
  std::string description() const override { return cpu_->description(); }
  const void* memory() const override { return cpu_->memory(); }
  std::size_t pairs_per_chunk(const RegistrationSettings&) const override { return 8; }
  std::vector<std::shared_ptr<PreparedState>> prepare(Span<const RawCloud> clouds,
                                                      const PrepareSettings& options,
                                                      const SurfaceWatcher& watcher) override {
    auto states = cpu_->prepare(clouds, options);
    if (!watcher) return states;
    for (std::size_t k = 0; k < states.size(); k += stride_) {
      EarlySurface surface;
      static_cast<PointsAndNormals&>(surface) = states[k]->copy_points_and_normals();
      std::copy(states[k]->origin, states[k]->origin + 3, surface.origin);
      watcher(k, {surface});
      ++given;
    }
    if (fails_ && clouds.size > 1) throw BatchTooLarge("a batch");
    return states;
  }
  void align(Span<const PairInput>, const RegistrationSettings&, Span<PairOutcome>) override {}
  std::vector<FeatureMatches> match(Span<const PairInput>, const RegistrationSettings&) override {
    return {};
  }
  void verify(Span<const PairInput>, const std::vector<PosesOfPair>&, const RegistrationSettings&,
              bool, Span<PairOutcome>) override {}
  std::unique_ptr<SurfaceMatcher> match_surfaces(Span<const SurfaceArrays>) override {
    return nullptr;
  }
  std::unique_ptr<PlanMatcher> match_plan(const plan::Map&) override { return nullptr; }

  std::size_t given = 0;

 private:
  std::shared_ptr<Engine> cpu_ = make_cpu_engine(2);
  std::size_t stride_;
  bool fails_;
};

template <typename T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_equal(const PreparedState& a, const PreparedState& b) {
  EXPECT_TRUE(same_bytes(a.copy_points(), b.copy_points()));
  EXPECT_TRUE(same_bytes(a.copy_normals(), b.copy_normals()));
  EXPECT_TRUE(same_bytes(a.copy_features(), b.copy_features()));
  EXPECT_EQ(a.statistics.viewpoint, b.statistics.viewpoint);
  EXPECT_EQ(a.statistics.repaired_normals, b.statistics.repaired_normals);
  EXPECT_EQ(std::memcmp(a.origin, b.origin, sizeof a.origin), 0);
  ASSERT_EQ(a.other_sides == nullptr, b.other_sides == nullptr);
  if (a.other_sides) expect_equal(*a.other_sides, *b.other_sides);
}

class EarlySurfaces : public testing::Test {
 protected:
  /// Scans of a room from the origin, and moved ones; one without points, one with a viewpoint.
  EarlySurfaces() {
    std::mt19937 random(9);
    for (int k = 0; k < 6; ++k) {
      auto points = test::scan_room(random);
      for (Eigen::Vector3f& p : points) p -= test::kRoomSensor;
      if (k % 2) points = test::moved(test::random_pose(random), points);
      if (k == 2) points.clear();
      clouds.push_back({points, {}, {}});
    }
    clouds[4].viewpoints.push_back({0, 0, 0});
    for (const PointCloud& cloud : clouds) views.push_back(cloud.view());
    expected = prepare_batch(Context::cpu(2), views, options);
  }
  void expect_same_with(const std::shared_ptr<WatchedEngine>& engine, std::size_t given) {
    const auto prepared = prepare_batch(Access::context(engine), views, options);
    EXPECT_EQ(engine->given, given);
    ASSERT_EQ(prepared.size(), expected.size());
    for (std::size_t k = 0; k < prepared.size(); ++k)
      expect_equal(*Access::state(prepared[k]), *Access::state(expected[k]));
  }

  PrepareSettings options = resolve(RegistrationOptions{0.12f}).prepare;
  std::vector<PointCloud> clouds;
  std::vector<PointCloudView> views;
  std::vector<PreparedCloud> expected;
};

TEST_F(EarlySurfaces, ChangeNoResult) {
  expect_same_with(std::make_shared<WatchedEngine>(1, false), 6);
}

TEST_F(EarlySurfaces, MayMiss) { expect_same_with(std::make_shared<WatchedEngine>(2, false), 3); }

TEST_F(EarlySurfaces, MayComeAgain) {
  // 6 clouds, then their halves of 3, of which 1 is alone and 2 are tried again.
  expect_same_with(std::make_shared<WatchedEngine>(1, true), 6 + 2 * (3 + 1 + 2 + 2));
}

TEST_F(EarlySurfaces, AnErrorOfThePreparationLeavesTheCall) {
  clouds[1].points.assign(2, Eigen::Vector3f(0, 0, 0));
  clouds[1].points[1].x() = 1e30f;
  views[1] = clouds[1].view();
  EXPECT_THROW(
      prepare_batch(Access::context(std::make_shared<WatchedEngine>(1, false)), views, options),
      Error);
}

}  // namespace
}  // namespace gpureg
