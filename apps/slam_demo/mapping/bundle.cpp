// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/bundle.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "mapping/costs.hpp"

namespace slam_demo {
namespace {

using Pose = BundleProblem::Pose;
constexpr std::size_t kPoseSize = std::tuple_size<Pose>::value;
constexpr int kLensSize = std::tuple_size<Lens>::value;

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

}  // namespace

Measurement measurement(const Features& features, int key, const DepthCalibration& calibration) {
  const cv::KeyPoint& k = features.keys[at(key)];
  return {k.pt.x, k.pt.y,
          calibration.corrected(k.pt.x, k.pt.y, static_cast<double>(features.depth[at(key)])),
          scale_of(k.octave)};
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
  problem.calibration = map.calibration;
  std::vector<int> place(map.keyframes.size(), kNone);  // in problem.poses
  const auto add = [&](int keyframe, bool still) {
    place[at(keyframe)] = static_cast<int>(problem.poses.size());
    problem.keyframes.push_back(keyframe);
    problem.poses.push_back(pose_of(map.keyframes[at(keyframe)].world_from_camera));
    problem.fixed.push_back(still);
  };
  for (const int k : keyframes) add(k, false);
  std::vector<bool> wanted(map.points.size(), false);
  for (const int k : keyframes) {
    for (const int p : map.keyframes[at(k)].points) {
      if (p != kNone && !map.points[at(p)].bad && map.points[at(p)].observations.size() > 1)
        wanted[at(p)] = true;
    }
  }
  for (const int k : fixed) add(k, true);
  for (std::size_t id = 0; id < wanted.size(); ++id) {
    if (!wanted[id]) continue;
    const MapPoint& point = map.points[id];
    problem.point_ids.push_back(static_cast<int>(id));
    problem.points.push_back(point.position);
    for (const Observation& o : point.observations) {
      if (place[at(o.keyframe)] == kNone) continue;
      problem.sights.push_back(
          {place[at(o.keyframe)], static_cast<int>(problem.points.size()) - 1, o.key, o.loop,
           measurement(*map.keyframes[at(o.keyframe)].features, o.key, map.calibration)});
    }
  }
  std::vector<RelativePose> all = map.links;
  all.insert(all.end(), relatives.begin(), relatives.end());
  for (RelativePose r : all) {
    r.a = place[at(r.a)];
    r.b = place[at(r.b)];
    if (r.a == kNone || r.b == kNone) continue;
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

namespace {

void add_calibration(double* offsets, double* lens, const DepthCalibration& prior,
                     ceres::Problem& problem, ceres::ParameterBlockOrdering& order) {
  order.AddElementToGroup(lens, 1);
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<LensCost, kLensSize + 1, kLensSize>(new LensCost{prior.lens}),
      nullptr, lens);
  for (std::size_t k = 0; k < DepthCalibration::kNodes; ++k) {
    double* node = offsets + k;
    order.AddElementToGroup(node, 1);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<NodeCost, 1, 1>(new NodeCost{prior.offsets[k]}), nullptr,
        node);
    const auto smooth = [&](std::size_t other) {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SmoothCost, 1, 1, 1>(new SmoothCost),
                               nullptr, node, offsets + other);
    };
    if ((k + 1) % DepthCalibration::kColumns != 0) smooth(k + 1);
    if (k + DepthCalibration::kColumns < DepthCalibration::kNodes)
      smooth(k + DepthCalibration::kColumns);
  }
}

void add_calibrated_sight(const Pinhole& camera, const Measurement& m, double* pose, double* point,
                          const DepthCalibration& before, double* offsets, double* lens,
                          ceres::Problem& problem) {
  const auto around = before.around(m.u, m.v);
  const auto node = [&](std::size_t k) { return offsets + around[k].node; };
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<CalibratedSightCost, 3, 7, 3, kLensSize, 1, 1, 1, 1>(
          new CalibratedSightCost{camera, m, in_image(camera, before.lens, {m.u, m.v}), around,
                                  before.offset(m.u, m.v)}),
      new ceres::HuberLoss(kHuber), pose, point, lens, node(0), node(1), node(2), node(3));
}

/// Corrects the sights by the calibration that was found.
void correct_sights(const Pinhole& camera, const DepthCalibration& before, BundleProblem& problem) {
  for (BundleProblem::Sight& s : problem.sights) {
    Measurement& m = s.seen;
    if (m.depth > 0)
      m.depth = 1 / (1 / m.depth + before.offset(m.u, m.v) - problem.calibration.offset(m.u, m.v));
    const Eigen::Vector2d pixel =
        in_pinhole(camera, problem.calibration.lens, in_image(camera, before.lens, {m.u, m.v}));
    m.u = pixel.x();
    m.v = pixel.y();
  }
}

}  // namespace

BundleReport adjust(const Pinhole& camera, BundleProblem& problem, int iterations, int threads) {
  if (problem.sights.empty()) return {};
  // Ceres orders the blocks of a group by their addresses: in one array, that is always the same.
  std::vector<double> cameras;  // poses, then offsets of the calibration, then the lens
  for (const Pose& pose : problem.poses) cameras.insert(cameras.end(), pose.begin(), pose.end());
  cameras.insert(cameras.end(), problem.calibration.offsets.begin(),
                 problem.calibration.offsets.end());
  cameras.insert(cameras.end(), problem.calibration.lens.begin(), problem.calibration.lens.end());
  const auto pose_at = [&](int k) { return &cameras[at(k) * kPoseSize]; };
  double* const offsets = &cameras[problem.poses.size() * kPoseSize];
  double* const lens = offsets + DepthCalibration::kNodes;
  ceres::Problem ceres_problem;
  auto* order = new ceres::ParameterBlockOrdering;
  for (std::size_t k = 0; k < problem.poses.size(); ++k) {
    double* pose = pose_at(static_cast<int>(k));
    ceres_problem.AddParameterBlock(pose, kPoseSize, pose_manifold());
    if (problem.fixed[k]) ceres_problem.SetParameterBlockConstant(pose);
    order->AddElementToGroup(pose, 1);
  }
  const DepthCalibration before = problem.calibration;
  if (problem.calibrate) {
    add_calibration(offsets, lens, problem.prior, ceres_problem, *order);
    if (!problem.calibrate_lens) ceres_problem.SetParameterBlockConstant(lens);
  }
  for (const BundleProblem::Sight& s : problem.sights) {
    double* point = problem.points[at(s.point)].data();
    double* pose = pose_at(s.pose);
    order->AddElementToGroup(point, 0);
    if (problem.calibrate && (s.seen.depth > 0 || problem.calibrate_lens)) {
      add_calibrated_sight(camera, s.seen, pose, point, before, offsets, lens, ceres_problem);
      continue;
    }
    ceres_problem.AddResidualBlock(sight_cost(camera, s.seen), new ceres::HuberLoss(kHuber), pose,
                                   point);
  }
  for (const RelativePose& r : problem.relatives) {
    const Eigen::Matrix<double, 6, 6> root = r.information.llt().matrixU();
    ceres_problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<RelativeCost, 6, 7, 7>(new RelativeCost{
            Eigen::Quaterniond(r.a_from_b.linear()), r.a_from_b.translation(), root}),
        nullptr, pose_at(r.a), pose_at(r.b));
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
  for (std::size_t k = 0; k < problem.poses.size(); ++k)
    std::copy_n(pose_at(static_cast<int>(k)), kPoseSize, problem.poses[k].begin());
  std::copy_n(offsets, DepthCalibration::kNodes, problem.calibration.offsets.begin());
  std::copy_n(lens, kLensSize, problem.calibration.lens.begin());
  if (problem.calibrate) correct_sights(camera, before, problem);
  return {summary.initial_cost, summary.final_cost};
}

namespace {

/// The pixels of all features by another lens.
void rectify_features(const Pinhole& camera, const Lens& before, const Lens& after, Map& map) {
  for (Keyframe& keyframe : map.keyframes) {
    auto features = std::make_shared<Features>(*keyframe.features);
    for (cv::KeyPoint& key : features->keys) {
      const Eigen::Vector2d pixel =
          in_pinhole(camera, after, in_image(camera, before, {key.pt.x, key.pt.y}));
      key.pt = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
    }
    features->index();
    keyframe.features = std::move(features);
  }
}

/// Points of a single keyframe take no part in an adjustment: they go where it measured them.
void place_lone_points(const Pinhole& camera, Map& map) {
  for (MapPoint& point : map.points) {
    if (point.bad || point.observations.size() != 1) continue;
    const Observation& o = point.observations.front();
    const Keyframe& keyframe = map.keyframes[at(o.keyframe)];
    const Measurement m = measurement(*keyframe.features, o.key, map.calibration);
    if (m.depth > 0)
      point.position = keyframe.world_from_camera * camera.unproject(m.u, m.v, m.depth);
  }
}

}  // namespace

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
  if (problem.calibrate) {
    rectify_features(camera, map.calibration.lens, problem.calibration.lens, map);
    map.calibration = problem.calibration;
    place_lone_points(camera, map);
  }
  for (const BundleProblem::Sight& s : problem.sights) {
    const double error =
        squared_error(camera, s.seen, camera_from_world[at(s.pose)] * problem.points[at(s.point)]);
    if (error > kDrop * inlier_threshold(s.seen))
      map.remove_observation(problem.point_ids[at(s.point)], problem.keyframes[at(s.pose)], s.key);
  }
}

}  // namespace slam_demo
