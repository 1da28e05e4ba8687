// SPDX-License-Identifier: BSD-3-Clause
#include "scene.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>

#include "gpureg/io.hpp"
#include "interrupt.hpp"
#include "progress.hpp"
#include "spacing.hpp"

namespace gpureg::cli {
namespace {

// One batch for prepare(): enough to fill a device, little beside the 1 GiB that a long run may
// take.
constexpr std::size_t kChunkClouds = 32, kChunkPoints = 4'000'000;

void mix(std::uint64_t& hash, const std::vector<Eigen::Vector3f>& rows) {
  const auto add = [&](std::uint64_t word) {
    hash = (hash ^ word) * 0x9E3779B97F4A7C15ull;
    hash ^= hash >> 32;
  };
  add(rows.size());
  for (const Eigen::Vector3f& row : rows) {
    std::uint32_t bits[3];
    std::memcpy(bits, row.data(), sizeof(bits));
    add(bits[0] | static_cast<std::uint64_t>(bits[1]) << 32);
    add(bits[2]);
  }
}

std::uint64_t hash_of(const PointCloud& cloud) {
  std::uint64_t hash = 0x67707572ull;
  mix(hash, cloud.points);
  mix(hash, cloud.normals);
  mix(hash, cloud.viewpoints);
  return hash;
}

}  // namespace

Scene prepare_scene(const Context& context, const std::string& folder,
                    const PrepareOptions& options, bool quiet) {
  const auto fragments = io::list_fragments(folder);
  std::map<int, std::vector<Eigen::Vector3f>> cameras;
  const std::string cameras_file = (std::filesystem::path(folder) / "cameras.txt").string();
  if (std::filesystem::exists(cameras_file)) cameras = io::read_cameras(cameras_file);

  Scene scene;
  Progress progress("preparing", "fragments", fragments.size(), quiet);
  for (std::size_t next = 0; next < fragments.size();) {
    if (InterruptGuard::requested()) {
      scene.interrupted = true;
      break;
    }
    std::vector<PointCloud> chunk;
    for (std::size_t points = 0;
         next < fragments.size() && chunk.size() < kChunkClouds && points < kChunkPoints; ++next) {
      const auto& [number, file] = fragments[next];
      chunk.push_back(io::read_point_cloud(file));
      if (const auto found = cameras.find(number); found != cameras.end())
        chunk.back().viewpoints = found->second;
      points += chunk.back().points.size();
      scene.numbers.push_back(number);
      scene.files.push_back(file);
      scene.hashes.push_back(hash_of(chunk.back()));
      scene.extent = std::max(scene.extent, extent_of(chunk.back().points));
    }
    std::vector<PointCloudView> views;
    for (const PointCloud& cloud : chunk) views.push_back(cloud.view());
    for (PreparedCloud& cloud : prepare_batch(context, views, options))
      scene.clouds.push_back(std::move(cloud));
    progress.update(next);
  }
  scene.seconds = progress.seconds();
  return scene;
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> choose_pairs(const Scene& scene,
                                                                  const std::string& pairs) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> chosen;
  const auto size = static_cast<std::uint32_t>(scene.numbers.size());
  if (pairs == "all") {
    for (std::uint32_t i = 0; i < size; ++i)
      for (std::uint32_t j = i + 1; j < size; ++j) chosen.emplace_back(i, j);
    return chosen;
  }
  const auto index_of = [&](int number) {
    const auto at = std::lower_bound(scene.numbers.begin(), scene.numbers.end(), number);
    if (at == scene.numbers.end() || *at != number)
      throw IoError(pairs + ": there is no fragment " + std::to_string(number));
    return static_cast<std::uint32_t>(at - scene.numbers.begin());
  };
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
  for (const auto& [a, b] : io::read_pairs(pairs)) {
    const std::uint32_t i = index_of(a), j = index_of(b);
    const std::pair<std::uint32_t, std::uint32_t> pair(std::min(i, j), std::max(i, j));
    if (seen.insert(pair).second) chosen.push_back(pair);
  }
  return chosen;
}

}  // namespace gpureg::cli
