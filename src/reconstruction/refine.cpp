// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "common/host_threads.hpp"
#include "common/validate.hpp"
#include "fields/in_units.hpp"
#include "fields/reconstruction.hpp"
#include "gpureg/reconstruction.hpp"
#include "gpureg/surface_set.hpp"
#include "math/trigonometry.hpp"
#include "pose_graph/parallel.hpp"
#include "pose_graph/solver/block_cholesky.hpp"
#include "pose_graph/solver/normal_equations.hpp"
#include "reconstruction/connections.hpp"
#include "reconstruction/relative_variances.hpp"

namespace gpureg::reconstruction {
namespace {

using pose_graph::Matrix6d;
using pose_graph::Pose;
using pose_graph::Vector6d;

/// Share of the iterations after which the distance has reached its final value.
constexpr double kShrinkingShare = 0.6;
/// Levenberg-Marquardt damping, relative to the diagonal: enough for directions that nothing holds.
constexpr double kDiagonalDamping = 1e-6;
/// Steps below this, in radians and metres, end the refinement.
constexpr double kSmallestStep = 1e-4;
/// Squared error of an edge at which it counts half: the mean of the chi-square distribution with 6
/// degrees of freedom.
constexpr double kEdgeKernel = 6;

Pose pose_of(const UnalignedIsometry3d& pose) { return {pose.linear(), pose.translation()}; }

UnalignedIsometry3d isometry_of(const Pose& pose) {
  UnalignedIsometry3d out = UnalignedIsometry3d::Identity();
  out.linear() = pose.rotation;
  out.translation() = pose.translation;
  return out;
}

/// Sphere around a surface: pairs whose spheres are apart are not looked at.
struct Sphere {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = -1;  ///< < 0: no point
};

Sphere sphere_of(const Surface& surface) {
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Vector3f high = -low;
  for (const Eigen::Vector3f& p : surface.points) {
    if (!p.allFinite()) continue;
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  if (!(low.x() <= high.x())) return {};
  return {0.5 * (low + high).cast<double>(), 0.5 * (high - low).cast<double>().norm()};
}

/// The arrays of the scans that are placed; the others have no points.
std::vector<SurfaceView> views_of(const std::vector<Surface>& surfaces,
                                  const std::vector<std::vector<float>>& variances,
                                  const Reconstruction& map) {
  std::vector<SurfaceView> out(surfaces.size());
  for (std::size_t k = 0; k < surfaces.size(); ++k)
    if (map.scans[k].placed && !surfaces[k].points.empty())
      out[k] = {surfaces[k].points[0].data(), surfaces[k].normals[0].data(), variances[k].data(),
                surfaces[k].points.size()};
  return out;
}

std::vector<std::vector<float>> variances_of(const std::vector<Surface>& surfaces,
                                             const Reconstruction& map, double noise_range,
                                             int threads) {
  std::vector<std::vector<float>> out(surfaces.size());
  const auto work = [&](int begin, int end) {
    for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k)
      if (map.scans[k].placed) out[k] = relative_variances(surfaces[k], noise_range);
  };
  pose_graph::for_ranges(static_cast<int>(surfaces.size()), threads, work, 1);
  return out;
}

/// The normal equations over the poses of the placed scans.
struct System {
  System(std::size_t scans, const Reconstruction& map) : column(scans, -1) {
    for (const Island& island : map.islands)
      for (std::size_t k = 1; k < island.scans.size(); ++k) column[island.scans[k]] = columns++;
  }

  std::vector<int> column;  ///< of each scan; -1: held or not placed
  int columns = 0;
};

class Refiner {
 public:
  Refiner(const Context& context, const std::vector<Surface>& surfaces, Reconstruction& map,
          const RefineOptions& options)
      : map_(map),
        options_(options),
        threads_(thread_count(options.threads)),
        system_(surfaces.size(), map),
        poses_(surfaces.size()),
        spheres_(surfaces.size()),
        variances_(variances_of(surfaces, map, options.noise_range, threads_)),
        surfaces_(context, views_of(surfaces, variances_, map)) {
    for (std::size_t k = 0; k < surfaces.size(); ++k) {
      if (!map.scans[k].placed) continue;
      poses_[k] = pose_of(map.scans[k].island_from_scan);
      spheres_[k] = sphere_of(surfaces[k]);
    }
  }

  RefineReport run() {
    RefineReport report;
    report.initial_rmse = associate(options_.final_distance, report);
    for (int k = 0; k < options_.iterations && system_.columns > 0; ++k) {
      if (options_.should_stop && options_.should_stop(k)) break;
      const double distance = distance_of(k);
      associate(distance, report);
      const double step = solve();
      if (step < 0) {
        report.solved = false;
        return report;
      }
      ++report.iterations;
      if (distance == options_.final_distance && step < kSmallestStep) break;
    }
    report.final_rmse = associate(options_.final_distance, report);
    for (std::size_t k = 0; k < poses_.size(); ++k)
      if (system_.column[k] >= 0) map_.scans[k].island_from_scan = isometry_of(poses_[k]);
    return report;
  }

 private:
  /// From the initial to the final distance by equal factors.
  double distance_of(int iteration) const {
    const double shrinking = std::floor(kShrinkingShare * options_.iterations);
    if (iteration >= shrinking) return options_.final_distance;
    return options_.initial_distance *
           portable::exp(portable::log(options_.final_distance / options_.initial_distance) *
                         (iteration / shrinking));
  }

  std::vector<SurfacePair> near_pairs(double distance) const {
    std::vector<SurfacePair> out;
    for (const Island& island : map_.islands)
      for (const std::uint32_t i : island.scans)
        for (const std::uint32_t j : island.scans) {
          if (i == j || spheres_[i].radius < 0 || spheres_[j].radius < 0) continue;
          const Eigen::Vector3d a = poses_[i].rotation * spheres_[i].centre + poses_[i].translation,
                                b = poses_[j].rotation * spheres_[j].centre + poses_[j].translation;
          if ((a - b).norm() <= spheres_[i].radius + spheres_[j].radius + distance)
            out.push_back({i, j, isometry_of(poses_[j].inverse() * poses_[i])});
        }
    return out;
  }

  /// Finds all correspondences within the distance. Returns their RMS distance.
  double associate(double distance, RefineReport& report) {
    PointToPlaneOptions options;
    options.max_distance = distance;
    options.kernel_width = options_.kernel_width * distance / options_.final_distance;
    options.max_normal_angle = options_.max_normal_angle;
    options.max_points = options_.max_points;
    pairs_ = near_pairs(distance);
    sums_ = surfaces_.linearise(pairs_, options);
    report.pairs = report.correspondences = 0;
    double squared = 0;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> overlapping;
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      if (sums_[k].count < options_.min_overlap) sums_[k] = {};
      if (sums_[k].count == 0) continue;
      overlapping.push_back(std::minmax({pairs_[k].source, pairs_[k].target}));
      report.correspondences += sums_[k].count;
      squared += sums_[k].squared_distance;
    }
    std::sort(overlapping.begin(), overlapping.end());
    report.pairs = static_cast<std::size_t>(std::unique(overlapping.begin(), overlapping.end()) -
                                            overlapping.begin());
    return report.correspondences > 0
               ? std::sqrt(squared / static_cast<double>(report.correspondences))
               : 0;
  }

  /// Adds half a squared error with residual Jacobians S and T of source and target; s = S'WS and
  /// so on.
  void add(std::uint32_t source, std::uint32_t target, const Matrix6d& ss, const Matrix6d& tt,
           const Matrix6d& ts, const Vector6d& gs, const Vector6d& gt) {
    const int s = system_.column[source], t = system_.column[target];
    if (s >= 0) {
      matrix_.diagonal[static_cast<std::size_t>(s)] += ss;
      rhs_[static_cast<std::size_t>(s)] -= gs;
    }
    if (t >= 0) {
      matrix_.diagonal[static_cast<std::size_t>(t)] += tt;
      rhs_[static_cast<std::size_t>(t)] -= gt;
    }
    if (s < 0 || t < 0) return;
    const std::pair<int, int> place(std::min(s, t), std::max(s, t));
    const auto at = std::lower_bound(matrix_.pattern.begin(), matrix_.pattern.end(), place);
    // Blocks are of the lower triangle: rows of the larger column.
    Matrix6d& block = matrix_.blocks[static_cast<std::size_t>(at - matrix_.pattern.begin())];
    if (t > s)
      block += ts;
    else
      block += ts.transpose();
  }

  void add_surfaces(const SurfacePair& pair, const PointToPlaneSums& sums) {
    // The relative pose becomes Exp(Ad(target_from_source) x_source) and Exp(-x_target) of itself.
    const Matrix6d by_source =
        pose_graph::adjoint(poses_[pair.target].inverse() * poses_[pair.source]);
    const double point_information =
        1 / (options_.point_noise * options_.point_noise * options_.correlated_points);
    const Matrix6d a = point_information * sums.information, as = a * by_source;
    const Vector6d gradient = point_information * sums.gradient;
    add(pair.source, pair.target, by_source.transpose() * as, a, -as,
        by_source.transpose() * gradient, -gradient);
  }

  void add_edge(std::uint32_t from, std::uint32_t to, const UnalignedIsometry3d& to_from,
                const Matrix6d& information) {
    pose_graph::ModeTerm term;
    term.target_from_source = pose_of(to_from);
    term.inverse = term.target_from_source.inverse();
    term.information = information;
    const auto linear = pose_graph::linearise_edge(poses_[from], poses_[to], term);
    const Vector6d weighted = information * linear.residual;
    // Surfaces may correct an edge by more than its noise: it then counts less.
    const double weight = 1 / (1 + linear.residual.dot(weighted) / kEdgeKernel);
    const Matrix6d source = weight * information * linear.source,
                   target = weight * information * linear.target;
    add(from, to, linear.source.transpose() * source, linear.target.transpose() * target,
        linear.target.transpose() * source, weight * linear.source.transpose() * weighted,
        weight * linear.target.transpose() * weighted);
  }

  void build_pattern() {
    std::vector<std::pair<int, int>>& pattern = matrix_.pattern;
    pattern.clear();
    const auto note = [&](std::uint32_t a, std::uint32_t b) {
      const int s = system_.column[a], t = system_.column[b];
      if (s >= 0 && t >= 0) pattern.emplace_back(std::min(s, t), std::max(s, t));
    };
    for (std::size_t k = 0; k < pairs_.size(); ++k)
      if (sums_[k].count > 0) note(pairs_[k].source, pairs_[k].target);
    for (const Edge& edge : map_.edges)
      if (in_map(edge)) note(edge.source, edge.target);
    for (const Odometry& odometry : map_.odometry)
      if (in_map(odometry)) note(odometry.source, odometry.target);
    std::sort(pattern.begin(), pattern.end());
    pattern.erase(std::unique(pattern.begin(), pattern.end()), pattern.end());
    const auto columns = static_cast<std::size_t>(system_.columns);
    matrix_.diagonal.assign(columns, Matrix6d::Zero());
    matrix_.blocks.assign(pattern.size(), Matrix6d::Zero());
    rhs_.assign(columns, Vector6d::Zero());
  }

  bool in_map(const Edge& edge) const { return edge.accepted && map_.scans[edge.source].placed; }

  bool in_map(const Odometry& odometry) const {
    return odometry.information && map_.scans[odometry.source].placed;
  }

  /// One Gauss-Newton step. Returns the largest component of it; -1 where it cannot be solved.
  double solve() {
    build_pattern();
    for (std::size_t k = 0; k < pairs_.size(); ++k)
      if (sums_[k].count > 0) add_surfaces(pairs_[k], sums_[k]);
    for (const Edge& edge : map_.edges)
      if (in_map(edge))
        add_edge(edge.source, edge.target, edge.target_from_source, edge.information);
    for (const Odometry& odometry : map_.odometry)
      if (in_map(odometry))
        add_edge(odometry.source, odometry.target, odometry.target_from_source,
                 *odometry.information);
    for (Matrix6d& block : matrix_.diagonal) block.diagonal() *= 1 + kDiagonalDamping;
    pose_graph::BlockCholesky cholesky(system_.columns, matrix_.pattern, threads_);
    if (!cholesky.factorise(matrix_)) return -1;
    cholesky.solve(rhs_);
    double largest = 0;
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      if (system_.column[k] < 0) continue;
      const Vector6d& step = rhs_[static_cast<std::size_t>(system_.column[k])];
      if (!step.allFinite()) return -1;
      largest = std::max(largest, step.cwiseAbs().maxCoeff());
      poses_[k] = pose_graph::retract(poses_[k], step);
    }
    return largest;
  }

  Reconstruction& map_;
  const RefineOptions& options_;
  int threads_;
  System system_;
  std::vector<Pose> poses_;
  std::vector<Sphere> spheres_;
  std::vector<std::vector<float>> variances_;
  SurfaceSet surfaces_;
  std::vector<SurfacePair> pairs_;
  std::vector<PointToPlaneSums> sums_;  ///< of each pair
  pose_graph::BlockMatrix matrix_;
  std::vector<Vector6d> rhs_;
};

}  // namespace

RefineReport refine(const Context& context, const std::vector<Surface>& surfaces,
                    Reconstruction& map, const RefineOptions& given) {
  given.validate();
  RefineOptions options = fields::in_units(given, given.voxel_size);
  options.noise_range =
      static_cast<double>(static_cast<float>(given.noise_range) * given.voxel_size);
  if (surfaces.size() != map.scans.size())
    throw InvalidArgument("surfaces has " + std::to_string(surfaces.size()) +
                          " entries, expected one per scan, " + std::to_string(map.scans.size()));
  for (std::size_t k = 0; k < surfaces.size(); ++k)
    if (surfaces[k].points.size() != surfaces[k].normals.size())
      throw InvalidArgument("surfaces[" + std::to_string(k) + "] has " +
                            std::to_string(surfaces[k].points.size()) + " points and " +
                            std::to_string(surfaces[k].normals.size()) + " normals");
  RefineReport report = Refiner(context, surfaces, map, options).run();
  if (!report.solved) return report;
  report.rejected_edges = reject_deviating(map, options.max_edge_error);
  set_confidence(map);
  return report;
}

RefineReport refine(const std::vector<Surface>& surfaces, Reconstruction& map,
                    const RefineOptions& options) {
  options.validate();
  return refine(Context::cpu(static_cast<unsigned>(options.threads)), surfaces, map, options);
}

}  // namespace gpureg::reconstruction
