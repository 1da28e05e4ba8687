// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gpureg/pose_graph.hpp>
#include <map>
#include <string>
#include <vector>

#include "mapping/bundle.hpp"

namespace slam_demo {

inline gpureg::UnalignedIsometry3d unaligned(const Eigen::Isometry3d& pose) {
  return gpureg::UnalignedIsometry3d(pose.matrix());
}

/// How far a measured relative pose is from the poses of its keyframes.
struct Misfit {
  double metres = 0, radians = 0;
};
Misfit misfit_of(const Map& map, int a, int b, const Eigen::Isometry3d& a_from_b);

/// The pose graph of the keyframes: what tracking measured between neighbours, and loops. Loops are
/// kept by number, so that a retraction takes them out again.
class KeyframeGraph {
 public:
  /// Takes the relative poses of the newest keyframes from the map: their local adjustment is
  /// still going on.
  void record(const Map& map) { record(map, static_cast<int>(map.keyframes.size()) - kUnsettled); }
  /// The same from a keyframe on.
  void record(const Map& map, int first);

  /// Edges of a loop. Trusted: whoever adds them has verified them.
  void add(int loop, const std::vector<RelativePose>& edges);
  void remove(int loop) { loops_.erase(loop); }
  const std::map<int, std::vector<RelativePose>>& loops() const { return loops_; }

  /// A copy to optimise in another thread. Worlds of different sessions that loops connect become
  /// that of the earlier one.
  gpureg::pose_graph::Graph problem(const Map& map) const;
  static gpureg::pose_graph::Result solve(const gpureg::pose_graph::Graph& problem);
  /// Moves keyframes and points, unless the optimisation failed.
  static void apply(const gpureg::pose_graph::Result& result, Map& map);
  /// All three at once. Returns the reason where it did not converge.
  std::string optimize(Map& map) const;

  std::vector<RelativePose> loop_edges() const;
  /// What tracking measured between successive keyframes that share few points by now: points alone
  /// do not hold them together in an adjustment.
  std::vector<RelativePose> weak_odometry(const Map& map) const;

  /// Numbers of the loops with an edge that is farther from the poses of the map, the worst first.
  std::vector<int> misfits(const Map& map, double metres, double radians) const;

  /// Poses of all keyframes by tracking alone, each session from its first keyframe.
  std::vector<Eigen::Isometry3d> odometry_poses(const Map& map) const;

  /// The sessions that loops connect have the smallest of them as their world.
  std::vector<int> world_of_session(const Map& map) const;

 private:
  static constexpr int kUnsettled = 8;  // keyframes that local adjustment still moves
  struct Key {
    int a, b;
    bool operator<(const Key& o) const { return a != o.a ? a < o.a : b < o.b; }
  };
  std::map<Key, Eigen::Isometry3d> odometry_;  // a_from_b as tracking had it
  std::map<int, std::vector<RelativePose>> loops_;
};

/// Moves keyframes, and with each the points that it saw first. Later keyframes follow.
void move_keyframes(const std::vector<Eigen::Isometry3d>& world_from_camera, Map& map);

/// apply() of an adjustment of all keyframes. Those that were made meanwhile follow.
void apply_full(const Pinhole& camera, const BundleProblem& problem, Map& map);

}  // namespace slam_demo
