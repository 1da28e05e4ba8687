// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/sets/register_all.hpp"

#include <gtest/gtest.h>

#include "sets/small_set.hpp"
#include "support/result_bytes.hpp"

namespace gpureg::test {
namespace {

constexpr std::uint32_t kScans = 5;
constexpr std::size_t kPairs = kScans * (kScans - 1) / 2;

/// In memory.
PairJournal journal_of(const SmallSet& set) {
  return PairJournal("", identity_of(set, quick_options()), all_pairs(kScans),
                     PairJournal::Mode::fresh);
}

std::vector<std::vector<char>> results_of(PairJournal& journal) {
  std::vector<std::vector<char>> out;
  for (std::size_t k = 0; k < journal.size(); ++k) out.push_back(bytes(journal.result(k)));
  return out;
}

TEST(RegisterAll, ContextsAndMemoryChangeNothing) {
  const SmallSet set(kScans);
  const Context context = Context::cpu();
  const std::vector<PreparedFragment> prepared = prepare_all(context, set, quick_options());
  ASSERT_EQ(prepared.size(), kScans);
  PairJournal whole = journal_of(set);
  register_all(context, clouds_of(prepared), whole, quick_options());
  const std::size_t bytes_of_one = prepared[0].cloud.size() * (33 * 4 + 96);
  for (const std::size_t memory : {kFragmentMemory, 3 * bytes_of_one, std::size_t{1}}) {
    PairJournal other = journal_of(set);
    const RegisterAllReport report =
        register_all({Context::cpu(1), Context::cpu(1)}, set, other, quick_options(), memory);
    EXPECT_TRUE(report.complete && report.unusable.empty());
    EXPECT_TRUE(results_of(other) == results_of(whole)) << memory;
  }
}

TEST(RegisterAll, MemoryIsBounded) {
  const SmallSet set(kScans);
  const PreparedCloud first = prepare_all(Context::cpu(), set, quick_options()).front().cloud;
  const std::size_t one = first.size() * (33 * 4 + 96), budget = 3 * one;
  FragmentAligner aligner(Context::cpu(), set, quick_options(), budget);
  std::size_t most = 0, received = 0;
  aligner.align(
      all_pairs(kScans), [&](std::size_t, const RegistrationResult&) { ++received; },
      [&] {
        most = std::max(most, aligner.bytes());
        return false;
      });
  EXPECT_EQ(received, kPairs);
  EXPECT_GT(aligner.prepared(), kScans) << "they must have come and gone";
  EXPECT_LE(most, budget + budget / 2);  // the scans differ by a few per cent
}

TEST(RegisterAll, GoesOnWhereItWasStopped) {
  const SmallSet set(kScans);
  PairJournal whole = journal_of(set), parts = journal_of(set);
  register_all({Context::cpu()}, set, whole, quick_options());
  std::size_t calls = 0;
  while (parts.done() < kPairs && calls < 2 * kPairs) {
    const std::size_t before = parts.done();
    const RegisterAllReport report =
        register_all({Context::cpu(1)}, set, parts, quick_options(), kFragmentMemory,
                     [&](std::size_t done, std::size_t) { return done == before; });
    EXPECT_EQ(report.complete, parts.done() == kPairs);
    ++calls;
  }
  EXPECT_TRUE(results_of(parts) == results_of(whole));
  EXPECT_THROW(
      register_all({Context::cpu(1)}, set,
                   *std::make_unique<PairJournal>("", identity_of(set, quick_options()),
                                                  all_pairs(kScans), PairJournal::Mode::fresh),
                   quick_options(), kFragmentMemory,
                   [](std::size_t, std::size_t) -> bool { throw IoError("enough"); }),
      IoError);
}

TEST(RegisterAll, ABadFragmentCostsItsOwnPairs) {
  SmallSet set(kScans);
  PairJournal whole = journal_of(set), journal = journal_of(set);
  register_all({Context::cpu()}, set, whole, quick_options());
  set.bad = {3};
  const RegisterAllReport report = register_all({Context::cpu()}, set, journal, quick_options());
  ASSERT_EQ(report.unusable.size(), 1u);
  EXPECT_EQ(report.unusable.at(3), "scan 3 is truncated");
  EXPECT_EQ(journal.done(), kPairs - (kScans - 1));
  set.bad.clear();
  EXPECT_TRUE(register_all({Context::cpu()}, set, journal, quick_options()).unusable.empty());
  EXPECT_TRUE(results_of(journal) == results_of(whole));
}

TEST(RegisterAll, TilesKeepFragmentsTogether) {
  const std::vector<Pair> pairs = {{130, 1}, {2, 0}, {129, 0}, {1, 0}};
  EXPECT_EQ(in_tiles(pairs), (std::vector<std::size_t>{3, 1, 2, 0}));
}

}  // namespace
}  // namespace gpureg::test
