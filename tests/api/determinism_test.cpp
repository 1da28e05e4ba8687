// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>

#include "api/with_settings.hpp"
#include "gpureg/registration.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using test::bytes;

class Determinism : public ::testing::Test {
 protected:
  Determinism() : options(resolve(RegistrationOptions{0.12f})) {
    options.quadruples.count = 2000;
    options.seed = 42;
    std::mt19937 random(1);
    for (int k = 0; k < 4; ++k)
      scans.push_back(test::moved(test::random_pose(random), test::scan_room(random)));
    scans.push_back({});  // an empty cloud among the others
    for (const auto& s : scans) views.emplace_back(s);
    for (std::uint32_t i = 0; i < 5; ++i)
      for (std::uint32_t j = i + 1; j < 5; ++j) pairs.push_back({j, i});
  }
  std::vector<std::vector<char>> run(const Context& context, const std::vector<Pair>& list) {
    std::vector<std::vector<char>> out;
    for (const RegistrationResult& r :
         align_batch(context, prepare_batch(context, views, options.prepare), list, options))
      out.push_back(bytes(r));
    return out;
  }
  RegistrationSettings options;
  std::vector<std::vector<Eigen::Vector3f>> scans;
  std::vector<PointCloudView> views;
  std::vector<Pair> pairs;
};

TEST_F(Determinism, SameBytesInAnyOrderAndAnySplit) {
  const Context context = Context::cpu(2);
  const auto expected = run(context, pairs);
  std::vector<Pair> reversed(pairs.rbegin(), pairs.rend());
  auto backwards = run(context, reversed);
  std::reverse(backwards.begin(), backwards.end());
  EXPECT_EQ(backwards, expected);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    // A batch of one, and the single call on clouds that were prepared alone.
    EXPECT_EQ(run(context, {pairs[k]})[0], expected[k]);
    const PreparedCloud a = prepare(context, views[pairs[k].source], options.prepare),
                        b = prepare(context, views[pairs[k].target], options.prepare);
    EXPECT_EQ(bytes(align(context, a, b, options)), expected[k]);
    EXPECT_EQ(bytes(align(context, views[pairs[k].source], views[pairs[k].target], options)),
              expected[k]);
  }
}

TEST_F(Determinism, AnotherSeedDrawsOtherHypotheses) {
  const auto first = run(Context::cpu(2), {pairs[0]});
  options.seed = 43;
  EXPECT_NE(run(Context::cpu(2), {pairs[0]}), first);
}

// What the comparisons of this and other tests rest on.
TEST(ResultBytes, EveryFieldButTheTimings) {
  RegistrationResult plain;
  plain.modes.emplace_back();
  const auto differs = [&](auto&& change) {
    RegistrationResult other = plain;
    change(other);
    return bytes(other) != bytes(plain);
  };
  using Result = RegistrationResult;
  EXPECT_FALSE(differs([](Result& r) { r.timings.match = 1; }));
  EXPECT_TRUE(differs([](Result& r) { r.inlier_ratio = 1; }));
  EXPECT_TRUE(differs([](Result& r) { r.source_viewpoint = ViewpointSource::none; }));
  EXPECT_TRUE(differs([](Result& r) { r.target_viewpoint = ViewpointSource::none; }));
  EXPECT_TRUE(differs([](Result& r) { r.statistics.swapped = true; }));
  EXPECT_TRUE(differs([](Result& r) { r.source_moments.count = 1; }));
  EXPECT_TRUE(differs([](Result& r) { r.target_moments.outer(1, 2) = 1; }));
  EXPECT_TRUE(differs([](Result& r) { r.modes[0].overlap_confidence = 1; }));
  EXPECT_TRUE(differs([](Result& r) { r.modes[0].rank_before_refinement = 1; }));
  EXPECT_TRUE(differs([](Result& r) { r.modes[0].evidence.source_residual = 0; }));
  EXPECT_TRUE(differs([](Result& r) { r.modes[0].evidence.target_overlap_any_normal = 1; }));
  EXPECT_TRUE(differs([](Result& r) { r.modes[0].evidence.weakest_direction[5] = 1; }));
}

}  // namespace
}  // namespace gpureg
