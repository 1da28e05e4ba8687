// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>

#include "cuda/device/exec.hpp"

namespace gpureg::cuda {

/// Lanes of one device: streams with memory of their own, each for one call at a time. While one
/// lane waits for the host, uploads, or runs the last blocks of a kernel, others use the device.
/// Thread-safe.
class Lanes {
 public:
  static constexpr std::size_t kLanes = 4;
  /// The first lanes, which a large call takes together. More would share the device without gain;
  /// the others are for small calls of other threads, which do not wait for the large one.
  static constexpr std::size_t kTogether = 2;

  explicit Lanes(int device);

  /// Lanes in use by a call until the end of the scope. A call that fails leaves them when their
  /// work is done: it may read clouds in the memory of other lanes, which their owners may free
  /// from then on.
  class Held {
   public:
    Held(Lanes& lanes, std::size_t first, std::size_t count)
        : lanes_(lanes), first_(first), count_(count) {}
    ~Held();
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    Exec& exec(std::size_t k = 0) const { return *lanes_.execs_[first_ + k]; }
    /// Waits for the work of these lanes, without a report of its errors.
    void wait() const noexcept;

   private:
    Lanes& lanes_;
    std::size_t first_, count_;
    int exceptions_ = std::uncaught_exceptions();
  };
  /// The first free lane that no other call waits for; waits where there is none.
  Held any();
  Held one(std::size_t lane) { return take(lane, 1); }
  Held together() { return take(0, kTogether); }
  Held all() { return take(0, kLanes); }

  /// Waits for all work, then returns memory without a use to the driver.
  void trim();
  /// Without holding the lane: only for what never changes or is thread-safe, as its memory.
  const Exec& exec(std::size_t lane) const { return *execs_[lane]; }

 private:
  Held take(std::size_t first, std::size_t count);
  void release(std::size_t first, std::size_t count);

  std::shared_ptr<Uploader> uploader_ = std::make_shared<Uploader>();
  std::array<std::unique_ptr<Exec>, kLanes> execs_;
  std::mutex mutex_;
  std::condition_variable freed_;
  std::array<bool, kLanes> busy_{};
  std::array<std::size_t, kLanes> wanted_{};  ///< calls that wait for this lane in particular
};

/// Waits for the work of lanes where an exception leaves the scope, before what was made earlier in
/// the scope is destroyed.
class WaitOnFailure {
 public:
  explicit WaitOnFailure(const Lanes::Held& held) : held_(held) {}
  ~WaitOnFailure() {
    if (std::uncaught_exceptions() > exceptions_) held_.wait();
  }
  WaitOnFailure(const WaitOnFailure&) = delete;
  WaitOnFailure& operator=(const WaitOnFailure&) = delete;

 private:
  const Lanes::Held& held_;
  int exceptions_ = std::uncaught_exceptions();
};

}  // namespace gpureg::cuda
