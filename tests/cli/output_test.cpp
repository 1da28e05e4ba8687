// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

namespace fs = std::filesystem;

class Output : public ::testing::Test {
 protected:
  static constexpr int kScans = 6, kPairs = kScans * (kScans - 1) / 2;

  Output() { write_scans(scans_, kScans, false); }

  std::vector<std::string> batch(const std::string& log,
                                 const std::vector<std::string>& more = {}) const {
    return joined(joined({"batch", scans_.path(), "--quiet", "--threads", "1", "-o", log}, kSmall),
                  more);
  }

  // What a run without any trouble writes.
  std::string undisturbed_log() const {
    const std::string log = out_ / "undisturbed.log";
    EXPECT_EQ(run(batch(log)).status, 0);
    return content_of(log);
  }

  const TemporaryFolder scans_, out_;
};

TEST_F(Output, PlacesThatCannotBeWritten) {
  const std::string cloud = scans_ / "cloud_bin_0.ply", nowhere = out_ / "no/such/folder/file";
  for (const char* option : {"--json", "--overlay", "--image"}) {
    expect_refused(joined({"register", cloud, cloud, option, nowhere}, kSmall),
                   {nowhere, "folder"});
    expect_refused(joined({"register", cloud, cloud, option, out_.path()}, kSmall),
                   {out_.path(), "folder"});
  }
  expect_refused(batch(nowhere), {nowhere});
  expect_refused(batch(out_.path()), {out_.path(), "folder"});
  for (const char* option : {"--info", "--json"}) {
    expect_refused(batch(out_ / "r.log", {option, nowhere}), {nowhere});
    expect_refused(batch(out_ / "r.log", {option, out_ / "r.log"}), {"different files"});
  }
  // Not even root may make a file there.
  expect_refused(batch("/proc/r.log"), {"/proc/r.log"});
  EXPECT_EQ(out_.count(), 0u);
}

TEST_F(Output, NoOutputIsWrittenOverAnInputOrAnotherOutput) {
  const std::string a = scans_ / "cloud_bin_0.ply", b = scans_ / "cloud_bin_1.ply";
  const std::string before = content_of(b), log = out_ / "r.log";
  // However it is spelt.
  const std::string detour = scans_ / "../" + fs::path(scans_.path()).filename().string();
  fs::create_symlink(b, out_ / "link.ply");
  for (const std::string& same : {b, detour + "/cloud_bin_1.ply", out_ / "link.ply"}) {
    for (const char* option : {"--json", "--overlay", "--image"})
      expect_refused({"register", a, b, option, same}, {option, "TARGET", "different files", b});
    expect_refused(batch(log, {"--json", same}), {"--json", "SCANS", "different files", b});
  }
  expect_refused({"register", a, b, "--image", a}, {"--image", "SOURCE", a});
  expect_refused({"register", a, b, "--image", out_ / "x", "--json", out_ / "./x"},
                 {"--image", "--json", out_ / "./x"});
  const std::string cameras = scans_.write("cameras.txt", "0 0 0 0 0 0 0 0 1\n");
  expect_refused(batch(log, {"--info", cameras}), {"--info", "SCANS", cameras});
  const std::string pairs = out_.write("pairs.txt", "0 1\n");
  expect_refused(batch(log, {"--pairs", pairs, "--info", pairs}), {"--info", "--pairs", pairs});
  expect_refused(batch(log, {"--json", log + ".journal"}), {"--json", "journal of -o"});
  const std::string json = out_.write("r.json", "{\"pairs\": []}");
  expect_refused({"report", json, "-o", json}, {"-o", "RESULT", json});
  expect_refused({"report", json, "-o", b, "--clouds", scans_.path()}, {"-o", "--clouds", b});
  expect_refused({"consistency", json, "--json", json}, {"--json", "RESULT", json});
  expect_refused({"consistency", json, "--json", out_ / "x", "-o", out_ / "x"}, {"--json", "-o"});
  expect_refused({"evaluate", json, "--ground-truth", scans_.path(), "--json", json},
                 {"--json", "RESULT", json});
  expect_refused({"evaluate", json, "--ground-truth", scans_.path(), "--json", scans_ / "gt.log"},
                 {"--json", "--ground-truth", scans_ / "gt.log"});
  EXPECT_EQ(content_of(b), before);
  EXPECT_EQ(content_of(json), "{\"pairs\": []}");
  EXPECT_FALSE(fs::exists(log));
  // Nothing is lost in a device.
  EXPECT_EQ(run(batch("/dev/null", {"--json", "/dev/null"})).status, 0);
}

TEST_F(Output, UnwritableOutputIsFoundBeforeTheWork) {
  const Outcome outcome = run(joined({"register", scans_ / "cloud_bin_0.ply",
                                      scans_ / "cloud_bin_1.ply", "--json", out_ / "no/r.json"},
                                     kSmall));
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.out, "");
}

TEST_F(Output, FullDevice) {
  const std::string cloud = scans_ / "cloud_bin_0.ply", other = scans_ / "cloud_bin_1.ply";
  expect_refused(batch("/dev/full"), {"cannot write /dev/full", "No space left on device"});
  expect_refused(joined({"register", cloud, other, "--json", "/dev/full"}, kSmall),
                 {"cannot write /dev/full", "No space left on device"});
  Surroundings around;
  around.standard_output = "/dev/full";
  expect_refused({"info"}, {"cannot write to standard output"}, around);
  expect_refused(joined({"register", cloud, other}, kSmall), {"standard output"}, around);
}

TEST_F(Output, LogToADevice) {
  Surroundings around;
  const Outcome outcome = run(batch("/dev/stdout"), around);
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.out, undisturbed_log());
  expect_refused(batch("/dev/null", {"--resume"}), {"--resume", "/dev/null"});
}

TEST_F(Output, DiskFullWhileTheJournalGrows) {
  const std::string log = out_.write("r.log", "the result of yesterday\n");
  Surroundings around;
  around.file_bytes = 6000;  // the header and a few pairs
  expect_refused(batch(log), {"cannot write " + log + ".journal", "File too large"}, around);
  EXPECT_EQ(content_of(log), "the result of yesterday\n");
  EXPECT_EQ(out_.count(), 2u) << "only the old log and the journal may be there";
  // Refused again as long as there is no room, and then it goes on to the same bytes.
  expect_refused(batch(log, {"--resume"}), {log + ".journal", "File too large"}, around);
  EXPECT_EQ(run(batch(log, {"--resume"})).status, 0);
  EXPECT_EQ(out_.count(), 1u);
  EXPECT_EQ(content_of(log), undisturbed_log());
}

TEST_F(Output, DiskFullWhileAResultIsReplaced) {
  Surroundings around;
  around.file_bytes = 700;
  for (const char* option : {"--json", "--overlay", "--image"}) {
    const std::string result = out_.write("result", "the result of yesterday\n");
    expect_refused(
        joined({"register", scans_ / "cloud_bin_0.ply", scans_ / "cloud_bin_1.ply", option, result},
               kSmall),
        {"cannot write " + result, "File too large"}, around);
    EXPECT_EQ(content_of(result), "the result of yesterday\n");
    EXPECT_EQ(out_.count(), 1u) << "a temporary file was left behind";
  }
}

// A disk of a few pages, where the process may mount one. Nobody else sees it, and it goes with the
// process.
class SmallDisk {
 public:
  explicit SmallDisk(const std::string& folder) : folder_(folder) {
    mounted_ = ::unshare(CLONE_NEWNS) == 0 &&
               ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
               ::mount("tmpfs", folder_.c_str(), "tmpfs", 0, "size=16k") == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(folder_.c_str(), MNT_DETACH);
  }
  bool mounted() const { return mounted_; }
  void grow() const { ::mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT, "size=4m"); }

 private:
  std::string folder_;
  bool mounted_;
};

TEST_F(Output, ARealDiskThatIsFull) {
  const std::string expected = undisturbed_log();
  const TemporaryFolder place;
  const SmallDisk disk(place.path());
  if (!disk.mounted()) GTEST_SKIP() << "this process may not mount a small disk";
  const std::string log = place / "r.log";
  expect_refused(batch(log), {"cannot write " + log, "No space left on device"});
  EXPECT_FALSE(fs::exists(log));
  disk.grow();
  EXPECT_EQ(run(batch(log, {"--resume"})).status, 0);
  EXPECT_EQ(content_of(log), expected);
}

}  // namespace
}  // namespace gpureg::test
