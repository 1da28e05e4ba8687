// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/check.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <sstream>

#include "gpureg/error.hpp"
#include "math/trigonometry.hpp"
#include "pose_graph/validate.hpp"

namespace gpureg::loop_closure {
namespace {

/// Rotations of single precision are orthonormal to this.
constexpr double kOrthonormal = 1e-4;
constexpr double kSymmetric = 1e-6;  ///< relative to the largest element
/// Metres. A thousand such edges in a row stay within what pose graphs take.
constexpr double kFarthest = 1e9;
/// Length of a direction, above what pose graphs and priors take as 0.
constexpr double kShortest = 1e-6;
using pose_graph::kLargestInformation;

std::string metres(float length) {
  std::ostringstream text;
  text << length << " m";
  return text.str();
}

std::string fragment_name(FragmentId id) { return "fragment " + std::to_string(id); }

[[noreturn]] void refuse(const std::string& name, double value, const char* expected) {
  throw InvalidArgument(name + " is " + shown(value) + ", expected " + expected);
}

UnalignedMatrix6d information_of_covariance(const UnalignedMatrix6d& covariance) {
  if (!covariance.allFinite())
    throw InvalidArgument("covariance has an element that is not finite");
  const double largest = covariance.cwiseAbs().maxCoeff();
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > kSymmetric * largest)
    throw InvalidArgument("covariance is not symmetric");
  if (largest > kLargestInformation)
    refuse("the largest element of covariance", largest, "1e18 at most");
  const Matrix6d symmetric = 0.5 * (covariance + covariance.transpose());
  const double least =
      Eigen::SelfAdjointEigenSolver<Matrix6d>(symmetric, Eigen::EigenvaluesOnly).eigenvalues()[0];
  if (!(least > 0))
    throw InvalidArgument("covariance is not positive definite: its smallest eigenvalue is " +
                          shown(least));
  if (least < 1 / kLargestInformation)
    refuse("the smallest eigenvalue of covariance", least, "1e-18 or more");
  const Matrix6d information = symmetric.llt().solve(Matrix6d::Identity());
  return UnalignedMatrix6d(0.5 * (information + information.transpose()));
}

void require_information(const UnalignedMatrix6d& information, const std::string& name) {
  pose_graph::require_information(information, name);
  const double largest = information.cwiseAbs().maxCoeff();
  if (largest < 1 / kLargestInformation)
    refuse("the largest element of " + name, largest, "1e-18 or more");
}

}  // namespace

Registry::Registry(const State& state) {
  for (const auto& [id, node] : state.nodes) has_cloud_[id] = node.has_cloud;
  for (const Odometry& edge : state.odometry)
    if (!edge.implied) odometry_.insert(pair_of(edge.source, edge.target));
}

void Registry::add(FragmentId id, bool has_cloud) {
  if (!has_cloud_.emplace(id, has_cloud).second)
    throw InvalidArgument(fragment_name(id) + " was added before");
}

void Registry::remove(FragmentId id) {
  require_known(id);
  has_cloud_.erase(id);
  for (auto pair = odometry_.begin(); pair != odometry_.end();)
    pair = pair->first == id || pair->second == id ? odometry_.erase(pair) : std::next(pair);
}

void Registry::connect(FragmentId source, FragmentId target) {
  if (!odometry_.insert(pair_of(source, target)).second)
    throw InvalidArgument("odometry between fragments " + std::to_string(source) + " and " +
                          std::to_string(target) + " was added before");
}

void Registry::require_known(FragmentId id) const {
  if (has_cloud_.count(id) == 0)
    throw InvalidArgument("no " + fragment_name(id) + " was added, or it was removed");
}

void Registry::require_pair(FragmentId source, FragmentId target) const {
  require_known(source);
  require_known(target);
  if (source == target)
    throw InvalidArgument("source and target are the same " + fragment_name(source));
}

void Registry::require_clouds(FragmentId source, FragmentId target) const {
  for (const FragmentId id : {source, target})
    if (!has_cloud_.at(id)) throw InvalidArgument(fragment_name(id) + " has no cloud");
}

void check_fragment(const Fragment& fragment, const Options& options) {
  const std::string name = fragment_name(fragment.id);
  if (fragment.world_from_fragment) {
    check_pose(*fragment.world_from_fragment, "world_from_fragment of " + name);
    // The most certain edge that its pose may imply.
    odometry_edge(fragment.id, fragment.id, UnalignedIsometry3d::Identity(), std::nullopt, options);
  }
  if (fragment.cloud.valid()) {
    const float voxel_size = fragment.cloud.voxel_size();
    if (voxel_size != options.registration.voxel_size)
      throw InvalidArgument("the cloud of " + name + " has voxels of " + metres(voxel_size) +
                            ", this closer has voxels of " +
                            metres(options.registration.voxel_size));
    if (fragment.cloud.size() == 0) {
      const PrepareStatistics& found = fragment.cloud.statistics();
      throw InvalidArgument("the cloud of " + name + " has no points: of " +
                            std::to_string(found.input_points) + ", " +
                            std::to_string(found.invalid_points) + " are not finite");
    }
  }
  if (!std::isfinite(fragment.time)) throw InvalidArgument("time of " + name + " is not finite");
  if (fragment.up && !(fragment.up->norm() >= kShortest && fragment.up->norm() <= kFarthest))
    throw InvalidArgument("up of " + name + " has the length " + shown(fragment.up->norm()) +
                          ", expected 1e-6 to 1e9");
}

void check_voxel_size(const State& state, const Options& options, const std::string& path) {
  if (state.voxel_size != options.registration.voxel_size)
    throw InvalidArgument(path + " is the state of a closer with voxels of " +
                          metres(state.voxel_size) + ", this one has voxels of " +
                          metres(options.registration.voxel_size));
}

void check_pose(const UnalignedIsometry3d& pose, const std::string& name) {
  if (!pose.matrix().allFinite())
    throw InvalidArgument(name + " has an element that is not finite");
  if (pose.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw InvalidArgument(name + " has a last row other than 0 0 0 1");
  const double farthest = pose.translation().cwiseAbs().maxCoeff();
  if (farthest > kFarthest)
    refuse("the largest coordinate of " + name, farthest, "1e9 metres at most");
  const Eigen::Matrix3d rotation = pose.linear();
  const double error =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > kOrthonormal)
    throw InvalidArgument(name +
                          " is not rigid: R R' of its rotation R differs from the identity by " +
                          shown(error));
  if (rotation.determinant() < 0)
    throw InvalidArgument(name + " is a mirror image: its rotation has the determinant -1");
}

void check_result(const RegistrationResult& result) {
  if (!result.has_pose()) return;
  check_pose(result.target_from_source, "result.target_from_source");
  pose_graph::require_confidence(result.confidence, "result.confidence");
  for (std::size_t k = 0; k < result.modes.size(); ++k) {
    const std::string name = "result.modes[" + std::to_string(k) + "]";
    check_pose(result.modes[k].target_from_source, name + ".target_from_source");
    pose_graph::require_confidence(result.modes[k].confidence, name + ".confidence");
  }
}

void check_modes(const LoopRecord& record) {
  for (const Mode& mode : record.modes)
    require_information(mode.information, "result.modes.information");
}

Odometry odometry_edge(FragmentId source, FragmentId target,
                       const UnalignedIsometry3d& target_from_source,
                       const std::optional<UnalignedMatrix6d>& covariance, const Options& options) {
  Odometry edge = modelled_odometry(source, target, target_from_source, options);
  if (covariance) {
    edge.information = information_of_covariance(*covariance);
    edge.modelled = false;
  }
  require_information(edge.information,
                      covariance ? "information of covariance" : "graph.drift.information");
  return edge;
}

LoopRecord host_record(FragmentId source, FragmentId target, const UnalignedIsometry3d& pose,
                       const std::optional<UnalignedMatrix6d>& information, double confidence,
                       const Options& options) {
  Mode mode;
  mode.target_from_source = pose;
  mode.confidence = confidence;
  if (information) {
    mode.information = *information;
  } else {
    const pose_graph::LoopNoiseOptions& noise = options.graph.loop_noise;
    Vector6d diagonal;
    diagonal.head<3>().setConstant(1 /
                                   portable::square(noise.rotation * portable::kRadiansPerDegree));
    diagonal.tail<3>().setConstant(1 / portable::square(noise.translation));
    mode.information = UnalignedMatrix6d(diagonal.asDiagonal());
  }
  LoopRecord record;
  record.source = record.loop.source = source;
  record.target = record.loop.target = target;
  record.loop.from_host = true;
  require_information(mode.information, information ? "information" : "host_noise.information");
  record.modes = {mode};
  choose_mode(record, 0);
  return record;
}

void give_clouds(State& state, const CloudProvider& clouds, const Options& options) {
  for (auto& [id, node] : state.nodes) {
    if (!node.has_cloud) continue;
    if (clouds) node.cloud = clouds(id);
    if (!node.cloud.valid()) throw InvalidArgument("no cloud was given for " + fragment_name(id));
    if (fingerprint_of(node.cloud) != node.fingerprint)
      throw InvalidArgument("the cloud of " + fragment_name(id) +
                            " is another than when the state was saved");
    node.observed =
        std::make_shared<const Coarse>(coarse_of(node.cloud, options.proposals.coarse_voxel_size));
  }
}

}  // namespace gpureg::loop_closure
