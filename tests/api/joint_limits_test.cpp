// SPDX-License-Identifier: BSD-3-Clause
// Limits that a batch exceeds although each of its elements is within them, by an engine that has
// them.
#include <gtest/gtest.h>

#include <random>

#include "api/access.hpp"
#include "api/with_settings.hpp"
#include "common/in_halves.hpp"
#include "gpureg/registration.hpp"
#include "gpureg/verification.hpp"
#include "support/expect_error.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

/// The CPU's engine, which refuses more clouds or pairs at once than `most`.
class LimitedEngine final : public Engine {
 public:
  LimitedEngine(std::size_t most, bool by_memory) : most_(most), by_memory_(by_memory) {}

  Backend backend() const override { return cpu_->backend(); }
  unsigned threads() const override { return cpu_->threads(); }
  std::string description() const override { return cpu_->description(); }
  const void* memory() const override { return cpu_->memory(); }
  std::size_t pairs_per_chunk(const RegistrationSettings&) const override { return 100; }
  std::vector<std::shared_ptr<PreparedState>> prepare(Span<const RawCloud> clouds,
                                                      const PrepareSettings& options,
                                                      const SurfaceWatcher&) override {
    check(clouds.size);
    return cpu_->prepare(clouds, options);
  }
  void align(Span<const PairInput> pairs, const RegistrationSettings& options,
             Span<PairOutcome> outcomes) override {
    // What a part that fails leaves behind must not show.
    for (PairOutcome& outcome : outcomes) outcome.modes.emplace_back();
    check(pairs.size);
    cpu_->align(pairs, options, outcomes);
  }
  std::vector<FeatureMatches> match(Span<const PairInput> pairs,
                                    const RegistrationSettings& options) override {
    check(pairs.size);
    return cpu_->match(pairs, options);
  }
  void verify(Span<const PairInput> pairs, const std::vector<PosesOfPair>& poses,
              const RegistrationSettings& options, bool refine,
              Span<PairOutcome> outcomes) override {
    for (PairOutcome& outcome : outcomes) outcome.modes.emplace_back();
    check(pairs.size);
    for (PairOutcome& outcome : outcomes) outcome = PairOutcome();
    cpu_->verify(pairs, poses, options, refine, outcomes);
  }
  std::unique_ptr<SurfaceMatcher> match_surfaces(Span<const SurfaceArrays> surfaces) override {
    return cpu_->match_surfaces(surfaces);
  }
  std::unique_ptr<PlanMatcher> match_plan(const plan::Map& map) override {
    return cpu_->match_plan(map);
  }

  std::size_t refused = 0;

 private:
  void check(std::size_t size) {
    if (size <= most_) return;
    ++refused;
    if (by_memory_) throw OutOfDeviceMemory("device 0 is out of memory");
    throw BatchTooLarge("a batch of " + std::to_string(size) + " elements: split it");
  }
  std::shared_ptr<Engine> cpu_ = make_cpu_engine(2);
  std::size_t most_;
  bool by_memory_;
};

class JointLimits : public testing::TestWithParam<bool> {
 protected:
  JointLimits() : options(resolve(RegistrationOptions{0.12f})) {
    std::mt19937 random(5);
    for (int k = 0; k < 5; ++k)
      scans.push_back(test::moved(test::random_pose(random), test::scan_room(random)));
    for (const auto& scan : scans) views.emplace_back(scan);
    for (std::uint32_t i = 0; i < scans.size(); ++i)
      for (std::uint32_t j = 0; j < i; ++j) pairs.push_back({i, j});
  }
  RegistrationSettings options;
  std::vector<std::vector<Eigen::Vector3f>> scans;
  std::vector<PointCloudView> views;
  std::vector<Pair> pairs;
};

INSTANTIATE_TEST_SUITE_P(ByLimitAndByMemory, JointLimits, testing::Bool());

TEST_P(JointLimits, BatchesAreHalved) {
  const Context cpu = Context::cpu(2);
  const auto clouds = prepare_batch(cpu, views, options.prepare);
  const auto expected = align_batch(cpu, clouds, pairs, options);
  for (const std::size_t most : {1u, 2u, 3u}) {
    const auto engine = std::make_shared<LimitedEngine>(most, GetParam());
    const Context limited = Access::context(engine);
    const auto prepared = prepare_batch(limited, views, options.prepare);
    EXPECT_GT(engine->refused, 0u);
    ASSERT_EQ(prepared.size(), clouds.size());
    for (std::size_t k = 0; k < clouds.size(); ++k) {
      EXPECT_EQ(prepared[k].points(), clouds[k].points());
      EXPECT_EQ(prepared[k].features(), clouds[k].features());
    }
    const std::size_t before = engine->refused;
    const auto results = align_batch(limited, prepared, pairs, options);
    EXPECT_GT(engine->refused, before);
    ASSERT_EQ(results.size(), expected.size());
    for (std::size_t p = 0; p < pairs.size(); ++p)
      EXPECT_EQ(test::bytes(results[p]), test::bytes(expected[p])) << p;
  }
}

TEST_P(JointLimits, VerificationIsHalved) {
  const Context cpu = Context::cpu(2);
  const auto clouds = prepare_batch(cpu, views, options.prepare);
  const std::vector<std::vector<UnalignedIsometry3d>> poses(
      pairs.size(), {UnalignedIsometry3d(Eigen::Isometry3d::Identity())});
  const auto expected = verify_poses_batch(cpu, clouds, pairs, poses, options, {});
  const Context limited = Access::context(std::make_shared<LimitedEngine>(3, GetParam()));
  const auto results = verify_poses_batch(limited, clouds, pairs, poses, options, {});
  ASSERT_EQ(results.size(), expected.size());
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    ASSERT_EQ(results[p].size(), 1u);
    EXPECT_EQ(results[p][0].confidence, expected[p][0].confidence);
    EXPECT_EQ(results[p][0].target_from_source.matrix(),
              expected[p][0].target_from_source.matrix());
  }
}

using Ranges = std::vector<std::pair<std::size_t, std::size_t>>;

TEST(InHalves, ElementsThatAreTooManyTogetherAreHalved) {
  Ranges calls;
  in_halves(0, 4, [&](std::size_t begin, std::size_t end) {
    calls.emplace_back(begin, end);
    if (end - begin == 4) throw BatchTooLarge("four");
    if (begin == 0 && end == 2) throw OutOfDeviceMemory("the first two");
  });
  EXPECT_EQ(calls, (Ranges{{0, 4}, {0, 2}, {0, 1}, {1, 2}, {2, 4}}));
  calls.clear();
  in_halves(3, 3, [&](std::size_t begin, std::size_t end) { calls.emplace_back(begin, end); });
  EXPECT_TRUE(calls.empty());
}

// Halves would work the elements beside the wrong one again on each level.
TEST(InHalves, NamesTheElementThatFailsAlone) {
  Ranges calls;
  const auto work = [&](std::size_t begin, std::size_t end) {
    calls.emplace_back(begin, end);
    if (begin <= 3 && 3 < end) throw InvalidArgument("element 3");
  };
  test::expect_error<InvalidArgument>([&] { in_halves(0, 8, work); }, {"element 3"});
  EXPECT_EQ(calls, (Ranges{{0, 8}, {0, 1}, {1, 2}, {2, 3}, {3, 4}}));
}

TEST(InHalves, OtherErrorsAreNotTriedAgain) {
  int calls = 0;
  const auto lost = [&](std::size_t, std::size_t) {
    ++calls;
    throw DeviceError("the device's state is lost");
  };
  EXPECT_THROW(in_halves(0, 8, lost), DeviceError);
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace gpureg
