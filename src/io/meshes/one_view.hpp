// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/mesh.hpp"

namespace gpureg::io {

/// Whether a mesh is what one depth image shows, exported with its faces: open, nearly all of its
/// area turned to the origin, and in nearly every direction from there only one surface.
/// @param points of the faces, uniform by area, in the frame of the mesh.
bool is_one_view(const SurfaceMesh& mesh, const std::vector<Eigen::Vector3d>& points,
                 const std::vector<Eigen::Vector3f>& normals);

}  // namespace gpureg::io
