// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace gpureg::cli {

/// While it lives, SIGINT and SIGTERM are noted instead of ending the process; a second one ends it
/// at once.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  static bool requested();  ///< thread-safe
};

}  // namespace gpureg::cli
