// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/rigid.hpp"

#include <Eigen/LU>

namespace gpureg::evaluation {
namespace {

// Published logs carry six digits, so a rotation in them is orthonormal to about 1e-5. The bound
// only tells poses from other numbers (a projection, a scaled or transposed matrix), for which the
// protocol's quaternion would silently mean nothing.
constexpr double kRigidTolerance = 0.02;

}  // namespace

void check_rigid(const files::TextFile& file, const Eigen::Matrix4d& t) {
  if ((t.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6)
    file.fail("the last row of a transform is not 0 0 0 1");
  const Eigen::Matrix3d r = t.topLeftCorner<3, 3>();
  const double error = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kRigidTolerance) || r.determinant() < 0)
    file.fail("the transform that ends here is not a rotation and a translation");
}

}  // namespace gpureg::evaluation
