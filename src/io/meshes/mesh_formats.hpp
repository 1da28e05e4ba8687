// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "gpureg/point_cloud.hpp"
#include "io/meshes/polygons.hpp"

/// Mesh files. Every function reads a whole file and throws IoError naming it and, in text, the
/// line. Corners of faces are checked.
namespace gpureg::io {

/// Wavefront: the vertices and faces; materials, of other files, are not looked at.
Polygons read_obj(Source& source);

/// Whether a file of Wavefront has a line of a face; false where it cannot be read.
bool obj_has_faces(const std::string& path);

/// The vertices of a Wavefront file without faces, and the normals where each has one.
PointCloud read_obj_points(Source& source);

/// Object File Format of Geomview, as text: OFF, COFF, NOFF and the like.
bool looks_like_off(std::string_view start);
bool off_has_faces(Source& source);
Polygons read_off(Source& source);
PointCloud read_off_points(Source& source);

/// Stereolithography, binary or text.
Polygons read_stl(Source& source);

/// Vertices of a PLY file, and element face.
Polygons read_ply_mesh(Source& source);

}  // namespace gpureg::io
