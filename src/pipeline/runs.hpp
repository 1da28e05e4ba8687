// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

/// Cuts batches into runs of consecutive elements, by memory or among devices. No result depends on
/// the cuts.
namespace gpureg::pipeline {

/// Elements [begin, end) of a batch.
struct Run {
  std::size_t begin, end;
  std::size_t size() const { return end - begin; }
};

/// Runs whose weights add up to at most `limit` each; an element beyond the limit is a run of its
/// own.
template <typename Weight>
std::vector<Run> runs_within(std::size_t items, std::uint64_t limit, const Weight& weight) {
  std::vector<Run> out;
  std::uint64_t sum = 0;
  for (std::size_t k = 0; k < items; ++k) {
    const std::uint64_t more = weight(k);
    if (out.empty() || more > limit || sum > limit - more) {
      out.push_back({k, k});
      sum = 0;
    }
    sum += more;
    out.back().end = k + 1;
  }
  return out;
}

/// Distributes runs among takers: large ones first, small ones at the end, so that all finish
/// together. most: limit of memory, which goes before `least`, below which a taker has too little
/// to do.
class SharedRuns {
 public:
  SharedRuns(std::size_t items, std::size_t least, std::size_t most, std::size_t takers)
      : items_(items), most_(std::max<std::size_t>(1, most)), takers_(takers) {
    least_ = std::min(std::max<std::size_t>(1, least), most_);
  }

  /// The next elements; none where nothing is left.
  Run take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::size_t left = items_ - next_;
    const std::size_t size =
        std::min(left, std::max(least_, std::min(most_, left / (2 * takers_))));
    next_ += size;
    return {next_ - size, next_};
  }
  void stop() {
    const std::lock_guard<std::mutex> lock(mutex_);
    next_ = items_;
  }

 private:
  std::mutex mutex_;
  std::size_t next_ = 0, items_, least_, most_, takers_;
};

/// Bounds the raw points of a chunk of a preparation so that its prepared clouds fit a memory
/// budget. Their size per raw point depends on the downsampling: without any, as assumed for the
/// first chunk, it is that of a prepared point. Later chunks follow what the earlier ones took.
class RawPointBudget {
 public:
  /// Memory of a prepared point with default options: 1.1 to 1.3 KB on room-sized scans, and what
  /// depth maps of several viewpoints add.
  static constexpr std::size_t kBytesPerPreparedPoint = 1536;
  /// Later clouds may be sparser than the measured ones, so that fewer of their points merge.
  static constexpr std::size_t kMargin = 2;

  /// budget: bytes, 0: none. most: raw points of a chunk in any case.
  RawPointBudget(std::size_t budget, std::size_t most) : budget_(budget), most_(most) {}

  std::size_t most_points() const {
    return budget_ == 0 ? most_ : std::max<std::size_t>(1, std::min(most_, budget_ / per_point_));
  }
  /// Result of a chunk.
  void measured(std::size_t raw_points, std::size_t prepared_bytes) {
    if (raw_points == 0) return;
    largest_ = std::max(largest_, prepared_bytes / raw_points + 1);
    per_point_ = std::min(kBytesPerPreparedPoint, kMargin * largest_);
  }

 private:
  std::size_t budget_, most_, per_point_ = kBytesPerPreparedPoint, largest_ = 0;
};

}  // namespace gpureg::pipeline
