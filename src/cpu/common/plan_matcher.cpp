// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/common/plan_matcher.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>

#include "math/trigonometry.hpp"

namespace gpureg::cpu {
namespace {

/// 256 cells, and a row of the cells around a place; the compiler splits them where the processor
/// has shorter registers.
typedef std::uint64_t Cells __attribute__((vector_size(32)));
constexpr std::int32_t kCellsAtOnce = 256;
typedef std::int16_t RowOfCells __attribute__((vector_size(16), aligned(2), may_alias));
static_assert(plan::kEdge <= 8, "a row fits into a register");

/// Bytes behind the planes that a read of Cells may touch.
constexpr std::size_t kBehind = 64;

bool precedes(const plan::Place& a, const plan::Place& b) {
  if (a.score != b.score) return a.score > b.score;
  if (a.heading != b.heading) return a.heading < b.heading;
  return a.y != b.y ? a.y < b.y : a.x < b.x;
}

/// The best cells of a scan, of all its headings. Thread-safe.
class BestCells {
 public:
  using Counts = std::array<std::uint64_t, 1 << plan::kScoreBits>;
  explicit BestCells(std::size_t most) : most_(most) {}

  /// Cells with lower scores are not among them.
  std::int32_t least() const { return least_; }
  void add(const std::vector<plan::Place>& places, const Counts& counts, std::int32_t least) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t s = 0; s < counts.size(); ++s) counts_[s] += counts[s];
    least_ = std::max({least_.load(), least, plan::least_score(counts_.data(), most_)});
    places_.insert(places_.end(), places.begin(), places.end());
    if (places_.size() > 8 * most_) leave_out();
  }
  std::vector<plan::Place> take() {
    leave_out();
    std::sort(places_.begin(), places_.end(), precedes);
    return std::move(places_);
  }

 private:
  void leave_out() {
    places_.erase(std::remove_if(places_.begin(), places_.end(),
                                 [&](const plan::Place& p) { return p.score < least_; }),
                  places_.end());
  }

  std::size_t most_;
  std::mutex mutex_;
  std::atomic<std::int32_t> least_{1};
  Counts counts_{};
  std::vector<plan::Place> places_;
};

/// Sums of the bits of 256 cells; walls: where the bit of each wall is, in eights.
plan::Scores<Cells> scores_of(const std::vector<const std::uint8_t*>& walls, std::ptrdiff_t at) {
  plan::Scores<Cells> scores{};
  for (std::size_t k = 0; k < walls.size(); k += 8) {
    Cells bits[8];
    for (std::size_t i = 0; i < 8; ++i) std::memcpy(&bits[i], walls[k + i] + at, sizeof(Cells));
    plan::add_eight(bits, scores);
  }
  return scores;
}

/// The best cells of one heading; those of other headings may leave only few of them.
class HeadingSearch {
 public:
  HeadingSearch(const plan::Scan& scan, std::int32_t heading, std::size_t most, std::int32_t least)
      : scan_(scan), heading_(heading), most_(most), least_(least) {}

  /// walls: of the first cell of the scan's box; stride: bytes of a row.
  void run(const std::vector<const std::uint8_t*>& walls, std::ptrdiff_t stride) {
    for (std::int32_t y = scan_.low[1]; y < scan_.high[1]; ++y)
      for (std::int32_t x = scan_.low[0]; x < scan_.high[0]; x += kCellsAtOnce)
        keep(scores_of(walls, (y - scan_.low[1]) * stride + (x - scan_.low[0]) / 8), x, y);
  }
  void add_to(BestCells& best) const { best.add(places_, counts_, least_); }

 private:
  void keep(const plan::Scores<Cells>& scores, std::int32_t x, std::int32_t y) {
    const Cells good = plan::at_least(scores, static_cast<std::uint32_t>(least_));
    for (std::int32_t lane = 0; lane < 4; ++lane)
      for (std::uint64_t left = good[lane]; left != 0; left &= left - 1) {
        const int bit = __builtin_ctzll(left);
        const std::int32_t column = x + 64 * lane + bit;
        if (column >= scan_.high[0]) break;
        std::uint32_t score = 0;
        for (int b = 0; b < plan::kScoreBits; ++b)
          score |= static_cast<std::uint32_t>(scores.bits[b][lane] >> bit & 1) << b;
        ++counts_[score];
        places_.push_back({static_cast<std::int32_t>(score), column, y, heading_});
      }
    if (places_.size() <= 4 * most_) return;
    least_ = std::max(least_, plan::least_score(counts_.data(), most_));
    places_.erase(std::remove_if(places_.begin(), places_.end(),
                                 [&](const plan::Place& p) { return p.score < least_; }),
                  places_.end());
  }

  const plan::Scan& scan_;
  std::int32_t heading_;
  std::size_t most_;
  std::int32_t least_;
  BestCells::Counts counts_{};
  std::vector<plan::Place> places_;
};

plan::Place refine_place(const plan::Map& map, const plan::Scan& scan, const plan::Place& coarse) {
  plan::Place best{-1, 0, 0, 0};
  for (std::int32_t turn = -plan::kTurnsAround; turn <= plan::kTurnsAround; ++turn) {
    const std::int32_t heading = 2 * coarse.heading + turn;
    const plan::Heading at = plan::heading_of(heading, 2 * scan.headings);
    const std::uint16_t* first =
        map.walls + (map.margin + 2 * coarse.y - plan::kAround) * std::ptrdiff_t{map.stride} +
        map.margin + 2 * coarse.x - plan::kAround;
    RowOfCells scores[plan::kEdge] = {};
    for (const plan::Wall& wall : scan.walls) {
      const plan::Turned cell = plan::turned(wall, at);
      const auto faces =
          static_cast<std::int16_t>(plan::facing_bits(cell.direction, scan.has_sides));
      const RowOfCells bits = {faces, faces, faces, faces, faces, faces, faces, faces};
      const std::uint16_t* row = first + cell.dy * std::ptrdiff_t{map.stride} + cell.dx;
      for (int v = 0; v < plan::kEdge; ++v, row += map.stride)
        scores[v] -= (*reinterpret_cast<const RowOfCells*>(row) & bits) != 0;
    }
    for (std::int32_t v = 0; v < plan::kEdge; ++v)
      for (std::int32_t u = 0; u < plan::kEdge; ++u)
        if (scores[v][u] > best.score)
          best = {scores[v][u], 2 * coarse.x + u - plan::kAround, 2 * coarse.y + v - plan::kAround,
                  heading};
  }
  return best;
}

}  // namespace

CpuPlan::CpuPlan(Exec& exec, std::mutex& mutex, const plan::Map& map)
    : exec_(exec), mutex_(mutex), map_(map) {
  const std::size_t words = static_cast<std::size_t>(plan::kPlanes) *
                            static_cast<std::size_t>(map.coarse_rows) *
                            static_cast<std::size_t>(map.coarse_words);
  bytes_ = 4 * words + kBehind;
  shifted_.assign(8 * bytes_, 0);
  for (std::size_t shift = 0; shift < 8; ++shift)
    for (std::size_t k = 0; k < words; ++k) {
      const std::uint64_t two =
          map.coarse[k] | (k + 1 < words ? std::uint64_t{map.coarse[k + 1]} << 32 : 0);
      const auto word = static_cast<std::uint32_t>(two >> shift);
      std::memcpy(shifted_.data() + shift * bytes_ + 4 * k, &word, 4);
    }
}

std::vector<std::vector<plan::Place>> CpuPlan::best_cells(Span<const plan::Scan> scans,
                                                          std::size_t most) {
  const std::lock_guard<std::mutex> lock(mutex_);
  struct Task {
    std::size_t scan;
    std::int32_t heading;
  };
  std::vector<Task> tasks;
  std::vector<std::unique_ptr<BestCells>> best;
  for (std::size_t s = 0; s < scans.size; ++s) {
    best.push_back(std::make_unique<BestCells>(most));
    for (std::int32_t h = 0; h < scans[s].headings; ++h) tasks.push_back({s, h});
  }
  const std::ptrdiff_t stride = 4 * std::ptrdiff_t{map_.coarse_words};
  const std::vector<std::uint8_t> nothing(
      static_cast<std::size_t>(stride) * static_cast<std::size_t>(map_.coarse_rows) + kBehind, 0);
  exec_.parallel(tasks.size(), [&](std::size_t k) {
    const plan::Scan& scan = scans[tasks[k].scan];
    const plan::Heading heading = plan::heading_of(tasks[k].heading, scan.headings);
    std::vector<const std::uint8_t*> walls;
    for (const plan::Wall& wall : scan.coarse_walls) {
      const std::int64_t bit = plan::bit_of(map_, plan::turned(wall, heading), scan.has_sides) +
                               scan.low[0] + std::int64_t{scan.low[1]} * map_.coarse_words * 32;
      walls.push_back(shifted_.data() + static_cast<std::size_t>(bit % 8) * bytes_ + bit / 8);
    }
    while (walls.size() % 8 != 0) walls.push_back(nothing.data());
    HeadingSearch search(scan, tasks[k].heading, most, best[tasks[k].scan]->least());
    search.run(walls, stride);
    search.add_to(*best[tasks[k].scan]);
  });
  std::vector<std::vector<plan::Place>> out(scans.size);
  exec_.parallel(scans.size, [&](std::size_t s) { out[s] = best[s]->take(); });
  return out;
}

std::vector<std::vector<plan::Place>> CpuPlan::refine(
    Span<const plan::Scan> scans, const std::vector<std::vector<plan::Place>>& coarse) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::vector<plan::Place>> out(scans.size);
  for (std::size_t s = 0; s < scans.size; ++s) out[s].resize(coarse[s].size());
  constexpr std::size_t kGrain = 16;
  exec_.parallel_items(
      scans.size, [&](std::size_t s) { return coarse[s].size(); }, kGrain,
      [&](std::size_t s, std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
          out[s][k] = refine_place(map_, scans[s], coarse[s][k]);
      });
  return out;
}

}  // namespace gpureg::cpu
