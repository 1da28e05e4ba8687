// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gpureg/point_cloud.hpp"

/// Component `io`: clouds in, overlays out, the fragments of a scene folder. Needs no other
/// library; every function is thread-safe.
namespace gpureg::io {

/// Reads PLY (text, binary of either byte order; meshes give their vertices) or PCD (text, binary,
/// compressed), told apart by content. Coordinates of any numeric type become float. Normals come
/// along where the file has them; points that are not finite stay (prepare() drops them). A PCD's
/// VIEWPOINT away from the origin becomes the one viewpoint. Memory is bounded by the file's size.
/// Throws IoError naming file (and line, in text) and reason: missing, empty, truncated, a header
/// that lies about the count, no x y z.
PointCloud read_point_cloud(const std::string& path);

/// Writes binary PLY with float32 x y z (and normals where the cloud has them), all or nothing.
/// Throws IoError, and InvalidArgument where there are normals but not one per point.
void write_point_cloud(const std::string& path, const PointCloud& cloud);

/// Source moved by target_from_source (yellow) over target (blue) in one coloured binary PLY,
/// without the points that are not finite. Throws IoError.
void write_overlay(const std::string& path, const PointCloud& source, const PointCloud& target,
                   const Eigen::Isometry3d& target_from_source);

/// Number and path of cloud_bin_<i>.ply|pcd in a folder, ascending by number. Throws IoError where
/// there is none or a number is twice.
std::vector<std::pair<int, std::string>> list_fragments(const std::string& folder);

/// cameras.txt: `fragment frame tx ty tz qx qy qz qw` (fragment_from_camera); returns the camera
/// positions of each fragment, in the order of the file. '#' starts a comment. Throws IoError
/// naming file and line.
std::map<int, std::vector<Eigen::Vector3f>> read_cameras(const std::string& path);

/// Indices `i j` per line, i != j; '#' starts a comment. Throws IoError naming file and line.
std::vector<std::pair<int, int>> read_pairs(const std::string& path);

}  // namespace gpureg::io
