// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframe_graph.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace slam_demo {
namespace {

constexpr int kNeighbours = 3;  // of a keyframe, beside the one before
constexpr int kMinShared = 60;  // points that two keyframes share

// Noise between neighbouring keyframes after local adjustment.
constexpr double kBaseMetres = 0.003, kPerMetre = 0.01, kBaseRadians = 0.001, kPerRadian = 0.01;

Eigen::Matrix<double, 6, 6> odometry_information(const Eigen::Isometry3d& motion) {
  const double angle = Eigen::AngleAxisd(motion.linear()).angle();
  return information_of(kBaseRadians + kPerRadian * angle,
                        kBaseMetres + kPerMetre * motion.translation().norm());
}

}  // namespace

Misfit misfit_of(const Map& map, int a, int b, const Eigen::Isometry3d& a_from_b) {
  const Eigen::Isometry3d error = a_from_b.inverse() *
                                  map.keyframes[at(a)].world_from_camera.inverse() *
                                  map.keyframes[at(b)].world_from_camera;
  return {error.translation().norm(), Eigen::AngleAxisd(error.linear()).angle()};
}

namespace {

/// Keyframes that were made meanwhile follow the newest known one of their session.
Eigen::Isometry3d correction_of_session(const std::vector<Eigen::Isometry3d>& corrections,
                                        std::size_t known, std::size_t keyframe, const Map& map) {
  for (std::size_t k = known; k-- > 0;) {
    if (map.keyframes[k].session == map.keyframes[keyframe].session) return corrections[k];
  }
  return Eigen::Isometry3d::Identity();
}

}  // namespace

void move_keyframes(const std::vector<Eigen::Isometry3d>& poses, Map& map) {
  std::vector<Eigen::Isometry3d> correction;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    correction.push_back(poses[k] * map.keyframes[k].world_from_camera.inverse());
    map.keyframes[k].world_from_camera = poses[k];
  }
  for (std::size_t k = poses.size(); k < map.keyframes.size(); ++k) {
    correction.push_back(correction_of_session(correction, poses.size(), k, map));
    map.keyframes[k].world_from_camera = correction[k] * map.keyframes[k].world_from_camera;
  }
  for (MapPoint& point : map.points) {
    if (!point.bad) point.position = correction[at(point.first_keyframe)] * point.position;
  }
}

void apply_full(const Pinhole& camera, const BundleProblem& problem, Map& map) {
  std::vector<Eigen::Isometry3d> correction;
  for (const Keyframe& keyframe : map.keyframes)
    correction.push_back(keyframe.world_from_camera.inverse());
  std::vector<bool> adjusted(map.points.size(), false);
  for (const int id : problem.point_ids) adjusted[at(id)] = true;
  apply(camera, problem, map);
  const std::size_t known = problem.poses.size();
  if (known == map.keyframes.size()) return;
  for (std::size_t k = 0; k < known; ++k)
    correction[k] = map.keyframes[k].world_from_camera * correction[k];
  for (std::size_t k = known; k < map.keyframes.size(); ++k) {
    correction[k] = correction_of_session(correction, known, k, map);
    map.keyframes[k].world_from_camera = correction[k] * map.keyframes[k].world_from_camera;
  }
  for (std::size_t p = 0; p < map.points.size(); ++p) {
    MapPoint& point = map.points[p];
    // Points of one keyframe are where it measured them, by the new poses of the known ones.
    if (point.bad || adjusted[p] ||
        (at(point.first_keyframe) < known && problem.calibrate && point.observations.size() == 1))
      continue;
    point.position = correction[at(point.first_keyframe)] * point.position;
  }
}

void KeyframeGraph::record(const Map& map, int first) {
  const int count = static_cast<int>(map.keyframes.size());
  for (int b = std::max(0, first); b < count; ++b) {
    const Keyframe& keyframe = map.keyframes[at(b)];
    std::vector<int> others;
    for (const int a : map.covisible(b, 20, kMinShared)) {
      // Keyframes far back were reached through a loop that tracking closed: no odometry.
      if (a < b && b - a <= kUnsettled && static_cast<int>(others.size()) < kNeighbours)
        others.push_back(a);
    }
    if (b > 0) others.push_back(b - 1);
    for (const int a : others) {
      if (map.keyframes[at(a)].session == keyframe.session)
        odometry_[{a, b}] =
            map.keyframes[at(a)].world_from_camera.inverse() * keyframe.world_from_camera;
    }
  }
}

void KeyframeGraph::add(int loop, const std::vector<RelativePose>& edges) {
  std::vector<RelativePose>& all = loops_[loop];
  all.insert(all.end(), edges.begin(), edges.end());
}

std::vector<RelativePose> KeyframeGraph::loop_edges() const {
  std::vector<RelativePose> result;
  for (const auto& [loop, edges] : loops_) result.insert(result.end(), edges.begin(), edges.end());
  return result;
}

std::vector<RelativePose> KeyframeGraph::weak_odometry(const Map& map) const {
  std::vector<RelativePose> result;
  for (const auto& [key, a_from_b] : odometry_) {
    if (key.b != key.a + 1) continue;
    const std::map<int, int>& shared = map.keyframes[at(key.b)].covisible;
    const auto found = shared.find(key.a);
    if (found == shared.end() || found->second < kMinShared)
      result.push_back({key.a, key.b, a_from_b, odometry_information(a_from_b)});
  }
  return result;
}

std::vector<int> KeyframeGraph::misfits(const Map& map, double metres, double radians) const {
  std::vector<std::pair<double, int>> order;  // minus the worst share of a bound, loop
  for (const auto& [loop, edges] : loops_) {
    double worst = 0;
    for (const RelativePose& edge : edges) {
      const Misfit misfit = misfit_of(map, edge.a, edge.b, edge.a_from_b);
      worst = std::max({worst, misfit.metres / metres, misfit.radians / radians});
    }
    if (worst > 1) order.emplace_back(-worst, loop);
  }
  std::sort(order.begin(), order.end());
  std::vector<int> result;
  for (const auto& [worst, loop] : order) result.push_back(loop);
  return result;
}

std::vector<Eigen::Isometry3d> KeyframeGraph::odometry_poses(const Map& map) const {
  std::vector<Eigen::Isometry3d> poses;
  for (std::size_t k = 0; k < map.keyframes.size(); ++k) {
    const auto edge = odometry_.find({static_cast<int>(k) - 1, static_cast<int>(k)});
    poses.push_back(edge == odometry_.end() ? map.keyframes[k].world_from_camera
                                            : poses.back() * edge->second);
  }
  return poses;
}

std::vector<int> KeyframeGraph::world_of_session(const Map& map) const {
  int sessions = 0;
  for (const Keyframe& keyframe : map.keyframes)
    sessions = std::max(sessions, keyframe.session + 1);
  std::vector<int> world(at(sessions));
  std::iota(world.begin(), world.end(), 0);
  for (const RelativePose& edge : loop_edges()) {
    const int a = world[at(map.keyframes[at(edge.a)].session)],
              b = world[at(map.keyframes[at(edge.b)].session)];
    for (int& w : world) {
      if (w == a || w == b) w = std::min(a, b);
    }
  }
  return world;
}

gpureg::pose_graph::Graph KeyframeGraph::problem(const Map& map) const {
  using namespace gpureg::pose_graph;
  Graph graph;
  const std::vector<int> world = world_of_session(map);
  std::vector<bool> anchored(world.size(), false), placed(world.size(), false);
  std::vector<Eigen::Isometry3d> initial;
  // A session that a loop connects to an earlier world starts where the loop puts it.
  std::vector<Eigen::Isometry3d> world_from_session(world.size(), Eigen::Isometry3d::Identity());
  for (std::size_t s = 0; s < world.size(); ++s) placed[s] = at(world[s]) == s;
  for (std::size_t round = 0; round < world.size(); ++round) {
    for (const RelativePose& edge : loop_edges()) {
      const std::size_t a = at(map.keyframes[at(edge.a)].session),
                        b = at(map.keyframes[at(edge.b)].session);
      if (placed[a] == placed[b]) continue;
      const Eigen::Isometry3d wa = map.keyframes[at(edge.a)].world_from_camera,
                              wb = map.keyframes[at(edge.b)].world_from_camera;
      if (placed[a])
        world_from_session[b] = world_from_session[a] * wa * edge.a_from_b * wb.inverse();
      else
        world_from_session[a] = world_from_session[b] * wb * edge.a_from_b.inverse() * wa.inverse();
      placed[a] = placed[b] = true;
    }
  }
  for (std::size_t k = 0; k < map.keyframes.size(); ++k) {
    const Keyframe& keyframe = map.keyframes[k];
    Node node;
    node.id = static_cast<std::int64_t>(k);
    node.world_from_node =
        unaligned(world_from_session[at(keyframe.session)] * keyframe.world_from_camera);
    const std::size_t w = at(world[at(keyframe.session)]);
    node.fixed = !anchored[w];
    anchored[w] = true;
    graph.nodes.push_back(node);
  }
  const auto edge_of = [](int a, int b, const Eigen::Isometry3d& a_from_b,
                          const Eigen::Matrix<double, 6, 6>& information) {
    Edge edge;
    edge.source = b;
    edge.target = a;
    edge.target_from_source = unaligned(a_from_b);
    edge.information = information;
    edge.kind = EdgeKind::odometry;  // loops too: they are verified
    return edge;
  };
  for (const auto& [key, a_from_b] : odometry_)
    graph.edges.push_back(edge_of(key.a, key.b, a_from_b, odometry_information(a_from_b)));
  for (const RelativePose& e : loop_edges())
    graph.edges.push_back(edge_of(e.a, e.b, e.a_from_b, e.information));
  return graph;
}

gpureg::pose_graph::Result KeyframeGraph::solve(const gpureg::pose_graph::Graph& graph) {
  gpureg::pose_graph::Options options;
  options.robust = gpureg::pose_graph::Robust::none;
  return gpureg::pose_graph::optimize(graph, options);
}

void KeyframeGraph::apply(const gpureg::pose_graph::Result& result, Map& map) {
  using gpureg::pose_graph::Status;
  if (result.status == Status::failed || result.status == Status::no_nodes) return;
  std::vector<Eigen::Isometry3d> poses;
  for (const auto& pose : result.world_from_node) poses.push_back(Eigen::Isometry3d(pose.matrix()));
  move_keyframes(poses, map);
}

std::string KeyframeGraph::optimize(Map& map) const {
  const gpureg::pose_graph::Result result = solve(problem(map));
  apply(result, map);
  return result.reason;
}

}  // namespace slam_demo
