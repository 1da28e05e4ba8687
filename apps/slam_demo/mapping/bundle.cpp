// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/bundle.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace slam_demo {
namespace {

using Pose = BundleProblem::Pose;

// Standard deviation of inverse depths, 1/m. Structured light measures disparities, so their noise
// is that of inverse depth; this is 1/6 px of a Kinect (focal length times baseline: 43 m px).
constexpr double kInverseDepthSigma = 0.004;
constexpr double kHuber =
    2.8;  // standard deviations: the root of the 95 % quantile of three numbers

Pose pose_of(const Eigen::Isometry3d& world_from_camera) {
  const Eigen::Isometry3d m = world_from_camera.inverse();
  const Eigen::Quaterniond q = Eigen::Quaterniond(m.linear()).normalized();
  return {
      q.x(), q.y(), q.z(), q.w(), m.translation().x(), m.translation().y(), m.translation().z()};
}

Eigen::Isometry3d isometry_of(const Pose& pose) {
  Eigen::Isometry3d m = Eigen::Isometry3d::Identity();
  m.linear() =
      Eigen::Quaterniond(pose[3], pose[0], pose[1], pose[2]).normalized().toRotationMatrix();
  m.translation() = Eigen::Vector3d(pose[4], pose[5], pose[6]);
  return m.inverse();
}

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

/// Pixel and inverse depth of a point, each over its standard deviation.
template <class T>
void residual_of(const Pinhole& camera, const Measurement& m, const T* pose, const T* point,
                 T* residual, bool depth) {
  const Eigen::Map<const Eigen::Quaternion<T>> q(pose);
  const Eigen::Map<const Vector3<T>> t(pose + 4), x(point);
  const Vector3<T> p = q * x + t;
  const T inverse = T(1) / p.z(), sigma = T(m.sigma);
  residual[0] = (T(camera.fx) * p.x() * inverse + T(camera.cx) - T(m.u)) / sigma;
  residual[1] = (T(camera.fy) * p.y() * inverse + T(camera.cy) - T(m.v)) / sigma;
  if (depth) residual[2] = (inverse - T(1 / m.depth)) / T(kInverseDepthSigma);
}

/// kSize: 3 with depth, 2 without.
template <int kSize>
struct SightCost {
  const Pinhole camera;
  const Measurement m;
  template <class T>
  bool operator()(const T* pose, const T* point, T* residual) const {
    residual_of(camera, m, pose, point, residual, kSize == 3);
    return true;
  }
};

/// Of a point that is known.
template <int kSize>
struct PoseCost {
  const Pinhole camera;
  const PointMatch match;
  template <class T>
  bool operator()(const T* pose, T* residual) const {
    const Vector3<T> point = match.world.cast<T>();
    residual_of(camera, match.seen, pose, point.data(), residual, kSize == 3);
    return true;
  }
};

ceres::CostFunction* pose_cost(const Pinhole& camera, const PointMatch& match) {
  if (match.seen.depth > 0)
    return new ceres::AutoDiffCostFunction<PoseCost<3>, 3, 7>(new PoseCost<3>{camera, match});
  return new ceres::AutoDiffCostFunction<PoseCost<2>, 2, 7>(new PoseCost<2>{camera, match});
}

ceres::CostFunction* sight_cost(const Pinhole& camera, const Measurement& m) {
  if (m.depth > 0)
    return new ceres::AutoDiffCostFunction<SightCost<3>, 3, 7, 3>(new SightCost<3>{camera, m});
  return new ceres::AutoDiffCostFunction<SightCost<2>, 2, 7, 3>(new SightCost<2>{camera, m});
}

struct RelativeCost {
  const Eigen::Quaterniond a_from_b_rotation;
  const Eigen::Vector3d a_from_b_translation;
  const Eigen::Matrix<double, 6, 6> root;
  template <class T>
  bool operator()(const T* a, const T* b, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> qa(a), qb(b);  // camera_from_world
    const Eigen::Map<const Vector3<T>> ta(a + 4), tb(b + 4);
    const Eigen::Quaternion<T> q = qa * qb.conjugate();  // a_from_b
    const Vector3<T> t = ta - q * tb;
    const Eigen::Quaternion<T> back = a_from_b_rotation.conjugate().cast<T>();
    const Eigen::Quaternion<T> turn = back * q;
    Eigen::Matrix<T, 6, 1> e;
    const T sign = turn.w() < T(0) ? T(-2) : T(2);
    e.template head<3>() = sign * turn.vec();
    e.template tail<3>() = back * (t - a_from_b_translation.cast<T>());
    Eigen::Map<Eigen::Matrix<T, 6, 1>> r(residual);
    r = root.cast<T>() * e;
    return true;
  }
};

ceres::Manifold* pose_manifold() {
  return new ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>();
}

}  // namespace

Measurement measurement(const Features& features, int key) {
  const cv::KeyPoint& k = features.keys[at(key)];
  return {k.pt.x, k.pt.y, features.depth[at(key)], scale_of(k.octave)};
}

double squared_error(const Pinhole& camera, const Measurement& m, const Eigen::Vector3d& p) {
  if (p.z() < 0.05) return 1e9;
  double sum = (camera.project(p) - Eigen::Vector2d(m.u, m.v)).squaredNorm() / (m.sigma * m.sigma);
  if (m.depth > 0) {
    const double e = (1 / p.z() - 1 / m.depth) / kInverseDepthSigma;
    sum += e * e;
  }
  return sum;
}

double inlier_threshold(const Measurement& m) { return m.depth > 0 ? 7.815 : 5.991; }

Eigen::Isometry3d refine_pose(const Pinhole& camera, const std::vector<PointMatch>& matches,
                              const Eigen::Isometry3d& initial, std::vector<bool>& inliers) {
  constexpr int kRounds = 3;
  inliers.assign(matches.size(), true);
  Pose pose = pose_of(initial);
  for (int round = 0; round < kRounds; ++round) {
    ceres::Problem problem;
    problem.AddParameterBlock(pose.data(), 7, pose_manifold());
    std::size_t used = 0;
    for (std::size_t k = 0; k < matches.size(); ++k) {
      if (!inliers[k]) continue;
      ++used;
      ceres::LossFunction* loss = round + 1 < kRounds ? new ceres::HuberLoss(kHuber) : nullptr;
      problem.AddResidualBlock(pose_cost(camera, matches[k]), loss, pose.data());
    }
    if (used < 6) break;
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 8;
    options.function_tolerance = 1e-5;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    const Eigen::Isometry3d camera_from_world = isometry_of(pose).inverse();
    for (std::size_t k = 0; k < matches.size(); ++k)
      inliers[k] = squared_error(camera, matches[k].seen, camera_from_world * matches[k].world) <
                   inlier_threshold(matches[k].seen);
  }
  return isometry_of(pose);
}

BundleProblem bundle_of(const Map& map, const std::vector<int>& keyframes,
                        const std::vector<int>& fixed, const std::vector<RelativePose>& relatives) {
  BundleProblem problem;
  std::map<int, int> place;
  const auto add = [&](int keyframe, bool still) {
    place[keyframe] = static_cast<int>(problem.poses.size());
    problem.keyframes.push_back(keyframe);
    problem.poses.push_back(pose_of(map.keyframes[at(keyframe)].world_from_camera));
    problem.fixed.push_back(still);
  };
  for (const int k : keyframes) add(k, false);
  std::set<int> ids;
  for (const int k : keyframes) {
    for (const int p : map.keyframes[at(k)].points) {
      if (p != kNone && !map.points[at(p)].bad && map.points[at(p)].observations.size() > 1)
        ids.insert(p);
    }
  }
  for (const int k : fixed) add(k, true);
  for (const int id : ids) {
    const MapPoint& point = map.points[at(id)];
    problem.point_ids.push_back(id);
    problem.points.push_back(point.position);
    for (const Observation& o : point.observations) {
      const auto found = place.find(o.keyframe);
      if (found == place.end()) continue;
      problem.sights.push_back({found->second, static_cast<int>(problem.points.size()) - 1, o.key,
                                o.loop,
                                measurement(*map.keyframes[at(o.keyframe)].features, o.key)});
    }
  }
  std::vector<RelativePose> all = map.links;
  all.insert(all.end(), relatives.begin(), relatives.end());
  for (RelativePose r : all) {
    const auto a = place.find(r.a), b = place.find(r.b);
    if (a == place.end() || b == place.end()) continue;
    r.a = a->second;
    r.b = b->second;
    problem.relatives.push_back(r);
  }
  return problem;
}

BundleProblem local_bundle(const Map& map, int keyframe, std::size_t size) {
  constexpr int kMinShared = 15;
  constexpr std::size_t kMaxFixed = 30;
  std::vector<int> local = map.covisible(keyframe, size, kMinShared);
  local.push_back(keyframe);
  std::sort(local.begin(), local.end());
  std::map<int, int> others;
  for (const int k : local) {
    for (const auto& [other, shared] : map.keyframes[at(k)].covisible) {
      if (!std::binary_search(local.begin(), local.end(), other)) others[other] += shared;
    }
  }
  std::vector<int> fixed = by_count(others);
  fixed.resize(std::min(fixed.size(), kMaxFixed));
  if (fixed.empty()) {  // the first keyframes: the oldest holds the map in place
    fixed.push_back(local.front());
    local.erase(local.begin());
  }
  return bundle_of(map, local, fixed, {});
}

BundleReport adjust(const Pinhole& camera, BundleProblem& problem, int iterations, int threads) {
  if (problem.sights.empty()) return {};
  ceres::Problem ceres_problem;
  auto* order = new ceres::ParameterBlockOrdering;
  for (std::size_t k = 0; k < problem.poses.size(); ++k) {
    ceres_problem.AddParameterBlock(problem.poses[k].data(), 7, pose_manifold());
    if (problem.fixed[k]) ceres_problem.SetParameterBlockConstant(problem.poses[k].data());
    order->AddElementToGroup(problem.poses[k].data(), 1);
  }
  for (const BundleProblem::Sight& s : problem.sights) {
    double* point = problem.points[at(s.point)].data();
    double* pose = problem.poses[at(s.pose)].data();
    order->AddElementToGroup(point, 0);
    ceres_problem.AddResidualBlock(sight_cost(camera, s.seen), new ceres::HuberLoss(kHuber), pose,
                                   point);
  }
  for (const RelativePose& r : problem.relatives) {
    const Eigen::Matrix<double, 6, 6> root = r.information.llt().matrixU();
    ceres_problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<RelativeCost, 6, 7, 7>(new RelativeCost{
            Eigen::Quaterniond(r.a_from_b.linear()), r.a_from_b.translation(), root}),
        nullptr, problem.poses[at(r.a)].data(), problem.poses[at(r.b)].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  options.linear_solver_ordering.reset(order);
  options.max_num_iterations = iterations;
  options.function_tolerance = 1e-4;
  options.num_threads = threads;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  return {summary.initial_cost, summary.final_cost};
}

void apply(const Pinhole& camera, const BundleProblem& problem, Map& map) {
  constexpr double kDrop = 3;  // times the threshold of an inlier
  std::vector<Eigen::Isometry3d> camera_from_world;
  for (std::size_t k = 0; k < problem.poses.size(); ++k) {
    const Eigen::Isometry3d world_from_camera = isometry_of(problem.poses[k]);
    if (!problem.fixed[k])
      map.keyframes[at(problem.keyframes[k])].world_from_camera = world_from_camera;
    camera_from_world.push_back(world_from_camera.inverse());
  }
  for (std::size_t k = 0; k < problem.points.size(); ++k) {
    MapPoint& point = map.points[at(problem.point_ids[k])];
    if (!point.bad) point.position = problem.points[k];
  }
  for (const BundleProblem::Sight& s : problem.sights) {
    const double error =
        squared_error(camera, s.seen, camera_from_world[at(s.pose)] * problem.points[at(s.point)]);
    if (error > kDrop * inlier_threshold(s.seen))
      map.remove_observation(problem.point_ids[at(s.point)], problem.keyframes[at(s.pose)], s.key);
  }
}

}  // namespace slam_demo
