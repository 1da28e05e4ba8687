// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <utility>

namespace slam_demo {

/// Work beside tracking, step by step in a fixed order. Steps run in the caller's thread, so they
/// may change the map; what takes long runs in another thread, on copies. Not thread-safe.
class Steps {
 public:
  /// parallel: false runs everything in the caller's thread.
  explicit Steps(bool parallel) : parallel_(parallel) {}

  bool empty() const { return steps_.empty(); }

  /// A step at the end; within a step, after those that this one has added, before all others.
  void then(std::function<void()> run) {
    add({[] { return true; }, [] {}, std::move(run)});
  }

  /// Runs job() in another thread from now on; the step next(result) follows when it is done.
  /// milliseconds: gets the time of the job added; must live as long as this.
  template <class Job, class Next>
  void beside(double& milliseconds, Job job, Next next) {
    auto timed = [job = std::move(job)]() mutable {
      const auto start = Clock::now();
      auto result = job();
      return std::make_pair(std::move(result), since(start));
    };
    using Result = decltype(std::declval<Job&>()());
    auto future = std::make_shared<std::future<std::pair<Result, double>>>(
        std::async(parallel_ ? std::launch::async : std::launch::deferred, std::move(timed)));
    add({[future] {
           return future->wait_for(std::chrono::seconds(0)) != std::future_status::timeout;
         },
         [future] { future->wait(); },
         [future, next = std::move(next), &milliseconds]() mutable {
           auto [result, time] = future->get();
           milliseconds += time;
           next(std::move(result));
         }});
  }

  /// Runs steps until the next one waits for another thread or so many milliseconds have passed;
  /// without parallel, all.
  void run(double milliseconds) {
    const auto start = Clock::now();
    while (!steps_.empty() && steps_.front().ready() && (!parallel_ || since(start) < milliseconds))
      run_first();
  }

  /// Runs all, and waits where it must.
  void finish() {
    while (!steps_.empty()) {
      steps_.front().wait();
      run_first();
    }
  }

 private:
  using Clock = std::chrono::steady_clock;
  struct Step {
    std::function<bool()> ready;
    std::function<void()> wait, run;
  };

  static double since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  }

  void add(Step step) { (running_ ? added_ : steps_).push_back(std::move(step)); }

  void run_first() {
    const Step first = std::move(steps_.front());
    steps_.pop_front();
    running_ = true;
    first.run();
    running_ = false;
    steps_.insert(steps_.begin(), std::make_move_iterator(added_.begin()),
                  std::make_move_iterator(added_.end()));
    added_.clear();
  }

  const bool parallel_;
  bool running_ = false;
  std::deque<Step> steps_, added_;
};

}  // namespace slam_demo
