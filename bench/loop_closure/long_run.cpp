// SPDX-License-Identifier: BSD-3-Clause
// A run without an end: memory and time of process() while a window of fragments moves on.
//   gpureg_loop_closure_long_run FOLDER FRAGMENTS WINDOW VOXEL MILLISECONDS
// The fragments of FOLDER (cloud_bin_<i>.ply, poses.txt) are walked there and back again, each time
// prepared anew. One JSON object a line.
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "gpureg/loop_closure.hpp"

namespace gpureg::bench {
namespace {

using loop_closure::LoopCloser;

/// Error of odometry in each step: a turn in radians, and a factor on the way.
constexpr double kTurn = 0.002, kScale = 1.005;

double resident_mib() {
  std::ifstream status("/proc/self/statm");
  double total = 0, resident = 0;
  status >> total >> resident;
  return resident * 4096 / (1 << 20);
}

std::map<int, UnalignedIsometry3d> read_poses(const std::string& path) {
  std::ifstream file(path);
  std::map<int, UnalignedIsometry3d> out;
  for (int number = 0; file >> number;) {
    UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
    for (int cell = 0; cell < 16; ++cell) file >> pose.matrix()(cell / 4, cell % 4);
    // Written with few digits.
    pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
    out[number] = pose;
  }
  if (out.empty()) throw IoError(path + " has no poses");
  return out;
}

struct Stop {
  PointCloud cloud;
  UnalignedIsometry3d world_from_fragment;
};

std::vector<Stop> read_stops(const std::string& folder) {
  const auto poses = read_poses(folder + "/poses.txt");
  std::vector<Stop> stops;
  for (const io::ScanFile& scan : io::list_scans(folder))
    stops.push_back({io::read_point_cloud(scan.path), poses.at(scan.number)});
  if (stops.size() < 2) throw IoError(folder + " has fewer than two fragments");
  return stops;
}

/// There and back: 0, 1, ..., n - 1, n - 2, ..., 1, 0, 1, ...
std::size_t stop_of(std::size_t k, std::size_t stops) {
  const std::size_t lap = k % (2 * (stops - 1));
  return lap < stops ? lap : 2 * (stops - 1) - lap;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

void run(const std::string& folder, std::size_t fragments, std::size_t window, float voxel,
         double milliseconds) {
  const std::vector<Stop> stops = read_stops(folder);
  const Context context = Context::best();
  loop_closure::Options options{RegistrationOptions{voxel}};
  options.chunk = 1;
  LoopCloser closer(context, options);
  UnalignedIsometry3d error = UnalignedIsometry3d::Identity();
  error.linear() = Eigen::AngleAxisd(kTurn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  UnalignedIsometry3d odometry = stops[0].world_from_fragment;
  std::vector<double> times;
  std::size_t registered = 0, left = 0;
  for (std::size_t k = 0; k < fragments; ++k) {
    const Stop& stop = stops[stop_of(k, stops.size())];
    const auto id = static_cast<loop_closure::FragmentId>(k);
    UnalignedIsometry3d step = UnalignedIsometry3d::Identity();
    if (k > 0) {
      step = stops[stop_of(k - 1, stops.size())].world_from_fragment.inverse() *
             stop.world_from_fragment * error;
      step.translation() *= kScale;
      odometry = odometry * step;
    }
    closer.add({id, 0, static_cast<double>(k),
                prepare(context, stop.cloud.view(), options.registration), odometry});
    if (k > 0) closer.add_odometry(id, id - 1, step);
    if (k >= window) closer.remove(id - static_cast<loop_closure::FragmentId>(window));
    const auto start = std::chrono::steady_clock::now();
    const loop_closure::Update update = closer.process(milliseconds);
    times.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
    registered += update.registered;
    left = update.proposals_left;
    if ((k + 1) % std::max<std::size_t>(1, fragments / 20) != 0 && k + 1 != fragments) continue;
    std::printf(
        "{\"fragments\": %zu, \"present\": %zu, \"loops\": %zu, \"edges\": %zu, \"registered\": "
        "%zu, \"proposals_left\": %zu, \"resident_mib\": %.1f, \"process_ms_median\": %.1f, "
        "\"process_ms_worst\": %.1f}\n",
        k + 1, closer.size(), closer.loops().size(), closer.graph().edges.size(), registered, left,
        resident_mib(), median(times), *std::max_element(times.begin(), times.end()));
    std::fflush(stdout);
    times.clear();
  }
}

}  // namespace
}  // namespace gpureg::bench

int main(int count, char** arguments) {
  if (count != 6) {
    std::fprintf(stderr, "usage: %s FOLDER FRAGMENTS WINDOW VOXEL MILLISECONDS\n", arguments[0]);
    return 2;
  }
  try {
    gpureg::bench::run(arguments[1], std::strtoul(arguments[2], nullptr, 10),
                       std::strtoul(arguments[3], nullptr, 10), std::strtof(arguments[4], nullptr),
                       std::strtod(arguments[5], nullptr));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
