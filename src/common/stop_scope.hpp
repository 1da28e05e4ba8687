// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <functional>
#include <utility>

namespace gpureg {

/// What work of the CPU throws where a StopScope of its caller ends it.
struct Stopped {};

/// While one lives, CPU work that its thread calls asks should_stop every tenth of a second, and
/// throws Stopped where the answer is true. Nothing of that work runs on.
class StopScope {
 public:
  explicit StopScope(std::function<bool()> should_stop)
      : should_stop_(std::move(should_stop)), outer_(std::exchange(current(), this)) {}
  ~StopScope() { current() = outer_; }
  StopScope(const StopScope&) = delete;
  StopScope& operator=(const StopScope&) = delete;

  /// Called between two pieces of work, in any thread; asks in the thread of a scope only.
  static void poll() {
    if (StopScope* scope = current()) scope->ask();
  }

  /// As poll(), without regard to the tenth of a second.
  static void poll_now() {
    if (StopScope* scope = current()) {
      scope->next_ = Clock::time_point::min();
      scope->ask();
    }
  }

  /// True within should_stop: the work that waits for the answer holds the locks of its context.
  static bool asking() { return current() != nullptr && current()->asking_; }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kPeriod{100};

  static StopScope*& current() {
    thread_local StopScope* scope = nullptr;
    return scope;
  }

  void ask() {
    if (asking_ || Clock::now() < next_) return;
    asking_ = true;
    const bool stop = should_stop_();
    asking_ = false;
    next_ = Clock::now() + kPeriod;
    if (stop) throw Stopped();
  }

  std::function<bool()> should_stop_;
  StopScope* outer_;
  Clock::time_point next_ = Clock::now() + kPeriod;
  bool asking_ = false;
};

}  // namespace gpureg
