// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/rigid.hpp"

#include "common/rigid.hpp"

namespace gpureg::evaluation {
namespace {

// Published logs carry six digits, so a rotation in them is orthonormal to about 1e-5. The bound
// only tells poses from other numbers (a projection, a scaled matrix), for which the
// protocol's quaternion would silently mean nothing.
constexpr double kTolerance = 0.02;

}  // namespace

void check_rigid(const files::TextFile& file, const Eigen::Matrix4d& t) {
  const std::string why = why_not_rigid(t, kTolerance);
  if (!why.empty()) file.fail("the matrix that ends here is no rigid motion: " + why);
}

}  // namespace gpureg::evaluation
