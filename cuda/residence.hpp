// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>

#include "fragment.hpp"

namespace gpureg::cuda {

/// Which fragments are in the memory of one engine: brings them there, and drives the least
/// recently used out beyond a budget. To be used by one thread at a time.
class Residence {
 public:
  /// budget: bytes; 0: no limit.
  Residence(Exec& exec, std::size_t budget) : exec_(exec), budget_(budget) {}

  std::size_t budget() const { return budget_; }
  std::size_t evictions() const { return evictions_; }

  /// A fragment that was made here.
  void add(const Fragment& fragment);
  /// Copies of these fragments on the exec's device, one each and ready to be read; they stay there
  /// while the caller holds them. Throws DeviceError where the budget or the device has no room for
  /// all of them at once.
  std::vector<std::shared_ptr<const CudaCloud>> bring(
      const std::vector<const Fragment*>& fragments);
  /// Drives fragments out until what is left, but for `kept`, and `more` bytes are within the
  /// budget.
  void make_room(std::size_t more, const std::vector<const Fragment*>& kept);

 private:
  struct Entry {
    std::weak_ptr<const Fragment> fragment;
    std::uint64_t used;
  };
  Entry* find(const Fragment& fragment);

  Exec& exec_;
  std::size_t budget_;
  std::vector<Entry> entries_;
  std::uint64_t clock_ = 0;
  std::atomic<std::size_t> evictions_{0};
};

}  // namespace gpureg::cuda
