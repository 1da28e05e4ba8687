// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "gpureg/point_cloud.hpp"

namespace gpureg::cli {

/// Says on stderr what became of the faces of a mesh, where coordinates are coarse, and what else
/// is strange about a file; or nothing.
enum class MeshNote { print, none };

/// Reads a cloud, or samples the faces of a mesh.
/// @param path may name a scan of a file that holds several, as "project.e57#2".
/// @param spacing of the samples of a mesh, see io::sample_mesh.
/// @throws IoError naming the file.
PointCloud read_cloud(const std::string& path, double spacing, MeshNote note);

/// Says on stderr where the coordinates of a file have lost their digits to float32.
void note_coarse(const PointCloud& cloud, const std::string& path);

/// Spacing of the samples of a mesh that becomes a cloud of this voxel size: about four points in
/// each voxel that the surface passes. 0 for a voxel size of 0.
double mesh_spacing(float voxel_size);

}  // namespace gpureg::cli
