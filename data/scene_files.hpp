// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

/// The plain files of a scene. All or nothing: a file under its final name is complete. Throw
/// IoError.
namespace gpureg::synthetic {

/// Makes the folder, tells of clouds of a larger scene that would stay, and removes ground truth
/// that no longer belongs to the clouds.
void open_folder(const std::string& folder, int fragments, bool rgbd);

/// Binary little-endian PLY, float32 x y z, and nx ny nz where there are normals.
void write_cloud(const std::string& path, const std::vector<Eigen::Vector3f>& points,
                 const std::vector<Eigen::Vector3f>& normals = {});

/// poses.txt: blocks of five lines, the number and world_from_fragment.
void write_poses(const std::string& path,
                 const std::vector<Eigen::Isometry3d>& world_from_fragment);

/// cameras.txt: `fragment frame tx ty tz qx qy qz qw`, w >= 0.
void write_cameras(const std::string& path,
                   const std::vector<std::vector<Eigen::Isometry3d>>& fragment_from_camera);

/// The unit quaternion (x, y, z, w) with w >= 0.
Eigen::Vector4d quaternion(const Eigen::Isometry3d& pose);

}  // namespace gpureg::synthetic
