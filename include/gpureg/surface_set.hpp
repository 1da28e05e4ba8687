// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "gpureg/context.hpp"
#include "gpureg/result.hpp"

/// Point-to-plane normal equations of many pairs of scans at once: the building block of a joint
/// refinement, for programs that have a solver of their own.
namespace gpureg {

using UnalignedMatrix6d = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;
using UnalignedVector6d = Eigen::Matrix<double, 6, 1, Eigen::DontAlign>;

/// Points and unit normals of a scan in host memory: tight rows of three floats. A point that is
/// not finite or beyond 1e15 m, or has no normal of unit length, takes no part. Sums resolve 2^-40
/// of the squared size of the box of the points: stray points beyond 10,000 times the size of the
/// scan cost the rotation its digits.
struct SurfaceView {
  const float* points = nullptr;   ///< size x 3, metres
  const float* normals = nullptr;  ///< size x 3
  /// Variances of the points over that of the best ones, >= 1; null: all are 1.
  const float* variances = nullptr;
  std::size_t size = 0;
};

/// Points of `source` against the surface of `target`, indices of the set.
struct SurfacePair {
  std::uint32_t source = 0, target = 0;
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
};

struct PointToPlaneOptions {
  double max_distance = 0.1;     ///< of a correspondence, metres, > 0
  double kernel_width = 0.02;    ///< of the Geman-McClure kernel, metres, > 0
  double max_normal_angle = 45;  ///< degrees between the normals of a correspondence, (0, 90]
  /// Points of a source that look for correspondences, evenly chosen, >= 16. Each stands for all
  /// that it was chosen from.
  std::uint32_t max_points = 1500;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Half the weighted squared distances of a pair, linearised for target_from_source <- Exp(x)
/// target_from_source (rotation first): 0.5 x' information x + gradient' x. The unit of a weight is
/// one point of variance 1; divide by the variance of such a point for information in statistical
/// units.
struct PointToPlaneSums {
  UnalignedMatrix6d information = UnalignedMatrix6d::Zero();
  UnalignedVector6d gradient = UnalignedVector6d::Zero();
  std::size_t count = 0;        ///< correspondences
  double squared_distance = 0;  ///< sum over them, point to plane, metres^2
};

/// Scans in the memory of a context. The bits of the sums do not depend on the backend, on the
/// number of threads, or on the other pairs of a call.
///
/// Thread-safe: calls run one after another.
class SurfaceSet {
 public:
  /// @param surfaces their arrays have to outlive the set.
  /// @throws InvalidArgument naming surface and field: a null pointer with a size > 0, more than
  ///   2^31 - 1 points, a variance below 1.
  /// @throws DeviceError if the device has no memory left.
  SurfaceSet(const Context& context, const std::vector<SurfaceView>& surfaces);
  ~SurfaceSet();
  SurfaceSet(SurfaceSet&&) noexcept;
  SurfaceSet& operator=(SurfaceSet&&) noexcept;

  std::size_t size() const;  ///< number of surfaces

  /// @return one entry per pair; no correspondences: zeros.
  /// @throws InvalidArgument naming the pair for indices outside the set and poses that are not
  ///   finite, and as PointToPlaneOptions::validate().
  /// Source: Chen and Medioni 1992.
  std::vector<PointToPlaneSums> linearise(const std::vector<SurfacePair>& pairs,
                                          const PointToPlaneOptions& options = {}) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gpureg
