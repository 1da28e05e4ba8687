// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"

namespace gpureg::evaluation {
namespace {

std::string pair_name(int i, int j) { return std::to_string(i) + " " + std::to_string(j); }

// The protocol takes entry k of both files together, so they must name the same pair there.
void check_same_pairs(const std::string& log_path, const std::vector<LogEntry>& log,
                      const std::string& information_path,
                      const std::vector<InformationEntry>& information) {
  check_entries(log_path, log);
  check_entries(information_path, information);
  if (log.size() != information.size())
    throw IoError(information_path + ": has " + std::to_string(information.size()) +
                  " pairs, but " + log_path + " has " + std::to_string(log.size()));
  for (std::size_t k = 0; k < log.size(); ++k) {
    const InformationEntry& entry = information[k];
    const std::string where = information_path + ":" + std::to_string(entry.line) + ": entry " +
                              std::to_string(k + 1) + " (pair " + pair_name(entry.i, entry.j) + ")";
    if (entry.i != log[k].i || entry.j != log[k].j)
      throw IoError(where + " stands where " + log_path + " has pair " +
                    pair_name(log[k].i, log[k].j));
    if (!(entry.information(0, 0) > 0))
      throw IoError(where + " has information(0, 0) = " + std::to_string(entry.information(0, 0)) +
                    ", expected the number of correspondences, > 0");
  }
}

}  // namespace

GroundTruth read_ground_truth(const std::string& folder) {
  const std::filesystem::path root(folder);
  const std::string log = root / "gt.log", information = root / "gt.info";
  const std::string all_log = root / "gt_all.log", all_information = root / "gt_all.info";
  GroundTruth truth;
  truth.log = read_log(log);
  truth.information = read_information(information);
  check_same_pairs(log, truth.log, information, truth.information);
  std::error_code ignored;  // a path that cannot be looked at fails with its reason when it is read
  if (std::filesystem::exists(all_log, ignored) ||
      std::filesystem::exists(all_information, ignored)) {
    truth.all_log = read_log(all_log);
    truth.all_information = read_information(all_information);
    check_same_pairs(all_log, truth.all_log, all_information, truth.all_information);
  }
  return truth;
}

}  // namespace gpureg::evaluation
