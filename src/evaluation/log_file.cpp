// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/LU>

#include "evaluation/block_file.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/files.hpp"

namespace gpureg::evaluation {
namespace {

// Published logs carry six digits, so a rotation in them is orthonormal to about 1e-5. The bound
// only tells poses from other numbers (a projection, a scaled or transposed matrix), for which the
// protocol's quaternion would silently mean nothing.
constexpr double kRigidTolerance = 0.02;

void check_rigid(const files::TextFile& file, const Eigen::Matrix4d& t) {
  if ((t.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6)
    file.fail("the last row of a transform is not 0 0 0 1");
  const Eigen::Matrix3d r = t.topLeftCorner<3, 3>();
  const double error = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kRigidTolerance) || r.determinant() < 0)
    file.fail("the transform that ends here is not a rotation and a translation");
}

}  // namespace

std::vector<LogEntry> read_log(const std::string& path) {
  std::vector<LogEntry> entries;
  files::read_blocks<4>(path, [&](const files::TextFile& file, int i, int j, int n,
                                  const Eigen::Matrix4d& transform, int line) {
    check_rigid(file, transform);
    entries.push_back({i, j, n, transform, line});
  });
  return entries;
}

void write_log(const std::string& path, const std::vector<LogEntry>& entries) {
  std::string text;
  for (const LogEntry& e : entries)
    files::append_block(text, e.i, e.j, e.count, e.transform, 10, "transform");
  files::write_atomically(path, text);
}

}  // namespace gpureg::evaluation
