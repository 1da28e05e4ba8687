// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <thread>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/sets/pair_journal.hpp"

namespace gpureg::test {
namespace {

/// Runs that end in the middle, and runs that go on.
class Resume : public ::testing::Test {
 protected:
  static constexpr int kScans = 8, kPairs = kScans * (kScans - 1) / 2;

  Resume() { write_scans(scans_, kScans, false); }

  // A run that nothing interrupts.
  void make_whole() const { EXPECT_EQ(run(batch("whole")).status, 0); }

  std::vector<std::string> batch(const std::string& name,
                                 const std::vector<std::string>& more = {}) const {
    return joined(joined({"batch", scans_.path(), "-o", out_ / (name + ".log"), "--info",
                          out_ / (name + ".info"), "--json", out_ / (name + ".json")},
                         kSmall),
                  more);
  }

  std::string journal(const std::string& name) const { return out_ / (name + ".log.journal"); }

  std::size_t lines(const std::string& path) const {
    const std::string text = content_of(path);
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }

  std::size_t pairs_in(const std::string& path) const {
    return is_journal(path) ? read_journal(path).pairs.size() : 0;
  }

  // Ends a run by a signal when it has done a few pairs.
  Outcome ended_midway(const std::string& name, int signal) const {
    Command command(batch(name, {"--threads", "1"}));  // small chunks, so that there is a midway
    while (command.running() && pairs_in(journal(name)) < 3)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    command.send(signal);
    return command.wait();
  }

  void expect_like_whole(const std::string& name) const {
    if (!std::filesystem::exists(out_ / "whole.log")) make_whole();
    for (const char* end : {".log", ".info"})
      EXPECT_TRUE(content_of(out_ / (name + end)) ==
                  content_of(out_ / (std::string("whole") + end)))
          << name << end << " differs";
    EXPECT_TRUE(without_times(json_of(out_ / (name + ".json"))) ==
                without_times(json_of(out_ / "whole.json")));
    EXPECT_FALSE(std::filesystem::exists(journal(name)));
  }

  const TemporaryFolder scans_, out_;
};

TEST_F(Resume, AfterAKill) {
  const Outcome killed = ended_midway("r", SIGKILL);
  ASSERT_EQ(killed.signal, SIGKILL);
  EXPECT_FALSE(std::filesystem::exists(out_ / "r.log")) << "half a result must not look like one";
  const std::size_t done = pairs_in(journal("r"));
  ASSERT_GT(done, 0u);
  ASSERT_LT(done, static_cast<std::size_t>(kPairs));
  const Outcome resumed = run(batch("r", {"--resume"}));
  EXPECT_EQ(resumed.status, 0);
  expect_holds(resumed.err, {std::to_string(done) + " of 28 pairs are done already"});
  expect_like_whole("r");
  EXPECT_EQ(json_of(out_ / "r.json")["seconds"]["pairs_in_this_run"], kPairs - done);
}

TEST_F(Resume, AfterAKillInTheMiddleOfAResult) {
  ASSERT_EQ(ended_midway("r", SIGKILL).signal, SIGKILL);
  const std::string text = content_of(journal("r"));
  out_.write("r.log.journal", text.substr(0, text.size() - 40));
  EXPECT_EQ(run(batch("r", {"--resume"})).status, 0);
  expect_like_whole("r");
}

TEST_F(Resume, AfterCtrlC) {
  make_whole();
  for (const int signal : {SIGINT, SIGTERM}) {
    const std::string name = "r" + std::to_string(signal);
    const Outcome interrupted = ended_midway(name, signal);
    EXPECT_EQ(interrupted.status, 130);
    expect_holds(interrupted.err, {"interrupted", "of 28 pairs are done", "--resume"});
    // What is done is kept: files that are whole, and say that they are not all.
    const auto json = json_of(out_ / (name + ".json"));
    EXPECT_EQ(json["complete"], false);
    const std::size_t done = json["pairs"].size();
    EXPECT_GT(done, 0u);
    EXPECT_LT(done, static_cast<std::size_t>(kPairs));
    const std::string log = out_ / (name + ".log");
    EXPECT_EQ(lines(log), 5 * done);
    EXPECT_EQ(content_of(out_ / "whole.log").rfind(content_of(log), 0), 0u);
    EXPECT_EQ(run(batch(name, {"--resume"})).status, 0);
    expect_like_whole(name);
  }
}

TEST_F(Resume, NothingToResumeStartsAnew) {
  const Outcome outcome = run(batch("r", {"--resume"}));
  EXPECT_EQ(outcome.status, 0);
  expect_holds(outcome.err, {"nothing to resume", journal("r")});
  expect_like_whole("r");
}

TEST_F(Resume, AnUnfinishedRunIsDiscardedOnRequestOnly) {
  ended_midway("r", SIGINT);
  const std::string before = content_of(journal("r")), log = content_of(out_ / "r.log");
  expect_refused(batch("r"), {journal("r"), "unfinished", "--resume continues", "--restart"});
  expect_refused(batch("r", {"--resume", "--restart"}), {"--resume", "--restart"});
  EXPECT_EQ(content_of(journal("r")), before);
  EXPECT_EQ(content_of(out_ / "r.log"), log);
  const Outcome anew = run(batch("r", {"--restart"}));
  EXPECT_EQ(anew.status, 0);
  EXPECT_EQ(json_of(out_ / "r.json")["seconds"]["pairs_in_this_run"], kPairs);
  expect_like_whole("r");
}

TEST_F(Resume, AnInterruptedRunLeavesAFinishedResultAsItIs) {
  const auto contents = [&] {
    std::vector<std::string> all;
    for (const char* name : {"whole.log", "whole.info", "whole.json"})
      all.push_back(content_of(out_ / name));
    return all;
  };
  make_whole();
  const std::vector<std::string> before = contents();
  const Outcome interrupted = ended_midway("whole", SIGINT);
  EXPECT_EQ(interrupted.status, 130);
  expect_holds(interrupted.err, {"to the journal", out_ / "whole.log", "--resume"});
  EXPECT_TRUE(contents() == before);
  // Nor does it become the unfinished run's own when that is resumed and interrupted again.
  Command again(batch("whole", {"--threads", "1", "--resume"}));
  const std::size_t before_again = pairs_in(journal("whole"));
  while (again.running() && pairs_in(journal("whole")) <= before_again)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  again.send(SIGINT);
  EXPECT_EQ(again.wait().status, 130);
  EXPECT_TRUE(contents() == before);
  EXPECT_EQ(run(batch("whole", {"--resume"})).status, 0);
  EXPECT_NE(content_of(out_ / "whole.json"), before[2]) << "it has other times";
  EXPECT_EQ(content_of(out_ / "whole.log"), before[0]);
}

TEST_F(Resume, ChangedOptionsAreRefused) {
  ended_midway("r", SIGINT);
  const std::string before = content_of(journal("r"));
  const auto refused = [&](const std::vector<std::string>& change,
                           std::initializer_list<std::string> fragments) {
    expect_refused(batch("r", joined({"--resume", "--quiet"}, change)), fragments);
    EXPECT_EQ(content_of(journal("r")), before);
  };
  refused({"--seed", "2"}, {"cannot resume", "options.seed was 1, now 2"});
  refused({"--min-confidence", "0.6"}, {"options.min_confidence was 0.5, now 0.6"});
  refused({"--preset", "loopsmart"}, {"cannot resume", "options."});
  const std::string pairs = out_.write("pairs.txt", "0 1\n");
  refused({"--pairs", pairs}, {"pair cloud_bin_0.ply cloud_bin_2.ply is none of this run"});
  // The fragments themselves count as well.
  write_cloud(scans_, "cloud_bin_3.ply", room_scan(9));
  refused({}, {"cloud_bin_3.ply is another cloud than before"});
  write_cloud(scans_, "cloud_bin_3.ply", room_scan(3));
  std::filesystem::remove(scans_ / "cloud_bin_1.ply");
  refused({}, {"cannot resume", "cloud_bin_1.ply is not there any more"});
}

TEST_F(Resume, DamagedJournalsAreRefused) {
  ended_midway("r", SIGINT);
  const std::string text = content_of(journal("r"));
  const auto refused = [&](const std::string& damaged, std::initializer_list<std::string> says) {
    out_.write("r.log.journal", damaged);
    expect_refused(batch("r", {"--resume", "--quiet"}), says);
    EXPECT_EQ(content_of(journal("r")), damaged);
  };
  std::string flipped = text;
  flipped[text.size() / 2] ^= 4;
  refused(flipped, {journal("r"), "damaged", "checksum", "--restart"});
  refused("1fae0e3f0c {\"gpureg_journal\":3}\n", {journal("r"), "older gpureg", "--restart"});
}

TEST_F(Resume, TwoRunsOfTheSameResult) {
  Command first(batch("r", {"--threads", "1"}));
  while (first.running() && !is_journal(journal("r")))
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  first.send(SIGSTOP);
  expect_refused(batch("r", {"--quiet"}), {journal("r"), "in use"});
  first.send(SIGCONT);
  EXPECT_EQ(first.wait().status, 0);
  expect_like_whole("r");
}

TEST_F(Resume, InterruptedBeforeTheFirstPair) {
  Command command(batch("early"));
  // The handler may not be there yet: a death by the signal is as good, files are not.
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  command.send(SIGINT);
  const Outcome outcome = command.wait();
  EXPECT_TRUE(outcome.signal == SIGINT || outcome.status == 130) << outcome.status;
  if (outcome.status == 130) expect_holds(outcome.err, {"interrupted"});
  if (outcome.signal == SIGINT) EXPECT_FALSE(std::filesystem::exists(out_ / "early.log"));
}

}  // namespace
}  // namespace gpureg::test
