// SPDX-License-Identifier: BSD-3-Clause
// Batches of several chunks on an engine that leaves the host idle: the host concludes a chunk
// while the engine aligns the next one.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <random>
#include <thread>

#include "api/access.hpp"
#include "api/with_settings.hpp"
#include "gpureg/registration.hpp"
#include "support/expect_error.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

/// The CPU's engine as if it were a device, in chunks of `chunk` pairs.
class IdleHostEngine final : public Engine {
 public:
  explicit IdleHostEngine(std::size_t chunk, bool idle = true) : chunk_(chunk), idle_(idle) {}

  Backend backend() const override { return cpu_->backend(); }
  unsigned threads() const override { return 1; }
  unsigned host_threads() const override { return 3; }
  bool leaves_host_idle() const override { return idle_; }
  std::string description() const override { return cpu_->description(); }
  const void* memory() const override { return cpu_->memory(); }
  std::size_t pairs_per_chunk(const RegistrationSettings&) const override { return chunk_; }
  std::vector<std::shared_ptr<PreparedState>> prepare(Span<const RawCloud> clouds,
                                                      const PrepareSettings& options,
                                                      const SurfaceWatcher&) override {
    return cpu_->prepare(clouds, options);
  }
  void align(Span<const PairInput> pairs, const RegistrationSettings& options,
             Span<PairOutcome> outcomes) override {
    const std::size_t call = calls++;
    sizes.push_back(pairs.size);
    if (before_align) before_align(call);
    cpu_->align(pairs, options, outcomes);
  }
  std::vector<FeatureMatches> match(Span<const PairInput> pairs,
                                    const RegistrationSettings& options) override {
    return cpu_->match(pairs, options);
  }
  void verify(Span<const PairInput> pairs, const std::vector<PosesOfPair>& poses,
              const RegistrationSettings& options, bool refine,
              Span<PairOutcome> outcomes) override {
    cpu_->verify(pairs, poses, options, refine, outcomes);
  }
  std::unique_ptr<SurfaceMatcher> match_surfaces(Span<const SurfaceArrays> surfaces) override {
    return cpu_->match_surfaces(surfaces);
  }
  std::unique_ptr<PlanMatcher> match_plan(const plan::Map& map) override {
    return cpu_->match_plan(map);
  }

  std::function<void(std::size_t)> before_align;  ///< gets the number of the call
  std::atomic<std::size_t> calls{0};
  std::vector<std::size_t> sizes;

 private:
  std::shared_ptr<Engine> cpu_ = make_cpu_engine(2);
  std::size_t chunk_;
  bool idle_;
};

class BatchOfChunks : public testing::Test {
 protected:
  BatchOfChunks() : options(resolve(RegistrationOptions{0.12f})) {
    options.compatibility.seeds = 128;
    options.compatibility.max_matches = 1024;
    prepare(5, true);
  }

  /// Aligns all pairs of the scans one by one. known: the viewpoints are.
  void prepare(int scans, bool known) {
    std::mt19937 random(5);
    std::vector<std::vector<Eigen::Vector3f>> points;
    std::vector<Eigen::Vector3f> viewpoints;
    for (int k = 0; k < scans; ++k) {
      const Eigen::Isometry3d pose = test::random_pose(random);
      points.push_back(test::moved(pose, test::scan_room(random)));
      viewpoints.push_back((pose * test::kRoomSensor.cast<double>()).cast<float>());
    }
    std::vector<PointCloudView> views;
    for (std::size_t k = 0; k < points.size(); ++k) {
      views.emplace_back(points[k]);
      if (!known) continue;
      views.back().viewpoints = viewpoints[k].data();
      views.back().viewpoint_count = 1;
    }
    const Context cpu = Context::cpu(2);
    clouds = prepare_batch(cpu, views, options.prepare);
    pairs.clear();
    expected.clear();
    for (std::uint32_t i = 0; i < points.size(); ++i)
      for (std::uint32_t j = 0; j < i; ++j) pairs.push_back({i, j});
    for (const Pair& pair : pairs)
      expected.push_back(align(cpu, clouds[pair.source], clouds[pair.target], options));
  }

  /// Counts the results and checks their order, their content and their thread.
  void collect(BatchCallbacks& callbacks) {
    callbacks.on_result = [this, caller = std::this_thread::get_id()](
                              std::size_t p, const RegistrationResult& result) {
      EXPECT_EQ(std::this_thread::get_id(), caller);
      EXPECT_EQ(p, delivered);
      EXPECT_EQ(test::bytes(result), test::bytes(expected[p])) << p;
      ++delivered;
    };
  }
  void expect_equal(const std::vector<RegistrationResult>& results, std::size_t count) const {
    ASSERT_EQ(results.size(), pairs.size());
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      if (p < count)
        EXPECT_EQ(test::bytes(results[p]), test::bytes(expected[p])) << p;
      else
        EXPECT_EQ(results[p].status, RegistrationStatus::skipped) << p;
    }
  }

  RegistrationSettings options;
  std::vector<PreparedCloud> clouds;
  std::vector<Pair> pairs;  ///< ten
  std::vector<RegistrationResult> expected;
  std::size_t delivered = 0;
};

TEST_F(BatchOfChunks, EqualsThePairsOneByOne) {
  for (const std::size_t chunk : {1u, 3u, 5u, 9u, 10u, 100u})
    for (const bool idle : {false, true}) {
      const auto engine = std::make_shared<IdleHostEngine>(chunk, idle);
      BatchCallbacks callbacks;
      collect(callbacks);
      delivered = 0;
      expect_equal(align_batch(Access::context(engine), clouds, pairs, options, callbacks),
                   pairs.size());
      EXPECT_EQ(delivered, pairs.size());
      EXPECT_EQ(engine->calls, (pairs.size() + chunk - 1) / chunk);
      const auto [least, most] = std::minmax_element(engine->sizes.begin(), engine->sizes.end());
      EXPECT_LE(*most, chunk);
      EXPECT_LE(*most - *least, 1u) << "no small chunk at the end";
    }
  EXPECT_TRUE(align_batch(Access::context(std::make_shared<IdleHostEngine>(3)), clouds, {}, options)
                  .empty());
}

// Each pair is aligned with both sides of both clouds.
TEST_F(BatchOfChunks, VariantsOfAPairStayTogether) {
  prepare(3, false);
  for (std::size_t polls = 0; polls <= 3; ++polls) {
    const auto engine = std::make_shared<IdleHostEngine>(3);
    BatchCallbacks callbacks;
    collect(callbacks);
    delivered = 0;
    std::size_t polled = 0;
    callbacks.should_stop = [&] { return polled++ == polls; };
    expect_equal(align_batch(Access::context(engine), clouds, pairs, options, callbacks), polls);
    EXPECT_EQ(delivered, polls);
    EXPECT_EQ(engine->sizes, std::vector<std::size_t>(polls, 4)) << "a pair needs four";
  }
}

TEST_F(BatchOfChunks, ConcludesWhileTheNextChunkIsAligned) {
  const auto engine = std::make_shared<IdleHostEngine>(5);
  std::atomic<bool> second_began{false};
  engine->before_align = [&](std::size_t call) { second_began = second_began || call == 1; };
  BatchCallbacks callbacks;
  callbacks.on_result = [&](std::size_t p, const RegistrationResult&) {
    // One after the other, the second chunk would begin after this.
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (p == 0 && !second_began && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (p == 0) EXPECT_TRUE(second_began);
  };
  expect_equal(align_batch(Access::context(engine), clouds, pairs, options, callbacks),
               pairs.size());
}

TEST_F(BatchOfChunks, ErrorOfAChunkFollowsTheResultsBeforeIt) {
  for (const std::size_t failing : {0u, 1u, 3u, 4u}) {
    const auto engine = std::make_shared<IdleHostEngine>(2);
    engine->before_align = [&](std::size_t call) {
      if (call == failing) throw DeviceError("chunk " + std::to_string(call));
    };
    const Context context = Access::context(engine);
    BatchCallbacks callbacks;
    collect(callbacks);
    delivered = 0;
    test::expect_error<DeviceError>(
        [&] { align_batch(context, clouds, pairs, options, callbacks); },
        {"chunk " + std::to_string(failing)});
    EXPECT_EQ(delivered, 2 * failing);
    EXPECT_EQ(engine->calls, failing + 1);
    engine->before_align = nullptr;
    expect_equal(align_batch(context, clouds, pairs, options), pairs.size());
  }
}

TEST_F(BatchOfChunks, ErrorOfACallbackGoesBeforeThatOfTheNextChunk) {
  const auto engine = std::make_shared<IdleHostEngine>(2);
  engine->before_align = [&](std::size_t call) {
    if (call == 2) throw DeviceError("chunk 2");
  };
  BatchCallbacks callbacks;
  callbacks.on_result = [&](std::size_t p, const RegistrationResult&) {
    if (p == 3) throw std::runtime_error("the caller's");
    ++delivered;
  };
  const Context context = Access::context(engine);
  test::expect_error<std::runtime_error>(
      [&] { align_batch(context, clouds, pairs, options, callbacks); }, {"the caller's"});
  EXPECT_EQ(delivered, 3u);
  EXPECT_EQ(engine->calls, 3u) << "no chunk begins after an error";
}

TEST_F(BatchOfChunks, StopsBetweenChunks) {
  for (std::size_t polls = 0; polls <= 5; ++polls) {
    const auto engine = std::make_shared<IdleHostEngine>(2);
    BatchCallbacks callbacks;
    collect(callbacks);
    delivered = 0;
    std::size_t polled = 0;
    callbacks.should_stop = [&] { return polled++ == polls; };
    expect_equal(align_batch(Access::context(engine), clouds, pairs, options, callbacks),
                 2 * polls);
    EXPECT_EQ(delivered, 2 * polls);
    EXPECT_EQ(engine->calls, polls);
  }
}

}  // namespace
}  // namespace gpureg
