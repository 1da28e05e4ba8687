// SPDX-License-Identifier: BSD-3-Clause
// Which call gets which lane of a device.
#include "cuda/device/lanes.hpp"

#include <chrono>
#include <thread>

#include "cuda/room_scans.hpp"

namespace gpureg {
namespace {

using cuda::Lanes;
using test::Results;

class LanesOnCuda : public test::RoomScans {};

TEST_F(LanesOnCuda, SmallCallsTakeThoseThatALargeCallLeaves) {
  Lanes lanes(0);
  const Lanes::Held large = lanes.together();
  for (int k = 0; k < 2; ++k) {
    const Lanes::Held small = lanes.any();
    EXPECT_EQ(&small.exec(), &lanes.exec(Lanes::kTogether));
    const Lanes::Held another = lanes.any();
    EXPECT_EQ(&another.exec(), &lanes.exec(Lanes::kTogether + 1));
  }
}

TEST_F(LanesOnCuda, LaterSmallCallsLeaveItsLanesToALargeCallThatWaits) {
  Lanes lanes(0);
  std::thread large;
  {
    const Lanes::Held first = lanes.any();
    ASSERT_EQ(&first.exec(), &lanes.exec(0));
    large = std::thread([&] { lanes.together(); });
    const auto leaves = [&] {
      const Lanes::Held small = lanes.any();
      return &small.exec() == &lanes.exec(Lanes::kTogether);
    };
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    bool left = leaves();
    for (; !left && std::chrono::steady_clock::now() < end; left = leaves())
      std::this_thread::yield();
    EXPECT_TRUE(left) << "small calls still take the second lane";
  }
  large.join();
  EXPECT_EQ(&lanes.any().exec(), &lanes.exec(0)) << "the large call still has it";
}

TEST_F(LanesOnCuda, SmallAndLargeCallsAtTheSameTimeGiveTheSame) {
  const Context context = Context::cuda();
  std::vector<Pair> many;  // a large call
  while (many.size() < 128) many.insert(many.end(), pairs.begin(), pairs.end());
  const Results expected = run(context, pairs), expected_of_many = run(context, many);
  std::vector<Results> got(6);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < got.size(); ++t)
    threads.emplace_back([&, t] {
      if (t < 2) {
        got[t] = run(context, many);
        return;
      }
      const auto clouds = prepare_batch(context, views, options.prepare);
      for (const Pair& p : pairs)
        got[t].push_back(test::bytes(align(context, clouds[p.source], clouds[p.target], options)));
    });
  for (std::thread& t : threads) t.join();
  for (std::size_t t = 0; t < got.size(); ++t)
    EXPECT_EQ(got[t], t < 2 ? expected_of_many : expected) << "thread " << t;
}

}  // namespace
}  // namespace gpureg
