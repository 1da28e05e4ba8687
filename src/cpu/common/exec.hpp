// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace gpureg::cpu {

/// Threads and clock of the CPU backend. The assignment of blocks to threads varies, so the output
/// of a block must depend on the block only.
class Exec {
 public:
  /// Fewer threads where the system starts no more.
  explicit Exec(unsigned threads);
  ~Exec();
  Exec(const Exec&) = delete;
  Exec& operator=(const Exec&) = delete;

  unsigned threads() const { return static_cast<unsigned>(workers_.size()) + 1; }

  /// Calls task(k) once for each k in [0, count), on all threads; returns when all are done.
  /// Rethrows the first exception.
  void parallel(std::size_t count, const std::function<void(std::size_t)>& task);

  /// Calls work(entry, begin, end) for the blocks of each batch entry in turn, at most grain
  /// elements each. counts[k]: number of elements of entry k.
  template <typename Count, typename Work>
  void parallel_items(std::size_t entries, Count&& count, std::size_t grain, Work&& work) {
    struct Block {
      std::size_t entry, begin, end;
    };
    std::vector<Block> blocks;
    for (std::size_t e = 0; e < entries; ++e) {
      const std::size_t n = count(e);
      for (std::size_t b = 0; b < n; b += grain)
        blocks.push_back({e, b, b + grain < n ? b + grain : n});
    }
    parallel(blocks.size(),
             [&](std::size_t k) { work(blocks[k].entry, blocks[k].begin, blocks[k].end); });
  }

  /// A point in time, and the time between two.
  using Mark = std::chrono::steady_clock::time_point;
  Mark mark() const { return std::chrono::steady_clock::now(); }
  double milliseconds(Mark from, Mark to) const {
    return std::chrono::duration<double, std::milli>(to - from).count();
  }

 private:
  void run_tasks();
  void worker();

  std::mutex mutex_;
  std::condition_variable wake_, done_;
  const std::function<void(std::size_t)>* task_ = nullptr;
  std::size_t next_ = 0, count_ = 0, running_ = 0;
  unsigned long generation_ = 0;
  bool stop_ = false;
  std::exception_ptr error_;
  std::vector<std::thread> workers_;  ///< last: they use the other members from their start
};

}  // namespace gpureg::cpu
