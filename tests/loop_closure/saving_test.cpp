// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <limits>

#include "common/fnv1a.hpp"
#include "loop_closure/drive.hpp"
#include "support/expect_error.hpp"
#include "support/limited_file_size.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::test {
namespace {

void write(const std::string& path, const std::string& content) {
  std::ofstream(path, std::ios::binary) << content;
}

class Saving : public testing::Test {
 protected:
  Saving() : closer(closer_of()), s(sequence(square(40))) {
    s.add_to(closer, 0, 30);
    for (int k = 20; k < 30; k += 3) add_correct(closer, s, k, k - 20, 0.8);
    closer.process();
    path = folder / "state.gpureg";
  }

  void go_on(LoopCloser& c) const {
    s.add_to(c, 30);
    for (int k = 30; k < 40; k += 3) add_correct(c, s, k, k - 20, 0.8);
    c.remove(12);
    c.process();
  }

  TemporaryFolder folder;
  LoopCloser closer;
  Sequence s;
  std::string path;
};

TEST_F(Saving, GoesOnWithTheSameBits) {
  closer.set_covisible(29, {3});  // waits for the next process()
  closer.save(path);
  LoopCloser loaded = closer_of();
  loaded.load(path, nullptr);
  EXPECT_EQ(bytes_of(loaded), bytes_of(closer));
  EXPECT_EQ(loaded.size(), closer.size());
  go_on(closer);
  go_on(loaded);
  EXPECT_EQ(bytes_of(loaded), bytes_of(closer));
  // What was known is known: ids, odometry.
  expect_error<InvalidArgument>([&] { loaded.add({5}); }, {"fragment 5"});
  expect_error<InvalidArgument>([&] { loaded.add_odometry(6, 5, Pose::Identity()); }, {"before"});
}

TEST_F(Saving, AStateOfAnotherVoxelSizeIsRefused) {
  closer.save(path);
  LoopCloser coarse = closer_of(loop_closure::Options{RegistrationOptions{0.5f}});
  expect_error<InvalidArgument>([&] { coarse.load(path, nullptr); }, {path, "0.05 m", "0.5 m"});
  EXPECT_EQ(coarse.size(), 0u);
}

TEST_F(Saving, DamagedFilesAreNamedAndTheStateStays) {
  closer.save(path);
  const std::string good = content_of(path), before = bytes_of(closer);
  const auto refused = [&](const std::string& content, const char* why) {
    write(path, content);
    expect_error<IoError>([&] { closer.load(path, nullptr); }, {path, why});
    EXPECT_EQ(bytes_of(closer), before);
  };
  refused("", "no saved state");
  refused("some other file that is long enough to have a header", "no saved state");
  for (const std::size_t size :
       {std::size_t(12), std::size_t(28), good.size() / 2, good.size() - 1})
    refused(good.substr(0, size), "truncated");
  refused(good + "x", "longer");
  std::string later = good;
  later[8] = 3;
  refused(later, "version 3");
  for (std::size_t at = 28; at < good.size(); at += good.size() / 50) {
    std::string flipped = good;
    flipped[at] = static_cast<char>(flipped[at] ^ 0x10);
    refused(flipped, "checksum");
  }
  expect_error<IoError>([&] { closer.load(folder / "missing", nullptr); }, {"missing"});
}

/// A file whose checksum is right whatever its payload is.
std::string with_checksum(std::string content) {
  constexpr std::size_t header = 28, place = 20;
  Fnv1a sum;
  sum.add_bytes(std::string_view(content).substr(header));
  const std::uint64_t value = sum.value();
  std::memcpy(content.data() + place, &value, sizeof value);
  return content;
}

TEST_F(Saving, WildNumbersUnderARightChecksumAreRefusedOrProcessed) {
  closer.save(path);
  const std::string good = content_of(path);
  ASSERT_EQ(with_checksum(good), good);
  const double wild[] = {1e200,
                         -1e200,
                         1e-300,
                         std::numeric_limits<double>::quiet_NaN(),
                         std::numeric_limits<double>::infinity(),
                         -1,
                         2};
  std::size_t refused = 0, taken = 0, number = 0;
  for (std::size_t at = 28; at + 8 < good.size(); at += 8 * 7 + 3) {
    std::string bytes = good;
    std::memcpy(bytes.data() + at, &wild[number++ % std::size(wild)], 8);
    write(path, with_checksum(bytes));
    LoopCloser other = closer_of();
    try {
      other.load(path, nullptr);
    } catch (const IoError& error) {
      EXPECT_NE(std::string(error.what()).find(path), std::string::npos);
      ++refused;
      continue;
    } catch (const InvalidArgument&) {
      ++refused;  // a fragment that has a cloud now
      continue;
    }
    ++taken;
    other.add_loop(29, 1, Pose::Identity());  // everything is verified again
    EXPECT_NO_THROW(other.process()) << at;
    EXPECT_NO_THROW(other.remove(other.poses().front().id)) << at;
    EXPECT_NO_THROW(other.process()) << at;
  }
  EXPECT_GT(refused, 100u);
  EXPECT_GT(taken, 20u);
}

TEST_F(Saving, AFullDiskLeavesTheOldFile) {
  closer.save(path);
  const std::string old = content_of(path);
  go_on(closer);
  const std::string before = bytes_of(closer);
  {
    const LimitedFileSize full(1000);
    expect_error<IoError>([&] { closer.save(path); }, {path});
  }
  EXPECT_EQ(content_of(path), old);
  EXPECT_EQ(bytes_of(closer), before);
}

TEST_F(Saving, CloudsAreAskedForAndCompared) {
  std::vector<Eigen::Vector3f> points;
  for (int k = 0; k < 500; ++k)
    points.emplace_back(0.1f * float(k % 25), 0.1f * float(k / 25), 0.3f * float(k % 7));
  const Context context = Context::cpu(1);
  const PreparedCloud cloud = prepare(context, PointCloudView(points));
  closer.add({1000, 0, 0, cloud});
  closer.process();
  closer.save(path);
  LoopCloser loaded = closer_of();
  expect_error<InvalidArgument>([&] { loaded.load(path, nullptr); }, {"fragment 1000"});
  points[7].x() += 0.2f;
  expect_error<InvalidArgument>(
      [&] {
        loaded.load(path, [&](FragmentId) { return prepare(context, PointCloudView(points)); });
      },
      {"fragment 1000", "another"});
  EXPECT_EQ(loaded.size(), 0u);
  loaded.load(path, [&](FragmentId id) {
    EXPECT_EQ(id, 1000);
    return cloud;
  });
  EXPECT_EQ(bytes_of(loaded), bytes_of(closer));
}

}  // namespace
}  // namespace gpureg::test
