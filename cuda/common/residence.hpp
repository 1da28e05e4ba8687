// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <unordered_map>

#include "cuda/common/prepared_cloud.hpp"

namespace gpureg::cuda {

/// Tracks the clouds in the memory of one engine: loads them, and evicts the least recently used
/// ones beyond a budget. Thread-safe: the lanes of an engine share it.
class Residence {
 public:
  /// budget: bytes; 0: no limit.
  Residence(const Exec& exec, std::size_t budget) : memory_(exec.memory()), budget_(budget) {}

  int device() const { return memory_->device(); }
  std::size_t budget() const { return budget_; }
  std::size_t evictions() const { return evictions_; }

  /// Registers a cloud made on this device.
  void add(const PreparedCloud& cloud);
  /// Copies of these clouds on the device, one each and ready to read; exec copies those that
  /// are missing. They stay there while referenced. Throws DeviceError where the budget or the
  /// device cannot hold all of them at once.
  std::vector<std::shared_ptr<const CudaCloud>> bring(
      Exec& exec, const std::vector<const PreparedCloud*>& clouds);
  /// Evicts clouds until the remaining ones, except `kept`, and `more` bytes are within the
  /// budget.
  void make_room(std::size_t more, const std::vector<const PreparedCloud*>& kept);

 private:
  struct Entry {
    /// Expired: a later cloud may have the address that the entry is filed under.
    std::weak_ptr<const PreparedCloud> cloud;
    std::uint64_t used;
  };
  void add_locked(const PreparedCloud& cloud);
  void make_room_locked(std::size_t more, const std::vector<const PreparedCloud*>& kept);
  void forget_expired();

  std::mutex mutex_;
  std::shared_ptr<DeviceMemory> memory_;
  std::size_t budget_;
  std::unordered_map<const PreparedCloud*, Entry> entries_;
  std::uint64_t clock_ = 0;
  std::atomic<std::size_t> evictions_{0};
};

}  // namespace gpureg::cuda
