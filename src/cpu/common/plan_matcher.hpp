// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <mutex>

#include "cpu/common/exec.hpp"
#include "pipeline/plan_matcher.hpp"

namespace gpureg::cpu {

/// The arrays of the map stay the caller's.
class CpuPlan final : public PlanMatcher {
 public:
  CpuPlan(Exec& exec, std::mutex& mutex, const plan::Map& map);

  std::vector<std::vector<plan::Place>> best_cells(Span<const plan::Scan> scans,
                                                   std::size_t most) override;
  std::vector<std::vector<plan::Place>> refine(
      Span<const plan::Scan> scans, const std::vector<std::vector<plan::Place>>& coarse) override;

 private:
  Exec& exec_;
  std::mutex& mutex_;
  plan::Map map_;
  /// The coarse planes without the first 0 to 7 bits of each: any bit of a plane is the first of a
  /// byte in one of them.
  std::vector<std::uint8_t> shifted_;
  std::size_t bytes_ = 0;  ///< of one
};

}  // namespace gpureg::cpu
