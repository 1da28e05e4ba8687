// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/plan_matcher.hpp"

#include <algorithm>

#include "common/for_each_on.hpp"

namespace gpureg::cuda {
namespace {

using plan::Place, plan::Scan, plan::Wall;

/// Every so many headings are counted first: few cells of the others are above what they leave.
constexpr std::int32_t kCountedFirst = 8;

/// Scans with their walls on the device.
struct ScansOnDevice {
  DeviceBuffer<Wall> walls;
  DeviceBuffer<Scan> scans;

  ScansOnDevice(Exec& exec, Span<const Scan> from) {
    std::vector<Wall> all;
    for (const Scan& scan : from) {
      all.insert(all.end(), scan.coarse_walls.begin(), scan.coarse_walls.end());
      all.insert(all.end(), scan.walls.begin(), scan.walls.end());
    }
    walls = exec.upload(all);
    std::vector<Scan> moved(from.begin(), from.end());
    const Wall* next = walls.data();
    for (Scan& scan : moved) {
      scan.coarse_walls.data = next;
      scan.walls.data = next += scan.coarse_walls.size;
      next += scan.walls.size;
    }
    scans = exec.upload(moved);
  }
};

}  // namespace

CudaPlan::CudaPlan(Lanes& lanes, const plan::Map& map) : lanes_(lanes), map_(map) {
  const Lanes::Held held = lanes_.any();
  Exec& exec = held.exec();
  const DeviceScope scope(exec.device());
  exec.begin();
  coarse_ = exec.upload(map.coarse, static_cast<std::size_t>(plan::kPlanes) *
                                        static_cast<std::size_t>(map.coarse_rows) *
                                        static_cast<std::size_t>(map.coarse_words));
  walls_ = exec.upload(map.walls,
                       static_cast<std::size_t>(map.rows) * static_cast<std::size_t>(map.stride));
  map_.coarse = coarse_.data();
  map_.walls = walls_.data();
  exec.synchronize();
}

std::vector<std::vector<Place>> CudaPlan::best_cells(Span<const Scan> scans, std::size_t most) {
  std::vector<std::vector<Place>> out(scans.size);
  std::vector<HeadingTask> first, rest;
  std::size_t most_words = 0;
  for (std::uint32_t s = 0; s < scans.size; ++s) {
    const Scan& scan = scans[s];
    const std::int32_t columns = scan.high[0] - scan.low[0], rows = scan.high[1] - scan.low[1];
    if (columns <= 0 || rows <= 0) continue;
    most_words = std::max(
        most_words, static_cast<std::size_t>((columns + 31) / 32) * static_cast<std::size_t>(rows));
    for (std::int32_t h = 0; h < scan.headings; ++h)
      (h % kCountedFirst == 0 ? first : rest).push_back({s, h});
  }
  if (first.empty()) return out;
  const Lanes::Held held = lanes_.any();
  Exec& exec = held.exec();
  const DeviceScope scope(exec.device());
  exec.begin();
  const ScansOnDevice on_device(exec, scans);
  const std::size_t counted_first = first.size();
  first.insert(first.end(), rest.begin(), rest.end());
  const auto tasks = exec.upload(first);
  const auto least = exec.upload(std::vector<std::int32_t>(scans.size, 1));
  const auto counts = exec.filled<unsigned long long>(kScores * scans.size, 0);
  const auto found = exec.filled<std::uint32_t>(scans.size, 0);
  const auto cells = exec.buffer<CellKey>(most * scans.size);
  count_cells(exec, map_, on_device.scans.data(), most_words, tasks.data(), counted_first,
              least.data(), counts.data());
  raise_least(exec, counts.data(), scans.size, most, least.data());
  count_cells(exec, map_, on_device.scans.data(), most_words, tasks.data() + counted_first,
              rest.size(), least.data(), counts.data());
  raise_least(exec, counts.data(), scans.size, most, least.data());
  list_cells(exec, map_, on_device.scans.data(), most_words, tasks.data(), first.size(),
             least.data(), most, found.data(), cells.data());
  const std::uint32_t* sizes = exec.download(found.data(), scans.size);
  exec.synchronize();
  std::vector<const CellKey*> keys;
  for (std::size_t s = 0; s < scans.size; ++s)
    keys.push_back(exec.download(cells.data() + most * s, sizes[s]));
  exec.synchronize();
  for_each_on(exec.host_threads(), scans.size, [&](std::size_t s) {
    std::vector<CellKey> sorted(keys[s], keys[s] + sizes[s]);
    std::sort(sorted.begin(), sorted.end());
    for (const CellKey key : sorted) out[s].push_back(place_of(key));
  });
  return out;
}

std::vector<std::vector<Place>> CudaPlan::refine(Span<const Scan> scans,
                                                 const std::vector<std::vector<Place>>& coarse) {
  std::vector<std::vector<Place>> out(scans.size);
  std::vector<RefineTask> tasks;
  for (std::uint32_t s = 0; s < scans.size; ++s)
    for (const Place& place : coarse[s]) tasks.push_back({s, place});
  if (tasks.empty()) return out;
  const Lanes::Held held = lanes_.any();
  Exec& exec = held.exec();
  const DeviceScope scope(exec.device());
  exec.begin();
  const ScansOnDevice on_device(exec, scans);
  const auto to_do = exec.upload(tasks);
  const auto refined = exec.buffer<Place>(tasks.size());
  refine_places(exec, map_, on_device.scans.data(), to_do.data(), tasks.size(), refined.data());
  const Place* places = exec.download(refined.data(), tasks.size());
  exec.synchronize();
  for (std::size_t s = 0; s < scans.size; ++s) {
    out[s].assign(places, places + coarse[s].size());
    places += coarse[s].size();
  }
  return out;
}

}  // namespace gpureg::cuda
