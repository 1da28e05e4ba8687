// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <unordered_map>

#include "fragment.hpp"

namespace gpureg::cuda {

/// Tracks the fragments in the memory of one engine: loads them, and evicts the least recently used
/// ones beyond a budget. Not thread-safe.
class Residence {
 public:
  /// budget: bytes; 0: no limit.
  Residence(Exec& exec, std::size_t budget) : exec_(exec), budget_(budget) {}

  std::size_t budget() const { return budget_; }
  std::size_t evictions() const { return evictions_; }

  /// Registers a fragment made on this device.
  void add(const Fragment& fragment);
  /// Copies of these fragments on the device of exec, one each and ready to read; they stay there
  /// while referenced. Throws DeviceError where the budget or the device cannot hold all of them at
  /// once.
  std::vector<std::shared_ptr<const CudaCloud>> bring(
      const std::vector<const Fragment*>& fragments);
  /// Evicts fragments until the remaining ones, except `kept`, and `more` bytes are within the
  /// budget.
  void make_room(std::size_t more, const std::vector<const Fragment*>& kept);

 private:
  struct Entry {
    /// Expired: a later fragment may have the address that the entry is filed under.
    std::weak_ptr<const Fragment> fragment;
    std::uint64_t used;
  };
  void forget_expired();

  Exec& exec_;
  std::size_t budget_;
  std::unordered_map<const Fragment*, Entry> entries_;
  std::uint64_t clock_ = 0;
  std::atomic<std::size_t> evictions_{0};
};

}  // namespace gpureg::cuda
