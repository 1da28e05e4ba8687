// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "gpureg/pruning.hpp"

namespace gpureg::pruning {

/// How well matches of the key points of two clouds agree with one rigid motion: second-order
/// compatibility as in SC2-PCR (Chen et al. 2022), without the motion. Working memory of one
/// thread.
class Agreement {
 public:
  /// The cloud must stay alive.
  void set_target(const Summary& target);
  /// @return the logarithm of one more than the strongest support of a match; 0 for clouds without
  ///   matches. Exact integers but for the geometry, so it does not depend on vector widths.
  double with(const Summary& source);

 private:
  void multiply(const Summary& source, std::size_t point);
  void match(const Summary& source);
  void compare(const Summary& source);
  double strongest_support() const;

  struct Match {
    std::uint32_t source, target;
  };
  /// Per key point the keys of the two most similar of the other cloud: product and point.
  struct Best {
    std::vector<float> first, second;
  };
  const Summary* target_ = nullptr;
  std::size_t dimension_ = 0;
  std::vector<float> columns_;  ///< features of the target, transposed; zeros fill the last four
  std::vector<float> products_, feature_;
  Best of_source_, of_target_;
  std::vector<Match> matches_;
  std::size_t width_ = 0;                   ///< words of a row of bits
  std::vector<std::uint64_t> compatible_;   ///< per match one row of bits
  std::vector<std::uint32_t> compatibles_;  ///< bits set per row
};

}  // namespace gpureg::pruning
