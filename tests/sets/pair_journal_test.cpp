// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/sets/pair_journal.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "sets/result_bytes.hpp"
#include "support/member_count.hpp"
#include "support/registration_result.hpp"
#include "support/scan.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::test {
namespace {

// A member that is new here belongs into result_bytes.cpp, and makes another kJournalVersion.
static_assert(member_count<RegistrationResult>() == 15 && member_count<RegistrationMode>() == 6);

using Mode = PairJournal::Mode;

RegistrationResult result_number(unsigned number) {
  std::mt19937 random(number);
  RegistrationResult result = result_of(UnalignedIsometry3d(random_pose(random)), 0.1 * number);
  result.modes.push_back(result.modes.front());
  result.modes.back().rank_before_refinement = number;
  result.source_moments.count = number;
  result.statistics.inliers = 7 * number;
  result.timings.match = 0.1 * number;
  return result;
}

class Journal : public ::testing::Test {
 protected:
  RunIdentity run() const {
    return {RunIdentity::settings_of(options_), {{"a", "1"}, {"b", "2"}, {"c", "3"}}};
  }

  /// Results of the first two pairs.
  void write_two() const {
    PairJournal journal(path_, run(), pairs_, Mode::restart);
    journal.add(0, result_number(1));
    journal.add(1, result_number(2));
    journal.flush();
  }

  std::string content() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void write(const std::string& content) const {
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << content;
  }
  std::string why_not(const RunIdentity& run, const std::vector<Pair>& pairs) const {
    try {
      PairJournal(path_, run, pairs, Mode::resume);
    } catch (const OtherRun& error) {
      return error.what();
    }
    return "";
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "pairs.journal";
  const RegistrationOptions options_{0.1f};
  const std::vector<Pair> pairs_{{1, 0}, {2, 0}, {2, 1}};
};

TEST_F(Journal, GivesResultsBackWithoutLoss) {
  write_two();
  PairJournal journal(path_, run(), pairs_, Mode::resume);
  EXPECT_EQ(journal.resumed(), 2u);
  for (unsigned k = 0; k < 2; ++k)
    EXPECT_EQ(sets::bytes_of(journal.result(k)), sets::bytes_of(result_number(k + 1)));
  EXPECT_EQ(journal.result(2).status, RegistrationStatus::skipped);
  journal.add(2, result_number(3));
  EXPECT_EQ(sets::bytes_of(journal.result(2)), sets::bytes_of(result_number(3)));
  EXPECT_EQ(PairJournal::setting(path_, "options.voxel_size"), "0.1");
  const JournalContents contents = read_journal(path_);
  ASSERT_EQ(contents.pairs.size(), 3u);
  EXPECT_EQ(contents.clouds[contents.pairs[2].source].name, "c");
  EXPECT_EQ(sets::bytes_of(contents.results[2]), sets::bytes_of(result_number(3)));
}

TEST_F(Journal, WithoutAFileKeepsResultsInMemory) {
  PairJournal journal("", {}, pairs_, Mode::fresh);
  journal.add(1, result_number(1));
  EXPECT_EQ(journal.done(), 1u);
  EXPECT_EQ(sets::bytes_of(journal.result(1)), sets::bytes_of(result_number(1)));
}

TEST_F(Journal, CutAnywhereLosesWhatIsTornAlone) {
  write_two();
  const std::string whole = content();
  std::size_t most = 0;
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    write(whole.substr(0, size));
    PairJournal journal(path_, run(), pairs_, Mode::resume);
    EXPECT_GE(journal.done(), most);
    most = journal.done();
    for (std::size_t k = 0; k < journal.done(); ++k)
      EXPECT_EQ(sets::bytes_of(journal.result(k)),
                sets::bytes_of(result_number(static_cast<unsigned>(k) + 1)));
    for (std::size_t k = journal.done(); k < 3; ++k)
      journal.add(k, result_number(static_cast<unsigned>(k) + 1));
    journal.flush();
    EXPECT_EQ(read_journal(path_).pairs.size(), 3u);
  }
  EXPECT_EQ(most, 1u);
}

TEST_F(Journal, ZerosAtTheEndAreTorn) {
  write_two();
  write(content() + std::string(5000, '\0'));
  EXPECT_EQ(PairJournal(path_, run(), pairs_, Mode::resume).done(), 2u);
}

TEST_F(Journal, AChangedBitIsNotResumed) {
  write_two();
  const std::string whole = content();
  std::mt19937 random(1);
  for (std::size_t place = 0; place < whole.size(); place += 1 + random() % 40) {
    std::string flipped = whole;
    flipped[place] = static_cast<char>(flipped[place] ^ 1 << random() % 8);
    write(flipped);
    EXPECT_THROW(PairJournal(path_, run(), pairs_, Mode::resume), DamagedJournal) << place;
    EXPECT_EQ(content(), flipped);
  }
}

TEST_F(Journal, NamesWhatIsNotOfItsRun) {
  write_two();
  const std::string before = content();
  RunIdentity other = run();
  other.settings = RunIdentity::settings_of(RegistrationOptions{0.1f});
  EXPECT_EQ(why_not(other, pairs_), "");
  RegistrationOptions seed = options_;
  seed.seed = 2;
  other.settings = RunIdentity::settings_of(seed);
  EXPECT_NE(why_not(other, pairs_).find("options.seed was 1, now 2"), std::string::npos);
  other = run();
  other.clouds[2].fingerprint = "4";
  EXPECT_NE(why_not(other, pairs_).find("c is another cloud"), std::string::npos);
  other.clouds[2].name = "d";
  EXPECT_NE(why_not(other, pairs_).find("c is not there"), std::string::npos);
  EXPECT_NE(why_not(run(), {{1, 0}}).find("pair a c is none"), std::string::npos);
  EXPECT_EQ(content(), before);
  EXPECT_THROW(PairJournal(path_, run(), pairs_, Mode::fresh), UnfinishedRun);
  EXPECT_THROW(PairJournal::check(path_, Mode::fresh), UnfinishedRun);
  PairJournal::check(path_, Mode::resume);
  EXPECT_EQ(PairJournal(path_, run(), pairs_, Mode::restart).done(), 0u);
}

/// Clouds are known by their names, so others may come and go.
TEST_F(Journal, FollowsNamesToOtherPlaces) {
  write_two();
  RunIdentity more = run();
  more.clouds.insert(more.clouds.begin(), {"new", "9"});
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < 4; ++i)
    for (std::uint32_t j = i + 1; j < 4; ++j) pairs.push_back({j, i});
  {
    PairJournal journal(path_, more, pairs, Mode::resume);
    EXPECT_EQ(journal.done(), 2u);
    for (std::size_t k = 0; k < pairs.size(); ++k)
      EXPECT_EQ(journal.done(k), pairs[k].target == 1) << k;
    journal.add(0, result_number(5));
    journal.flush();
  }
  PairJournal again(path_, more, pairs, Mode::resume);
  EXPECT_EQ(again.done(), 3u);
  EXPECT_EQ(sets::bytes_of(again.result(0)), sets::bytes_of(result_number(5)));
}

TEST_F(Journal, HasOneWriter) {
  const PairJournal journal(path_, run(), pairs_, Mode::fresh);
  EXPECT_THROW(PairJournal::check(path_, Mode::resume), IoError);
  EXPECT_THROW(PairJournal(path_, run(), pairs_, Mode::resume), IoError);
}

}  // namespace
}  // namespace gpureg::test
