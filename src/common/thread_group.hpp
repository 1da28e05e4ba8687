// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <list>
#include <mutex>
#include <thread>
#include <vector>

namespace gpureg {

/// Threads that share loops, also loops within the elements of a loop: a thread that finds no
/// element of the first one helps with the loops of those that others work on. So a few large
/// elements keep all threads busy as well as many small ones.
class ThreadGroup {
 public:
  /// @param threads with the calling one; fewer where the system starts no more.
  explicit ThreadGroup(std::size_t threads);
  ~ThreadGroup();
  ThreadGroup(const ThreadGroup&) = delete;
  ThreadGroup& operator=(const ThreadGroup&) = delete;

  /// Calls work(k) once for each k in [0, count), and returns when all are done. Rethrows the first
  /// exception; elements that nobody has begun by then are left out. Several threads may call it at
  /// the same time, and work itself may.
  void parallel(std::size_t count, const std::function<void(std::size_t)>& work);

 private:
  struct Loop {
    const std::function<void(std::size_t)>& work;
    std::size_t count;
    std::atomic<std::size_t> next{0};
    std::size_t helpers = 0;  ///< guarded, as is the error
    std::exception_ptr error;
  };
  void run(Loop& loop);
  void help();

  std::mutex mutex_;
  std::condition_variable wake_, helped_;
  std::list<Loop*> loops_;  ///< in the order of their begin
  bool stop_ = false;
  std::vector<std::thread> helpers_;  ///< last: they use the other members from their start
};

}  // namespace gpureg
