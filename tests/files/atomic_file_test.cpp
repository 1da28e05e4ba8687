// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <thread>
#include <vector>

#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "support/expect_error.hpp"
#include "support/limited_file_size.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::files {
namespace {

using test::content_of;
using test::expect_error;
using test::TemporaryFolder;

TEST(AtomicFile, WritesAndReplacesAnyBytes) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.bin";
  const std::string bytes("\0\n\r\xff text", 9);
  write_atomically(path, bytes);
  EXPECT_EQ(content_of(path), bytes);
  write_atomically(path, "");
  EXPECT_EQ(content_of(path), "");
  EXPECT_EQ(folder.count(), 1u);
}

TEST(AtomicFile, PartByPart) {
  const TemporaryFolder folder;
  const std::string path = folder.write("a", "old");
  write_atomically(path, [](const Sink& write) {
    for (const char* part : {"one, ", "", "two"}) write(part);
  });
  EXPECT_EQ(content_of(path), "one, two");
  // What the caller throws leaves the old file, and no other.
  expect_error<InvalidArgument>(
      [&] {
        write_atomically(path, [](const Sink& write) {
          write("half");
          throw InvalidArgument("no more");
        });
      },
      {"no more"});
  EXPECT_EQ(content_of(path), "one, two");
  EXPECT_EQ(folder.count(), 1u);
}

TEST(AtomicFile, RespectsTheUmaskAndKeepsTheModeOfAnExistingFile) {
  const TemporaryFolder folder;
  const mode_t before = ::umask(022);
  write_atomically(folder / "new", "x");
  const std::string old = folder.write("old", "y");
  ::chmod(old.c_str(), 0600);
  write_atomically(old, "z");
  ::umask(before);
  EXPECT_EQ(std::filesystem::status(folder / "new").permissions(), std::filesystem::perms(0644));
  EXPECT_EQ(std::filesystem::status(old).permissions(), std::filesystem::perms(0600));
}

TEST(AtomicFile, WritesThroughALinkInsteadOfReplacingIt) {
  const TemporaryFolder folder;
  std::filesystem::create_symlink(folder.write("real", "old"), folder / "link");
  write_atomically(folder / "link", "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(content_of(folder / "real"), "new");
}

TEST(AtomicFile, WritesThroughALinkToAFileThatIsNotThereYet) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "results");
  std::filesystem::create_symlink("results/real", folder / "second");
  std::filesystem::create_symlink("second", folder / "first");
  write_atomically(folder / "first", "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "first"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "second"));
  EXPECT_EQ(content_of(folder / "results/real"), "new");

  std::filesystem::create_symlink(folder / "missing/real", folder / "lost");
  expect_error<IoError>([&] { write_atomically(folder / "lost", "new"); },
                        {"missing/real", "No such file"});
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "lost"));
  std::filesystem::create_symlink("circle", folder / "circle");
  expect_error<IoError>([&] { write_atomically(folder / "circle", "new"); }, {"circle"});
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "circle"));
}

TEST(AtomicFile, RemovesWhatKilledProcessesLeft) {
  const TemporaryFolder folder;
  const std::string left = folder.write(".gpureg-1-0.tmp", "half"),
                    other = folder.write(".gpureg-notes", "mine"),
                    written = folder.write(".gpureg-1-1.tmp", "goes on");
  const int fd = ::open(written.c_str(), O_RDONLY);
  ASSERT_EQ(::flock(fd, LOCK_EX), 0);  // as a process does that still writes
  write_atomically(folder / "a", "x");
  EXPECT_FALSE(std::filesystem::exists(left));
  EXPECT_TRUE(std::filesystem::exists(other));
  EXPECT_TRUE(std::filesystem::exists(written));
  ::close(fd);
}

// While many write at a time, nobody takes the file of another for a leftover.
TEST(AtomicFile, ProcessesDoNotTakeEachOthersFiles) {
  const TemporaryFolder folder;
  constexpr int kProcesses = 8, kFiles = 50;
  std::vector<pid_t> children;
  for (int p = 0; p < kProcesses; ++p) {
    const pid_t child = ::fork();
    if (child == 0) {
      int failed = 0;
      try {
        for (int k = 0; k < kFiles; ++k)  // a name of its own for each look
          write_atomically(folder.path() + std::string(1 + k, '/') + std::to_string(p), "x");
      } catch (const std::exception&) {
        failed = 1;
      }
      ::_exit(failed);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = -1;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
  }
  EXPECT_EQ(folder.count(), static_cast<std::size_t>(kProcesses));
}

TEST(AtomicFile, TakesNamesAsLongAsTheFileSystemDoes) {
  const TemporaryFolder folder;
  const std::string path = folder / std::string(255, 'n');
  write_atomically(path, "x");
  EXPECT_EQ(content_of(path), "x");
  expect_error<IoError>([&] { write_atomically(folder / std::string(256, 'n'), "x"); },
                        {"cannot write", "too long"});
}

TEST(AtomicFile, RelativeNamesWithoutAFolderWork) {
  const TemporaryFolder folder;
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  write_atomically("plain", "x");
  std::filesystem::current_path(before);
  EXPECT_EQ(content_of(folder / "plain"), "x");
}

TEST(AtomicFile, FullDiskIsAnErrorAndLeavesTheOldFileAlone) {
  const TemporaryFolder folder;
  const std::string path = folder.write("result.log", "the old content");
  {
    const test::LimitedFileSize limit(1000);
    expect_error<IoError>([&] { write_atomically(path, std::string(100000, 'x')); },
                          {path, "too large"});
    expect_error<IoError>([&] { write_atomically(folder / "other", std::string(100000, 'x')); },
                          {"other"});
  }
  EXPECT_EQ(content_of(path), "the old content");
  EXPECT_EQ(folder.count(), 1u) << "a partial file was left behind";
}

TEST(AtomicFile, FullDeviceIsAnErrorAndTheDeviceStays) {
  if (!std::filesystem::is_character_file("/dev/full"))
    GTEST_SKIP() << "no /dev/full on this machine";
  expect_error<IoError>([] { write_atomically("/dev/full", "x"); },
                        {"/dev/full", "No space left on device"});
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
  write_atomically("/dev/null", "x");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST(AtomicFile, UnwritablePathsAreNamed) {
  const TemporaryFolder folder;
  expect_error<IoError>([&] { write_atomically(folder.path(), "x"); }, {folder.path(), "folder"});
  expect_error<IoError>([&] { write_atomically(folder / "no/such", "x"); },
                        {"no/such", "No such file"});
  const std::string file = folder.write("file", "");
  expect_error<IoError>([&] { write_atomically(file + "/below", "x"); },
                        {"below", "Not a directory"});
  expect_error<IoError>([] { write_atomically("", "x"); }, {"empty"});
  if (::geteuid() != 0) {  // root may write everywhere
    ::chmod(file.c_str(), 0400);
    expect_error<IoError>([&] { write_atomically(file, "x"); }, {file, "Permission denied"});
    ::chmod(folder.path().c_str(), 0500);
    expect_error<IoError>([&] { write_atomically(folder / "new", "x"); }, {"Permission denied"});
    ::chmod(folder.path().c_str(), 0700);
  }
}

TEST(AtomicFile, ConcurrentWritersLeaveOneWholeFile) {
  const TemporaryFolder folder;
  const std::string path = folder / "contested";
  std::vector<std::thread> writers;
  for (char c = 'a'; c < 'a' + 8; ++c)
    writers.emplace_back([&path, c] {
      for (int k = 0; k < 20; ++k) write_atomically(path, std::string(20000, c));
    });
  for (std::thread& writer : writers) writer.join();
  const std::string content = content_of(path);
  ASSERT_EQ(content.size(), 20000u);
  EXPECT_EQ(content, std::string(20000, content[0]));
  EXPECT_EQ(folder.count(), 1u);
}

}  // namespace
}  // namespace gpureg::files
