// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "fuzz/targets.hpp"
#include "gpureg/sets/pair_journal.hpp"
#include "inputs/initial_poses.hpp"
#include "inputs/map_poses.hpp"
#include "inputs/saved_map.hpp"
#include "io/run_reader.hpp"
#include "json/json_file.hpp"
#include "records/pair_json.hpp"
#include "records/result_file.hpp"
#include "sets/journal_file.hpp"
#include "sets/result_bytes.hpp"

namespace gpureg::fuzz {
namespace {

/// Runs a reader of the command, which may refuse with an IoError or InvalidArgument.
template <typename Read>
void read(std::string_view bytes, const Read& read_file) {
  const test::MemoryFile file(bytes);
  try {
    read_file(file.path());
  } catch (const IoError& error) {
    if (std::string_view(error.what()).find(file.path()) == std::string_view::npos)
      broken("an error names its file");
  } catch (const InvalidArgument&) {
  }
}

/// Whatever is read can be copied and written.
void read_document(std::string_view bytes) {
  read(bytes, [](const std::string& path) {
    const cli::Json document = cli::DocumentFile(path).read();
    const cli::Json copy = document;
    if (copy.is_object()) cli::write_document("/dev/null", copy);
  });
}

void read_result(std::string_view bytes) {
  read(bytes, [](const std::string& path) {
    const cli::ResultFile result = cli::read_result(path, [](const cli::Json& pair) {
      const cli::Json once = cli::pair_to_json(0, 1, cli::result_from_json(pair));
      if (cli::pair_to_json(0, 1, cli::result_from_json(once)) != once)
        broken("a result survives its file");
    });
    result.mean_milliseconds();
    result.mean_prepare_milliseconds();
  });
}

/// The lines of the input as records with their checksums: mutations shall reach what stands behind
/// them.
std::string with_checksums(std::string_view bytes) {
  std::string out = sets::journal_head();
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    if (end > at)
      out += sets::record_of(static_cast<std::uint32_t>(bytes[at] & 7),
                             bytes.substr(at + 1, end - at - 1));
    at = end + 1;
  }
  return out;
}

void read_pairs_of_journal(std::string_view bytes) {
  for (const std::string& content : {std::string(bytes), with_checksums(bytes)})
    read(content, [](const std::string& path) {
      const JournalContents journal = read_journal(path);
      for (const RegistrationResult& result : journal.results) {
        if (result.has_pose() && !result.target_from_source.matrix().allFinite())
          broken("poses are finite");
        if (sets::result_of(sets::bytes_of(result), path).modes.size() != result.modes.size())
          broken("a result survives its file");
      }
    });
}

void read_initial_poses(std::string_view bytes) {
  read(bytes, [](const std::string& path) { cli::read_initial_poses(path); });
}

/// Of a map: a trajectory, a log or a graph; those that are there are rigid.
void read_poses(std::string_view bytes) {
  read(bytes, [](const std::string& path) {
    std::vector<io::ScanFile> scans;
    for (const int number : {0, 1, 2, 3, 5}) {
      const std::string name = "cloud_bin_" + std::to_string(number) + ".ply";
      scans.push_back({number, name, name});
    }
    std::size_t known = 0;
    for (const auto& scan : cli::read_pose_file(path, scans, "scans").scans) {
      const Eigen::Matrix3d r = scan.island_from_scan.linear();
      if (!scan.placed) continue;
      ++known;
      if (!((r * r.transpose() - Eigen::Matrix3d::Identity()).norm() < 0.1))
        broken("a pose is a rigid motion");
    }
    if (known < 2) broken("a map has two poses");
  });
}

/// reconstruction.json: every scan of an island has a rigid pose.
void read_reconstruction(std::string_view bytes) {
  read(bytes, [](const std::string& path) {
    const cli::SavedMap map = cli::read_saved_map(path);
    for (const std::vector<int>& island : map.islands)
      for (const int number : island) {
        const Eigen::Matrix3d r = map.poses.at(number).linear();
        if (!((r * r.transpose() - Eigen::Matrix3d::Identity()).norm() < 0.1))
          broken("a pose is a rigid motion");
      }
  });
}

}  // namespace

std::vector<Target> command_targets() {
  return {{"document", read_document},
          {"result", read_result},
          {"journal", read_pairs_of_journal},
          {"initial_poses", read_initial_poses},
          {"poses", read_poses},
          {"reconstruction", read_reconstruction}};
}

}  // namespace gpureg::fuzz
