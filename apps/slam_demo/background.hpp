// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace slam_demo {

/// Runs tasks one after the other in a thread of its own, or at once where it has none.
class Background {
 public:
  explicit Background(bool parallel) {
    if (parallel) thread_ = std::thread([this] { work(); });
  }
  ~Background() {
    if (!thread_.joinable()) return;
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
      tasks_.clear();
    }
    changed_.notify_all();
    thread_.join();
  }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  /// Returns at once, unless very many wait: then memory matters more.
  void post(std::function<void()> task) {
    if (!thread_.joinable()) return task();
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return tasks_.size() < kMost; });
    tasks_.push_back(std::move(task));
    changed_.notify_all();
  }

  /// Waits until all are done, and throws what one of them threw.
  void drain() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return tasks_.empty() && !running_; });
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  }

 private:
  static constexpr std::size_t kMost = 100;  // two images each: 250 MB

  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [&] { return ending_ || !tasks_.empty(); });
      if (ending_) return;
      const std::function<void()> task = std::move(tasks_.front());
      tasks_.pop_front();
      running_ = true;
      lock.unlock();
      std::exception_ptr error;
      try {
        task();
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      running_ = false;
      if (error && !error_) error_ = error;
      changed_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool running_ = false, ending_ = false;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace slam_demo
