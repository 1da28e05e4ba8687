// SPDX-License-Identifier: BSD-3-Clause
// Batches of several chunks: the host concludes one while the device aligns the next one.
#include <stdexcept>

#include "common/limits.hpp"
#include "cuda/room_scans.hpp"

namespace gpureg {
namespace {

class Chunks : public test::RoomScans {
 protected:
  Chunks() {
    // The neighbourhoods of so many seeds and matches need the memory of 14 pairs.
    options.compatibility.seeds = limits::kMaxSeeds;
    options.compatibility.max_matches = limits::kMaxMatches;
  }
};

TEST_F(Chunks, EqualThePairsOneByOne) {
  const Context context = Context::cuda(0);
  const auto clouds = prepare_batch(context, views, options.prepare);
  test::Results expected;
  for (const Pair& pair : pairs)
    expected.push_back(
        test::bytes(align(context, clouds[pair.source], clouds[pair.target], options)));
  std::size_t polls = 0, delivered = 0;
  BatchCallbacks callbacks;
  callbacks.should_stop = [&] {
    ++polls;
    return false;
  };
  callbacks.on_result = [&](std::size_t p, const RegistrationResult& result) {
    EXPECT_EQ(p, delivered++);
    EXPECT_EQ(test::bytes(result), expected[p]) << p;
  };
  EXPECT_EQ(test::all_bytes(align_batch(context, clouds, pairs, options, callbacks)), expected);
  EXPECT_EQ(delivered, pairs.size());
  EXPECT_GT(polls, 1u) << "one chunk only";
  EXPECT_EQ(test::all_bytes(align_batch(context, clouds, pairs, options)), expected);
}

TEST_F(Chunks, AnErrorOfTheCallerLeavesTheContextUsable) {
  const Context context = Context::cuda(0);
  const auto clouds = prepare_batch(context, views, options.prepare);
  const auto expected = test::all_bytes(align_batch(context, clouds, pairs, options));
  BatchCallbacks callbacks;
  callbacks.on_result = [](std::size_t, const RegistrationResult&) {
    throw std::runtime_error("the caller's");
  };
  EXPECT_THROW(align_batch(context, clouds, pairs, options, callbacks), std::runtime_error);
  EXPECT_EQ(test::all_bytes(align_batch(context, clouds, pairs, options)), expected);
}

}  // namespace
}  // namespace gpureg
