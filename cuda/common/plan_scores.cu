// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "cuda/common/plan_matcher.hpp"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

using plan::kEdge, plan::kTurns, plan::Map, plan::Place, plan::Scan;

constexpr unsigned kThreads = 128;
/// Words of a block, at most: fewer would pay more for the walls of its heading.
constexpr unsigned kWordsPerBlock = 8 * kThreads;
/// Largest extent of a grid along y.
constexpr std::size_t kMaxTasksPerLaunch = 32768;
constexpr unsigned kRefineThreads = 256;
/// Walls whose cells are in shared memory at a time.
constexpr unsigned kWallsAtOnce = 256;
static_assert(kTurns * kEdge * kEdge <= kRefineThreads, "a thread for each cell and heading");

/// Where the bit of a wall is, for the first cell of a scan's box.
struct WallBit {
  std::int64_t word;
  std::uint32_t shift;
};

/// Calls keep(score, x, y) for the cells of a block whose scores are at least `least`.
template <typename Keep>
__device__ void score_cells(const Map& map, const Scan& scan, std::int32_t heading,
                            std::int32_t least, const Keep& keep) {
  __shared__ WallBit walls[plan::kCoarseWalls + 1];
  const auto wall_count = static_cast<unsigned>(scan.coarse_walls.size);
  const plan::Heading turn = plan::heading_of(heading, scan.headings);
  for (unsigned k = threadIdx.x; k < wall_count; k += kThreads) {
    const std::int64_t bit =
        plan::bit_of(map, plan::turned(scan.coarse_walls[k], turn), scan.has_sides) + scan.low[0] +
        std::int64_t{scan.low[1]} * map.coarse_words * 32;
    walls[k] = {bit / 32, static_cast<std::uint32_t>(bit % 32)};
  }
  __syncthreads();
  const std::int32_t columns = scan.high[0] - scan.low[0], rows = scan.high[1] - scan.low[1];
  const unsigned words = columns > 0 ? (static_cast<unsigned>(columns) + 31) / 32 : 0;
  const unsigned all = rows > 0 ? words * static_cast<unsigned>(rows) : 0;
  for (unsigned i = blockIdx.x * kThreads + threadIdx.x; i < all; i += gridDim.x * kThreads) {
    const unsigned y = i / words, x = i % words;
    const std::uint32_t* first = map.coarse + std::int64_t{y} * map.coarse_words + x;
    plan::Scores<std::uint32_t> scores{};
    for (unsigned k = 0; k < wall_count; k += 8) {
      std::uint32_t bits[8];
#pragma unroll
      for (unsigned j = 0; j < 8; ++j) {
        if (k + j < wall_count) {
          const std::uint32_t* word = first + walls[k + j].word;
          bits[j] = __funnelshift_r(word[0], word[1], walls[k + j].shift);
        } else {
          bits[j] = 0;
        }
      }
      plan::add_eight(bits, scores);
    }
    std::uint32_t good = plan::at_least(scores, static_cast<std::uint32_t>(least));
    const std::int32_t left = columns - static_cast<std::int32_t>(32 * x);
    if (left < 32) good &= (1u << left) - 1;
    for (; good != 0; good &= good - 1) {
      const int bit = __ffs(static_cast<int>(good)) - 1;
      std::uint32_t score = 0;
#pragma unroll
      for (int b = 0; b < plan::kScoreBits; ++b) score |= (scores.bits[b] >> bit & 1) << b;
      keep(score, scan.low[0] + static_cast<std::int32_t>(32 * x) + bit,
           scan.low[1] + static_cast<std::int32_t>(y));
    }
  }
}

__global__ void __launch_bounds__(kThreads)
    count(Map map, const Scan* scans, const HeadingTask* tasks, const std::int32_t* least,
          unsigned long long* counts) {
  __shared__ std::uint32_t of_block[kScores];
  for (unsigned k = threadIdx.x; k < kScores; k += kThreads) of_block[k] = 0;
  __syncthreads();
  const HeadingTask task = tasks[blockIdx.y];
  score_cells(
      map, scans[task.scan], task.heading, least[task.scan],
      [&](std::uint32_t score, std::int32_t, std::int32_t) { atomicAdd(of_block + score, 1u); });
  __syncthreads();
  for (unsigned k = threadIdx.x; k < kScores; k += kThreads)
    if (of_block[k] != 0) atomicAdd(counts + kScores * task.scan + k, of_block[k]);
}

__global__ void __launch_bounds__(kThreads)
    list(Map map, const Scan* scans, const HeadingTask* tasks, const std::int32_t* least,
         std::size_t most, std::uint32_t* found, CellKey* cells) {
  const HeadingTask task = tasks[blockIdx.y];
  score_cells(map, scans[task.scan], task.heading, least[task.scan],
              [&](std::uint32_t score, std::int32_t x, std::int32_t y) {
                const std::uint32_t place = atomicAdd(found + task.scan, 1u);
                cells[most * task.scan + place] =
                    key_of(Place{static_cast<std::int32_t>(score), x, y, task.heading});
              });
}

__global__ void raise(const unsigned long long* counts, std::size_t scans, std::size_t most,
                      std::int32_t* least) {
  const std::size_t k = blockIdx.x * blockDim.x + threadIdx.x;
  if (k >= scans) return;
  const std::int32_t found = plan::least_score(counts + kScores * k, most);
  if (found > least[k]) least[k] = found;
}

/// A block for each place, a thread for each cell and heading around it.
__global__ void __launch_bounds__(kRefineThreads)
    refine(Map map, const Scan* scans, const RefineTask* tasks, Place* refined) {
  struct WallCell {
    std::int64_t at;
    std::uint32_t faces;
  };
  __shared__ WallCell cells[kTurns][kWallsAtOnce];
  __shared__ unsigned best;
  const RefineTask task = tasks[blockIdx.x];
  const Scan scan = scans[task.scan];
  const unsigned thread = threadIdx.x, turn = thread / (kEdge * kEdge),
                 cell = thread % (kEdge * kEdge);
  const std::int32_t first_heading = 2 * task.coarse.heading - plan::kTurnsAround,
                     first_x = 2 * task.coarse.x - plan::kAround,
                     first_y = 2 * task.coarse.y - plan::kAround;
  if (thread == 0) best = 0;
  const std::int32_t u = static_cast<std::int32_t>(cell % kEdge),
                     v = static_cast<std::int32_t>(cell / kEdge);
  const std::uint16_t* here =
      map.walls + (map.margin + first_y + v) * std::int64_t{map.stride} + map.margin + first_x + u;
  unsigned score = 0;
  for (unsigned begin = 0; begin < scan.walls.size; begin += kWallsAtOnce) {
    const unsigned some = min(kWallsAtOnce, static_cast<unsigned>(scan.walls.size) - begin);
    __syncthreads();
    for (int t = 0; t < kTurns; ++t) {
      const plan::Heading heading = plan::heading_of(first_heading + t, 2 * scan.headings);
      for (unsigned k = thread; k < some; k += kRefineThreads) {
        const plan::Turned at = plan::turned(scan.walls[begin + k], heading);
        cells[t][k] = {at.dy * std::int64_t{map.stride} + at.dx,
                       plan::facing_bits(at.direction, scan.has_sides)};
      }
    }
    __syncthreads();
    if (turn < kTurns)
      for (unsigned k = 0; k < some; ++k)
        score += (here[cells[turn][k].at] & cells[turn][k].faces) != 0;
  }
  // The first of equal scores.
  if (turn < kTurns) atomicMax(&best, score << 16 | (0xffffu - thread));
  __syncthreads();
  if (thread != 0) return;
  const auto winner = static_cast<std::int32_t>(0xffffu - (best & 0xffffu));
  constexpr std::int32_t kCells = kEdge * kEdge;
  refined[blockIdx.x] = {static_cast<std::int32_t>(best >> 16), first_x + winner % kCells % kEdge,
                         first_y + winner % kCells / kEdge, first_heading + winner / kCells};
}

/// Calls launch(grid, tasks, count) for parts of the tasks.
template <typename Launch>
void in_parts(const HeadingTask* tasks, std::size_t count, std::size_t most_words,
              const Launch& launch) {
  const unsigned blocks = std::max(1u, blocks_for(most_words, kWordsPerBlock));
  for (std::size_t begin = 0; begin < count; begin += kMaxTasksPerLaunch)
    launch(dim3(blocks, static_cast<unsigned>(std::min(kMaxTasksPerLaunch, count - begin))),
           tasks + begin);
}

}  // namespace

void count_cells(Exec& exec, const Map& map, const Scan* scans, std::size_t most_words,
                 const HeadingTask* tasks, std::size_t size, const std::int32_t* least,
                 unsigned long long* counts) {
  in_parts(tasks, size, most_words, [&](dim3 grid, const HeadingTask* some) {
    launch(exec, "count_cells", count, {grid, kThreads}, map, scans, some, least, counts);
  });
}

void raise_least(Exec& exec, const unsigned long long* counts, std::size_t scans, std::size_t most,
                 std::int32_t* least) {
  launch(exec, "raise_least", raise, shape_for(scans, kThreads), counts, scans, most, least);
}

void list_cells(Exec& exec, const Map& map, const Scan* scans, std::size_t most_words,
                const HeadingTask* tasks, std::size_t size, const std::int32_t* least,
                std::size_t most, std::uint32_t* found, CellKey* cells) {
  in_parts(tasks, size, most_words, [&](dim3 grid, const HeadingTask* some) {
    launch(exec, "list_cells", list, {grid, kThreads}, map, scans, some, least, most, found, cells);
  });
}

void refine_places(Exec& exec, const Map& map, const Scan* scans, const RefineTask* tasks,
                   std::size_t count, Place* refined) {
  if (count == 0) return;
  launch(exec, "refine_places", refine, {static_cast<unsigned>(count), kRefineThreads}, map, scans,
         tasks, refined);
}

}  // namespace gpureg::cuda
