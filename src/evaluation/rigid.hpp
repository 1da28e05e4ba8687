// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "files/text_file.hpp"

namespace gpureg::evaluation {

/// Throws IoError of the file's current line unless t is a rotation and a translation.
void check_rigid(const files::TextFile& file, const Eigen::Matrix4d& t);

}  // namespace gpureg::evaluation
