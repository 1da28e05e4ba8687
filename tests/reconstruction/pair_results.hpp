// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "gpureg/reconstruction.hpp"
#include "support/registration_result.hpp"
#include "support/scan.hpp"

namespace gpureg::test {

/// Pairs of scans with results as align_batch() would return them.
struct PairResults {
  std::vector<UnalignedIsometry3d> world_from_scan;
  std::vector<Pair> pairs;
  std::vector<RegistrationResult> results;

  /// Scans at random poses.
  explicit PairResults(std::size_t scans, unsigned seed = 1) {
    std::mt19937 random(seed);
    for (std::size_t k = 0; k < scans; ++k) world_from_scan.emplace_back(random_pose(random));
  }

  UnalignedIsometry3d truth(std::uint32_t source, std::uint32_t target) const {
    return world_from_scan[target].inverse() * world_from_scan[source];
  }

  void add(std::uint32_t source, std::uint32_t target, double confidence,
           const UnalignedIsometry3d& target_from_source) {
    pairs.push_back({source, target});
    results.push_back(result_of(target_from_source, confidence));
  }

  /// A correct pose with an error of a few millimetres.
  void add_correct(std::uint32_t source, std::uint32_t target, double confidence = 0.95) {
    const double millimetres = (source * 7 + target * 3) % 5;
    UnalignedIsometry3d pose = truth(source, target);
    pose.translation().x() += 0.001 * millimetres;
    add(source, target, confidence, pose);
  }

  /// A pose that is metres away from the correct one.
  void add_false(std::uint32_t source, std::uint32_t target, double confidence) {
    std::mt19937 random(1000 * source + target);
    add(source, target, confidence,
        truth(source, target) * UnalignedIsometry3d(random_pose(random)));
  }

  void add_too_few_points(std::uint32_t source, std::uint32_t target, bool in_source) {
    RegistrationResult result;
    result.status = RegistrationStatus::not_aligned;
    result.reason = in_source ? RegistrationReason::too_few_source_points
                              : RegistrationReason::too_few_target_points;
    pairs.push_back({source, target});
    results.push_back(result);
  }

  /// Correct pairs of scans at most `reach` apart, for begin <= scan < end.
  void add_chain(std::uint32_t begin, std::uint32_t end, std::uint32_t reach,
                 double confidence = 0.95) {
    for (std::uint32_t i = begin; i < end; ++i)
      for (std::uint32_t j = i + 1; j < end && j <= i + reach; ++j) add_correct(j, i, confidence);
  }

  reconstruction::Reconstruction map(const reconstruction::Options& options = {}) const {
    return reconstruction::reconstruct_from_poses(world_from_scan.size(), pairs, results, options);
  }
};

/// Largest distance, in metres, between the positions of an island and the true ones, in the frame
/// of its first scan.
inline double largest_error(const reconstruction::Reconstruction& map,
                            const std::vector<UnalignedIsometry3d>& world_from_scan,
                            std::size_t island) {
  const std::vector<std::uint32_t>& scans = map.islands.at(island).scans;
  double largest = 0;
  for (const std::uint32_t scan : scans) {
    const UnalignedIsometry3d truth = world_from_scan[scans[0]].inverse() * world_from_scan[scan];
    largest = std::max(
        largest, (map.scans[scan].island_from_scan.translation() - truth.translation()).norm());
  }
  return largest;
}

/// All numbers of a map, for comparison by bytes.
inline std::string bytes_of(const reconstruction::Reconstruction& map) {
  std::string bytes;
  const auto add = [&](double value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof raw);
  };
  for (const reconstruction::Scan& scan : map.scans) {
    add(scan.placed);
    add(scan.island);
    add(scan.confidence);
    for (int k = 0; k < 16; ++k)
      add(scan.placed ? scan.island_from_scan.matrix()(k / 4, k % 4) : 0);
  }
  for (const reconstruction::Edge& edge : map.edges) {
    add(edge.accepted);
    add(edge.weight);
    add(edge.confidence);
  }
  return bytes;
}

}  // namespace gpureg::test
