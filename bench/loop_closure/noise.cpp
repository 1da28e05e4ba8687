// SPDX-License-Identifier: BSD-3-Clause
// What the closer makes of odometry with independent noise: noise SEQUENCE SCENE SEEDS writes one
// JSON object a line. noise.py calls it.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "gpureg/loop_closure.hpp"
#include "sequence.hpp"

namespace gpureg::bench {
namespace {

using loop_closure::LoopCloser;
using loop_closure::LoopState;
using pose_graph::UnalignedMatrix6d;

std::size_t at(int k) { return static_cast<std::size_t>(k); }

struct Noise {
  double share = 0, degrees = 0;  ///< of a step: of its length, and its rotation
};

struct Outcome {
  double rmse = 0;
  int accepted = 0, wrong = 0;
};

/// One fragment after the other, as a SLAM system does.
Outcome by_closer(const Sequence& sequence, const std::vector<UnalignedIsometry3d>& odometry,
                  const Noise& noise, bool covariances) {
  loop_closure::Options options;
  options.graph.threads = 1;
  LoopCloser closer(Context::cpu(1), options);
  for (int k = 0; k < static_cast<int>(odometry.size()); ++k) {
    closer.add({k, 0, double(k), {}, odometry[at(k)]});
    if (k > 0) {
      const UnalignedIsometry3d step = odometry[at(k - 1)].inverse() * odometry[at(k)];
      std::optional<UnalignedMatrix6d> covariance;
      if (covariances) {
        const double turn = noise.degrees * M_PI / 180,
                     shift = std::max(1e-3, noise.share * step.translation().norm());
        UnalignedMatrix6d diagonal = UnalignedMatrix6d::Zero();
        diagonal.diagonal().head<3>().setConstant(turn * turn / 3);
        diagonal.diagonal().tail<3>().setConstant(shift * shift / 3);
        covariance = diagonal;
      }
      closer.add_odometry(k, k - 1, step, covariance);
    }
    for (const RegisteredPair& pair : sequence.pairs)
      if (std::max(pair.source, pair.target) == k)
        closer.add_result(pair.source, pair.target, pair.result);
    closer.process();
  }
  Outcome out;
  for (const loop_closure::Loop& loop : closer.loops()) {
    if (loop.state != LoopState::accepted) continue;
    ++out.accepted;
    const UnalignedIsometry3d truth =
        sequence.truth[static_cast<std::size_t>(loop.target)].inverse() *
        sequence.truth[static_cast<std::size_t>(loop.source)];
    out.wrong += !correct(truth, loop.target_from_source);
  }
  std::vector<UnalignedIsometry3d> poses;
  for (const loop_closure::FragmentPose& pose : closer.poses())
    poses.push_back(pose.world_from_fragment);
  out.rmse = rmse(sequence.truth, poses);
  return out;
}

void run(const std::string& path, const std::string& scene, int seeds) {
  const Sequence sequence = read_sequence(path);
  for (const Noise& noise : {Noise{0.01, 0.3}, Noise{0.03, 1}})
    for (int seed = 1; seed <= seeds; ++seed) {
      const std::vector<UnalignedIsometry3d> odometry =
          noisy(sequence, noise.share, noise.degrees, static_cast<std::uint64_t>(seed));
      const Outcome own = by_closer(sequence, odometry, noise, false);
      const Outcome told = by_closer(sequence, odometry, noise, true);
      std::printf(
          "{\"scene\": \"%s\", \"fragments\": %d, \"pairs\": %d, \"noise\": [%g, %g], \"seed\": "
          "%d, \"odometry_rmse\": %.4f, \"rmse\": %.4f, \"accepted\": %d, \"wrong\": %d, "
          "\"rmse_with_covariance\": %.4f}\n",
          scene.c_str(), static_cast<int>(odometry.size()), static_cast<int>(sequence.pairs.size()),
          noise.share, noise.degrees, seed, rmse(sequence.truth, odometry), own.rmse, own.accepted,
          own.wrong, told.rmse);
      std::fflush(stdout);
    }
}

}  // namespace
}  // namespace gpureg::bench

int main(int count, char** arguments) {
  if (count != 4) {
    std::fprintf(stderr, "usage: %s SEQUENCE SCENE SEEDS\n", arguments[0]);
    return 2;
  }
  try {
    gpureg::bench::run(arguments[1], arguments[2], std::atoi(arguments[3]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
