// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <map>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/evaluation/trajectory.hpp"
#include "gpureg/io.hpp"
#include "gpureg/localization.hpp"
#include "gpureg/reconstruction/reconstruct.hpp"
#include "gpureg/sets/register_all.hpp"
#include "gpureg/sets/scan_files.hpp"

namespace gpureg::test {
namespace {

constexpr int kScans = 4;

// Each in at most ten lines, as a user of the library writes it.

RegistrationResult pair(const std::string& source, const std::string& target) {
  const PointCloud a = io::read_point_cloud(source), b = io::read_point_cloud(target);
  return align(Context::cpu(), a.view(), b.view(), RegistrationOptions{0.1f});
}

/// Goes on where an interrupted run stopped.
RegisterAllReport batch(const ScanFiles& scans, const std::string& journal_file) {
  const auto options = RegistrationOptions{0.1f};
  PairJournal journal(journal_file, identity_of(scans, options), all_pairs(scans.size()),
                      PairJournal::Mode::resume);
  return register_all({Context::cpu()}, scans, journal, options);
}

reconstruction::MapOfSet map(const std::string& folder) {
  const reconstruction::MapOptions options{RegistrationOptions{0.1f}};
  return reconstruct(Context::cpu(), ScanFiles(folder), {}, options);
}

localization::LocateResult place(const std::string& scan, const std::string& map_file) {
  const PointCloud cloud = io::read_point_cloud(scan), map = io::read_point_cloud(map_file);
  const auto options = localization::MapOptions{0.1f};
  return locate(Context::cpu(), cloud.view(), prepare_map(map.view(), options));
}

std::vector<double> numbers(const Eigen::Matrix4d& matrix) {
  std::vector<double> out;
  for (int k = 0; k < 16; ++k) out.push_back(matrix(k / 4, k % 4));
  return out;
}

/// The calls of the library give what the command writes, to the last bit.
class Library : public ::testing::Test {
 protected:
  Library() { write_scans(scans_, kScans, true); }

  Outcome command(const std::vector<std::string>& arguments) const {
    return run(joined(arguments, kSmall));
  }

  const TemporaryFolder scans_, out_;
};

TEST_F(Library, GivesThePairOfTheCommand) {
  const std::string source = scans_ / "cloud_bin_0.ply", target = scans_ / "cloud_bin_1.ply";
  ASSERT_EQ(command({"register", source, target, "--json", out_ / "r.json"}).status, 0);
  const auto json = json_of(out_ / "r.json").at("result");
  const RegistrationResult result = pair(source, target);
  EXPECT_EQ(json.at("target_from_source").get<std::vector<double>>(),
            numbers(result.target_from_source.matrix()));
  EXPECT_EQ(json.at("confidence").get<double>(), result.confidence);
}

TEST_F(Library, GivesTheBatchOfTheCommand) {
  ASSERT_EQ(command({"batch", scans_.path(), "-o", out_ / "c.log"}).status, 0);
  const ScanFiles scans(scans_.path());
  EXPECT_TRUE(batch(scans, out_ / "pairs.journal").complete);
  const std::string journal = content_of(out_ / "pairs.journal");
  batch(scans, out_ / "pairs.journal");
  EXPECT_EQ(content_of(out_ / "pairs.journal"), journal) << "nothing was left to do";
  const JournalContents made = read_journal(out_ / "pairs.journal");
  std::map<std::pair<int, int>, evaluation::LogEntry> log;
  for (std::size_t k = 0; k < made.pairs.size(); ++k) {
    const int i = scans.number(made.pairs[k].target), j = scans.number(made.pairs[k].source);
    if (made.results[k].aligned())
      log[{i, j}] = {i, j, kScans + 2, made.results[k].target_from_source.matrix()};
  }
  std::vector<evaluation::LogEntry> entries;
  for (const auto& [pair, entry] : log) entries.push_back(entry);
  evaluation::write_log(out_ / "l.log", entries);
  EXPECT_TRUE(content_of(out_ / "l.log") == content_of(out_ / "c.log"));
}

TEST_F(Library, GivesTheMapAndThePlaceOfTheCommand) {
  ASSERT_EQ(command({"reconstruct", scans_.path(), "-o", out_ / "map"}).status, 0);
  const reconstruction::MapOfSet made = map(scans_.path());
  evaluation::Trajectory trajectory;
  for (const std::uint32_t k : made.map.islands.at(0).scans)
    trajectory.push_back({static_cast<double>(k), made.map.scans[k].island_from_scan.matrix()});
  evaluation::write_trajectory(out_ / "l.txt", trajectory);
  EXPECT_TRUE(content_of(out_ / "l.txt") == content_of(out_ / "map/trajectory.txt"));
  const auto scans = json_of(out_ / "map/reconstruction.json").at("scans");
  for (std::size_t k = 0; k < scans.size(); ++k)
    EXPECT_EQ(scans.at(k).at("confidence").get<double>(), made.map.scans[k].confidence);

  const std::string scan = write_cloud(out_, "scan.ply", room_scan(6)), all = out_ / "map/map.ply";
  ASSERT_EQ(command({"locate", scan, all, "--json", out_ / "l.json"}).status, 0);
  const auto poses = json_of(out_ / "l.json").at("scans").at(0).at("poses");
  const localization::LocateResult found = place(scan, all);
  ASSERT_EQ(poses.size(), found.poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    EXPECT_EQ(poses.at(k).at("map_from_scan").get<std::vector<double>>(),
              numbers(found.poses[k].map_from_scan.matrix()));
    EXPECT_EQ(poses.at(k).at("confidence").get<double>(), found.poses[k].confidence);
  }
}

}  // namespace
}  // namespace gpureg::test
