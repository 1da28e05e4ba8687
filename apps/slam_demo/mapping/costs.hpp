// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include "mapping/bundle.hpp"

/// The residuals of bundle.cpp, each over its standard deviation.
namespace slam_demo {

// Standard deviation of inverse depths, 1/m. Structured light measures disparities, so their noise
// is that of inverse depth; this is 1/6 px of a Kinect (focal length times baseline: 43 m px).
constexpr double kInverseDepthSigma = 0.004;
constexpr double kHuber =
    2.8;  // standard deviations: the root of the 95 % quantile of three numbers

// Prior of the calibration, 1/m: an offset (a Kinect's are 1 to 2 cm at 3 m), and the difference of
// neighbouring nodes. Ten and two times what cameras show: only nodes that nothing sees need them.
constexpr double kNodeSigma = 0.01, kNeighbourSigma = 0.002;

// Prior of the lens: fx fy cx cy, pixels, k1 k2. Cameras of one kind differ by this, and a focal
// length that somebody guessed. Pixels are square to a part in 500.
constexpr Lens kLensSigma = {10, 10, 10, 10, 0.1, 0.2};
constexpr double kAspectSigma = 1;

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

/// Of a camera whose lens is unknown, and its offsets of inverse depth: those of the four nodes
/// around.
struct CalibratedSightCost {
  const Pinhole camera;
  const Measurement m;
  const Eigen::Vector2d image;  // where the image itself has it, pixels
  const std::array<DepthCalibration::Weight, 4> around;
  const double corrected;  // offset that m.depth is without already, 1/m
  template <class T>
  bool operator()(const T* pose, const T* point, const T* lens, const T* a, const T* b, const T* c,
                  const T* d, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(pose);
    const Eigen::Map<const Vector3<T>> t(pose + 4), x(point);
    const Vector3<T> p = q * x + t;
    const T inverse = T(1) / p.z(), sigma = T(m.sigma);
    const T u = p.x() * inverse, v = p.y() * inverse, r = u * u + v * v,
            scale = T(1) + r * (lens[4] + r * lens[5]);
    residual[0] = ((camera.fx + lens[0]) * u * scale + camera.cx + lens[2] - image.x()) / sigma;
    residual[1] = ((camera.fy + lens[1]) * v * scale + camera.cy + lens[3] - image.y()) / sigma;
    residual[2] = T(0);
    if (m.depth <= 0) return true;
    const T offset =
        around[0].share * *a + around[1].share * *b + around[2].share * *c + around[3].share * *d;
    residual[2] = (inverse - 1 / m.depth + offset - corrected) / kInverseDepthSigma;
    return true;
  }
};

/// A lens is near what is known of it.
struct LensCost {
  const Lens expected;
  template <class T>
  bool operator()(const T* lens, T* residual) const {
    for (std::size_t k = 0; k < expected.size(); ++k)
      residual[k] = (lens[k] - expected[k]) / kLensSigma[k];
    residual[expected.size()] = (lens[0] - lens[1] - expected[0] + expected[1]) / kAspectSigma;
    return true;
  }
};

/// Two neighbouring nodes are alike.
struct SmoothCost {
  template <class T>
  bool operator()(const T* a, const T* b, T* residual) const {
    *residual = (*a - *b) / T(kNeighbourSigma);
    return true;
  }
};

/// A node is near what is known of it.
struct NodeCost {
  const double expected;
  template <class T>
  bool operator()(const T* node, T* residual) const {
    *residual = (*node - T(expected)) / T(kNodeSigma);
    return true;
  }
};

inline ceres::CostFunction* pose_cost(const Pinhole& camera, const PointMatch& match) {
  if (match.seen.depth > 0)
    return new ceres::AutoDiffCostFunction<PoseCost<3>, 3, 7>(new PoseCost<3>{camera, match});
  return new ceres::AutoDiffCostFunction<PoseCost<2>, 2, 7>(new PoseCost<2>{camera, match});
}

inline ceres::CostFunction* sight_cost(const Pinhole& camera, const Measurement& m) {
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

inline ceres::Manifold* pose_manifold() {
  return new ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>();
}

}  // namespace slam_demo
