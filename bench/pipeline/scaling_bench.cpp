// SPDX-License-Identifier: BSD-3-Clause
// Cost as the work grows: points per cloud, raw points, fragments.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "fragments.hpp"

namespace gpureg::bench {
namespace {

using Points = std::vector<Eigen::Vector3f>;

/// A hall of 12 x 5 x 3 m with boxes in it, of which a scan sees a window along x: two scans of
/// different windows overlap in part.
class Hall {
 public:
  Hall() {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> unit;
    add({0, 0, 0}, {12, 0, 0}, {0, 5, 0});
    add({0, 0, 0}, {12, 0, 0}, {0, 0, 3});
    add({0, 5, 0}, {12, 0, 0}, {0, 0, 3});
    for (int k = 0; k < 60; ++k) {
      const float turn = 3 * unit(random);
      const Eigen::Vector3f corner(11 * unit(random), 4 * unit(random),
                                   unit(random) < 0.7f ? 0 : unit(random));
      const Eigen::Vector3f x =
          Eigen::Vector3f(std::cos(turn), std::sin(turn), 0) * (0.2f + 0.8f * unit(random));
      const Eigen::Vector3f y =
          Eigen::Vector3f(-std::sin(turn), std::cos(turn), 0) * (0.2f + 0.6f * unit(random));
      const Eigen::Vector3f z(0, 0, 0.2f + 1.2f * unit(random));
      add(corner, x, z);
      add(corner + y, x, z);
      add(corner, y, z);
      add(corner + x, y, z);
      add(corner + z, x, y);
    }
  }
  Points scan(std::size_t size, float from, std::uint32_t seed) const {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit;
    std::normal_distribution<float> noise(0, 0.002f);
    const Eigen::AngleAxisf turn(
        6 * unit(random),
        Eigen::Vector3f(unit(random), unit(random), unit(random) + 0.1f).normalized());
    Points out;
    while (out.size() < size) {
      const auto& s =
          surfaces_[std::lower_bound(area_.begin(), area_.end(), unit(random) * area_.back()) -
                    area_.begin()];
      const Eigen::Vector3f p = s[0] + unit(random) * s[1] + unit(random) * s[2];
      if (p.x() < from || p.x() > from + 5) continue;
      out.push_back(turn * (p + Eigen::Vector3f(noise(random), noise(random), noise(random))));
    }
    return out;
  }
  /// Of what a scan sees, about.
  float area() const { return area_.back() * 5 / 12; }

 private:
  void add(Eigen::Vector3f corner, Eigen::Vector3f a, Eigen::Vector3f b) {
    surfaces_.push_back({corner, a, b});
    area_.push_back((area_.empty() ? 0 : area_.back()) + a.cross(b).norm());
  }
  std::vector<std::array<Eigen::Vector3f, 3>> surfaces_;
  std::vector<float> area_;
};

/// A voxel at which such a scan keeps about so many points: a plane through a lattice meets more
/// voxels than its area has squares.
float voxel_for(const Hall& hall, std::int64_t points) {
  return std::sqrt(1.3f * hall.area() / static_cast<float>(points));
}

std::vector<Points> scans(const Hall& hall, std::size_t count, std::size_t raw_points) {
  std::vector<Points> out;
  for (std::uint32_t k = 0; k < count; ++k)
    out.push_back(hall.scan(raw_points, 0.6f * static_cast<float>(k), 100 + k));
  return out;
}

std::vector<PointCloudView> views_of(const std::vector<Points>& scans) {
  std::vector<PointCloudView> out;
  for (const Points& scan : scans) out.emplace_back(scan);
  return out;
}

/// The scene gets finer, everything else stays: radii follow the voxel, so a point keeps its number
/// of neighbours.
void points_per_cloud(benchmark::State& state) {
  const Context* on = context(state, "cuda");
  if (!on) return;
  const Hall hall;
  const auto raw = scans(hall, 8, static_cast<std::size_t>(state.range(0)) * 10);
  const RegistrationOptions options =
      RegistrationOptions::loopsmart(voxel_for(hall, state.range(0)));
  const auto clouds = prepare_batch(*on, views_of(raw), options);
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < clouds.size(); ++i)
    for (std::uint32_t j = i + 1; j < clouds.size(); ++j) pairs.push_back({j, i});
  auto results = align_batch(*on, clouds, pairs, options);
  for (auto _ : state) results = align_batch(*on, clouds, pairs, options);
  report(state, results, static_cast<std::size_t>(state.iterations()));
}

/// Two scans by the default options, alone on a device: what one pair takes of its time and of its
/// memory as the scans get finer.
void pair_by_default(benchmark::State& state) {
  if (!context(state, "cuda")) return;
  const Hall hall;
  const auto raw = scans(hall, 2, static_cast<std::size_t>(state.range(0)) * 10);
  const RegistrationOptions options = RegistrationOptions{voxel_for(hall, state.range(0))};
  // A new context: memory reserved by other benchmarks would hide the use of this one.
  const Context on = new_context("cuda");
  const auto clouds = prepare_batch(on, views_of(raw), options);
  std::vector<RegistrationResult> results{align(on, clouds[1], clouds[0], options)};
  for (auto _ : state) results.front() = align(on, clouds[1], clouds[0], options);
  report(state, results, static_cast<std::size_t>(state.iterations()));
  report_memory(state, on);
}

void raw_points(benchmark::State& state) {
  const Context* on = context(state, "cuda");
  if (!on) return;
  const Hall hall;
  const auto raw = scans(hall, 4, static_cast<std::size_t>(state.range(0)));
  const RegistrationOptions options = RegistrationOptions::loopsmart();
  auto clouds = prepare_batch(*on, views_of(raw), options);
  for (auto _ : state) clouds = prepare_batch(*on, views_of(raw), options);
  state.counters["points"] = static_cast<double>(clouds[0].size());
  state.counters["ms_per_fragment"] = benchmark::Counter(
      4e-3, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// From raw points in host memory, each fragment with the four that follow it: prepared and
/// aligned. The scene's fragments come round again.
void many_fragments(benchmark::State& state) {
  const Context* on = context(state, "cuda");
  if (!on) return;
  const RegistrationOptions options = RegistrationOptions::loopsmart();
  const auto scene = views();
  std::vector<PointCloudView> raw;
  std::vector<Pair> pairs;
  const auto count = static_cast<std::uint32_t>(state.range(0));
  for (std::uint32_t k = 0; k < count; ++k) {
    raw.push_back(scene[k % scene.size()]);
    for (std::uint32_t step = 1; step <= 4; ++step) pairs.push_back({k, (k + step) % count});
  }
  std::vector<RegistrationResult> results;
  for (auto _ : state) results = align_batch(*on, prepare_batch(*on, raw, options), pairs, options);
  state.counters["fragments"] = count;
  state.counters["pairs"] = static_cast<double>(pairs.size());
  state.counters["ms_per_fragment"] = benchmark::Counter(
      1e-3 * count, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  report_memory(state, *on);
}

BENCHMARK(points_per_cloud)->Arg(1000)->Arg(5000)->Arg(20000)->Arg(100000)->Apply(elapsed);
BENCHMARK(pair_by_default)->Arg(1000)->Arg(5000)->Arg(20000)->Arg(100000)->Apply(elapsed);
BENCHMARK(raw_points)->Arg(100000)->Arg(300000)->Arg(1000000)->Apply(elapsed);
BENCHMARK(many_fragments)
    ->Arg(10)
    ->Arg(50)
    ->Arg(200)
    ->Arg(500)
    ->Arg(2000)
    ->Arg(10000)
    ->Iterations(1)
    ->Apply(elapsed);

}  // namespace
}  // namespace gpureg::bench
