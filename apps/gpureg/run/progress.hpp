// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace gpureg::cli {

/// Progress on stderr: a bar with rate and time left on a terminal, a plain line every few seconds
/// elsewhere.
class Progress {
 public:
  using Clock = std::chrono::steady_clock;

  /// unit: "pairs", "fragments". already_done: done by an earlier run, so it does not count for the
  /// rate.
  Progress(std::string label, std::string unit, std::size_t total, bool quiet,
           std::size_t already_done = 0);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(std::size_t done);
  double seconds() const;

 private:
  void print();

  std::string label_, unit_;
  std::size_t total_, first_, done_;
  bool quiet_, terminal_;
  Clock::time_point start_, printed_;
  std::size_t line_length_ = 0;
};

}  // namespace gpureg::cli
