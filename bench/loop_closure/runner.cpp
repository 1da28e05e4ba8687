// SPDX-License-Identifier: BSD-3-Clause
// Verification of loops: runner SEQUENCE SCENE writes one JSON object a line. run.py calls it.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <string>

#include "gpureg/loop_closure.hpp"
#include "sequence.hpp"

namespace gpureg::bench {
namespace {

using loop_closure::LoopCloser;
using loop_closure::LoopState;
using pose_graph::UnalignedMatrix6d;

/// KISS-SLAM accepts a loop from this overlap on, with the identity as information and no kernel.
constexpr double kKissOverlap = 0.4;
/// True loops of a trial: about one a fragment, or all that the sequence has.
constexpr std::size_t kFew = 60, kAll = 1000000;

struct Outcome {
  std::vector<char> accepted;
  std::vector<UnalignedIsometry3d> poses;
};

std::size_t at(int k) { return static_cast<std::size_t>(k); }

UnalignedIsometry3d step(const std::vector<UnalignedIsometry3d>& poses, int k) {
  return poses[at(k - 1)].inverse() * poses[at(k)];
}

/// As LoopSmart weighs odometry: by the correspondences of consecutive fragments.
std::map<int, UnalignedMatrix6d> correspondence_covariances(const Sequence& sequence) {
  std::map<int, UnalignedMatrix6d> out;
  for (const RegisteredPair& pair : sequence.pairs) {
    if (pair.source != pair.target + 1 || pair.result.source_moments.count == 0) continue;
    const Eigen::Matrix<double, 6, 6> information = pair.result.source_moments.information_open3d();
    out[pair.source] = information.inverse();
  }
  return out;
}

Outcome by_closer(const Sequence& sequence, const std::vector<UnalignedIsometry3d>& odometry,
                  const std::vector<Trial>& loops, const loop_closure::Options& options) {
  LoopCloser closer(Context::cpu(1), options);
  const bool weigh = options.information_from_correspondences;
  const auto covariances =
      weigh ? correspondence_covariances(sequence) : std::map<int, UnalignedMatrix6d>{};
  for (int k = 0; k < static_cast<int>(odometry.size()); ++k) {
    closer.add({k, 0, double(k), {}, odometry[at(k)]});
    if (k == 0) continue;
    const auto found = covariances.find(k);
    std::optional<UnalignedMatrix6d> covariance;
    if (found != covariances.end())
      covariance = UnalignedMatrix6d(0.5 * (found->second + found->second.transpose()));
    closer.add_odometry(k, k - 1, step(odometry, k), covariance);
  }
  for (const Trial& loop : loops) closer.add_result(loop.source, loop.target, loop.result);
  closer.process();
  Outcome out;
  for (const loop_closure::Loop& loop : closer.loops())
    out.accepted.push_back(loop.state == LoopState::accepted);
  for (const loop_closure::FragmentPose& pose : closer.poses())
    out.poses.push_back(pose.world_from_fragment);
  return out;
}

/// Least squares over the loops that `accept` names. identity: every information is the identity.
Outcome by_least_squares(const std::vector<UnalignedIsometry3d>& odometry,
                         const std::vector<Trial>& loops, bool kiss) {
  pose_graph::Graph graph;
  std::optional<UnalignedMatrix6d> information;
  if (kiss) information = UnalignedMatrix6d::Identity();
  for (int k = 0; k < static_cast<int>(odometry.size()); ++k) {
    graph.nodes.push_back({k, odometry[at(k)], false});
    if (k > 0)
      graph.edges.push_back(
          {k, k - 1, step(odometry, k), information, pose_graph::EdgeKind::odometry, 0.5, {}});
  }
  Outcome out;
  for (const Trial& loop : loops) {
    out.accepted.push_back(!kiss || loop.overlap > kKissOverlap);
    if (out.accepted.back())
      graph.edges.push_back({loop.source,
                             loop.target,
                             loop.result.target_from_source,
                             information,
                             pose_graph::EdgeKind::loop,
                             0.5,
                             {}});
  }
  pose_graph::Options options;
  options.robust = pose_graph::Robust::none;
  options.threads = 1;
  out.poses = pose_graph::optimize(graph, options).world_from_node;
  return out;
}

struct Setting {
  double metres = 0;
  bool shuffled = false;
  double false_share = 0;
  std::size_t most = kFew;
};

void run(const Sequence& sequence, const std::string& scene, const Setting& setting,
         std::uint64_t seed) {
  const SimulatedOdometry simulated = drifted(sequence, setting.metres, seed);
  const std::vector<UnalignedIsometry3d>& odometry = simulated.poses;
  const std::vector<Trial> loops =
      trials(sequence, setting.most, setting.false_share, setting.shuffled, seed);
  if (loops.empty()) return;
  loop_closure::Options options;
  options.graph.threads = 1;
  // A host that knows how bad its odometry is, as SimulatedOdometry::per_metre says.
  loop_closure::Options stated = options;
  stated.graph.drift.translation_per_metre = simulated.per_metre;
  stated.graph.drift.rotation_per_metre = 10 * simulated.per_metre;
  loop_closure::Options paper = loop_closure::Options::loopsmart();
  paper.graph.threads = 1;
  std::vector<Trial> good;
  for (const Trial& loop : loops)
    if (loop.is_true) good.push_back(loop);
  std::map<std::string, Outcome> outcomes = {
      {"default", by_closer(sequence, odometry, loops, options)},
      {"drift_stated", by_closer(sequence, odometry, loops, stated)},
      {"loopsmart", by_closer(sequence, odometry, loops, paper)},
      {"kiss_slam_rule", by_least_squares(odometry, loops, true)},
      {"none", by_least_squares(odometry, loops, false)}};
  // What perfect verification would leave to the graph.
  const double oracle = rmse(sequence.truth, by_closer(sequence, odometry, good, options).poses);
  for (const auto& [name, outcome] : outcomes) {
    int kept = 0, wrong = 0;
    for (std::size_t k = 0; k < loops.size(); ++k) {
      kept += loops[k].is_true && outcome.accepted[k];
      wrong += !loops[k].is_true && outcome.accepted[k];
    }
    std::printf(
        "{\"scene\": \"%s\", \"loops\": \"%s\", \"drift\": %g, \"confidences\": \"%s\", "
        "\"false_share\": %g, \"seed\": %d, \"method\": \"%s\", \"true_loops\": %d, "
        "\"false_loops\": %d, \"accepted_true\": %d, \"accepted_false\": %d, \"rmse\": %.4f, "
        "\"rmse_true_loops\": %.4f, \"odometry_rmse\": %.4f, \"per_metre\": %.4f, "
        "\"revisit\": [%d, %d]}\n",
        scene.c_str(), setting.most == kFew ? "60" : "all", setting.metres,
        setting.shuffled ? "shuffled" : "registered", setting.false_share, static_cast<int>(seed),
        name.c_str(), static_cast<int>(good.size()), static_cast<int>(loops.size() - good.size()),
        kept, wrong, rmse(sequence.truth, outcome.poses), oracle, rmse(sequence.truth, odometry),
        simulated.per_metre, sequence.revisit_source, sequence.revisit_target);
  }
}

void run(const std::string& path, const std::string& scene) {
  const Sequence sequence = read_sequence(path);
  for (const double metres : {0.2, 0.5, 2.0})
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      for (const bool shuffled : {false, true})
        for (int tenths = 0; tenths <= 9; ++tenths)
          run(sequence, scene, {metres, shuffled, 0.1 * tenths, kFew}, seed);
      run(sequence, scene, {metres, false, 0.5, kAll}, seed);
    }
}

}  // namespace
}  // namespace gpureg::bench

int main(int count, char** arguments) {
  if (count != 3) {
    std::fprintf(stderr, "usage: %s SEQUENCE SCENE\n", arguments[0]);
    return 2;
  }
  try {
    gpureg::bench::run(arguments[1], arguments[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
