// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "io/meshes/polygons.hpp"

/// Mesh files. Every function reads a whole file and throws IoError naming it and, in text, the
/// line. Corners of faces are checked.
namespace gpureg::io {

/// Wavefront: the vertices and faces; materials, of other files, are not looked at.
Polygons read_obj(Source& source);

/// Stereolithography, binary or text.
Polygons read_stl(Source& source);

/// Vertices of a PLY file, and element face.
Polygons read_ply_mesh(Source& source);

}  // namespace gpureg::io
