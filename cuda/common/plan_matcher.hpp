// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/device/lanes.hpp"
#include "pipeline/plan_matcher.hpp"

namespace gpureg::cuda {

/// A map from above on one device.
class CudaPlan final : public PlanMatcher {
 public:
  /// Uploads the map. The lanes must outlive it.
  CudaPlan(Lanes& lanes, const plan::Map& map);

  std::vector<std::vector<plan::Place>> best_cells(Span<const plan::Scan> scans,
                                                   std::size_t most) override;
  std::vector<std::vector<plan::Place>> refine(
      Span<const plan::Scan> scans, const std::vector<std::vector<plan::Place>>& coarse) override;

 private:
  Lanes& lanes_;
  plan::Map map_;  ///< arrays on the device
  DeviceBuffer<std::uint32_t> coarse_;
  DeviceBuffer<std::uint16_t> walls_;
};

/// A cell of at most 2^24 in a row or column, and one of at most 256 headings, as a number: in the
/// order of PlanMatcher::best_cells().
using CellKey = std::uint64_t;
GPUREG_HD CellKey key_of(const plan::Place& place) {
  constexpr CellKey kMostScore = (1 << plan::kScoreBits) - 1;
  return (kMostScore - static_cast<CellKey>(place.score)) << 56 |
         static_cast<CellKey>(place.heading) << 48 | static_cast<CellKey>(place.y) << 24 |
         static_cast<CellKey>(place.x);
}
GPUREG_HD plan::Place place_of(CellKey key) {
  constexpr std::int32_t kMostScore = (1 << plan::kScoreBits) - 1;
  return {
      kMostScore - static_cast<std::int32_t>(key >> 56), static_cast<std::int32_t>(key & 0xffffff),
      static_cast<std::int32_t>(key >> 24 & 0xffffff), static_cast<std::int32_t>(key >> 48 & 0xff)};
}

/// A scan and one of its headings; a scan and one of its coarse places.
struct HeadingTask {
  std::uint32_t scan;
  std::int32_t heading;
};
struct RefineTask {
  std::uint32_t scan;
  plan::Place coarse;
};

constexpr std::size_t kScores = std::size_t(1) << plan::kScoreBits;

/// Adds the number of cells of each score, for scores from least[scan] on, to counts[scan].
void count_cells(Exec& exec, const plan::Map& map, const plan::Scan* scans, std::size_t most_words,
                 const HeadingTask* tasks, std::size_t count, const std::int32_t* least,
                 unsigned long long* counts);
/// Sets least[scan] to least_score() of the counts, if that is more.
void raise_least(Exec& exec, const unsigned long long* counts, std::size_t scans, std::size_t most,
                 std::int32_t* least);
/// Lists the cells whose scores are at least least[scan]: found[scan] of them, at cells + most
/// scan.
void list_cells(Exec& exec, const plan::Map& map, const plan::Scan* scans, std::size_t most_words,
                const HeadingTask* tasks, std::size_t count, const std::int32_t* least,
                std::size_t most, std::uint32_t* found, CellKey* cells);
void refine_places(Exec& exec, const plan::Map& map, const plan::Scan* scans,
                   const RefineTask* tasks, std::size_t count, plan::Place* refined);

}  // namespace gpureg::cuda
