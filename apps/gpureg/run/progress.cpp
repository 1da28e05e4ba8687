// SPDX-License-Identifier: BSD-3-Clause
#include "run/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <iostream>

#include "text.hpp"

namespace gpureg::cli {
namespace {

constexpr std::size_t kBarWidth = 28;
constexpr std::chrono::milliseconds kTerminalPeriod{100}, kLogPeriod{5000};

}  // namespace

Progress::Progress(std::string label, std::string unit, std::size_t total, bool quiet,
                   std::size_t already_done)
    : label_(std::move(label)),
      unit_(std::move(unit)),
      total_(total),
      first_(already_done),
      done_(already_done),
      quiet_(quiet),
      terminal_(::isatty(STDERR_FILENO) == 1),
      start_(Clock::now()),
      printed_(start_) {}

// The last state stays on the screen, so that an interrupted run shows how far it came.
Progress::~Progress() {
  if (quiet_ || !terminal_) return;
  print();
  std::cerr << std::endl;
}

void Progress::update(std::size_t done) {
  done_ = done;
  const Clock::time_point now = Clock::now();
  if (quiet_ || now - printed_ < (terminal_ ? kTerminalPeriod : kLogPeriod)) return;
  printed_ = now;
  print();
}

double Progress::seconds() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

void Progress::print() {
  const double elapsed = seconds();
  const double rate = elapsed > 0 ? static_cast<double>(done_ - first_) / elapsed : 0;
  std::string line = label_ + " ";
  if (terminal_) {
    const std::size_t filled = total_ ? kBarWidth * std::min(done_, total_) / total_ : kBarWidth;
    line += "[" + std::string(filled, '#') + std::string(kBarWidth - filled, '.') + "] ";
  }
  line += std::to_string(done_) + "/" + std::to_string(total_) + " " + unit_;
  if (rate > 0) {
    line += ", " + significant(rate, 3) + "/s";
    line += done_ < total_ ? ", " + duration(static_cast<double>(total_ - done_) / rate) + " left"
                           : ", took " + duration(elapsed);
  }
  if (!terminal_) {
    std::cerr << line << std::endl;
    return;
  }
  const std::size_t length = line.size();
  std::cerr << '\r' << pad_right(std::move(line), line_length_) << std::flush;
  line_length_ = length;
}

}  // namespace gpureg::cli
