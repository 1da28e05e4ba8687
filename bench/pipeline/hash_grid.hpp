// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/closest.hpp"
#include "pipeline/prepared_state.hpp"

namespace gpureg::bench {

/// Closest-point grid of a prepared cloud on device 0, with a hash table and the candidates of each
/// cell one after the other. The library packs them and keeps no such copy.
class HashGrid {
 public:
  explicit HashGrid(const PreparedState& cloud);
  ~HashGrid();
  HashGrid(const HashGrid&) = delete;
  HashGrid& operator=(const HashGrid&) = delete;
  const ClosestGridView& view() const { return view_; }

 private:
  void* memory_ = nullptr;
  ClosestGridView view_{};
};

}  // namespace gpureg::bench
