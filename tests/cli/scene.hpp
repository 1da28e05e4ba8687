// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gpureg/point_cloud.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::test {

/// What the clouds below are made for: they keep some 2,000 points, and a pair takes some ten
/// milliseconds.
inline const std::vector<std::string> kSmall = {"--voxel-size", "0.1", "--backend", "cpu"};
inline const std::vector<std::string> kLoopsmart = {"--preset", "loopsmart", "--set",
                                                    "quadruples=40000"};

std::vector<std::string> joined(std::vector<std::string> a, const std::vector<std::string>& b);

/// A scan of the room of support/scan.hpp, seen from the origin of its own frame; same number, same
/// bytes. Different numbers share no point, and each misses another slice of the room.
/// @param size of the room, as factors: another one is another room.
PointCloud room_scan(int number, const Eigen::Vector3f& size = Eigen::Vector3f::Ones());

/// Where room_scan(number) has its frame in the room.
Eigen::Isometry3d scan_from_room(int number, const Eigen::Vector3f& size = Eigen::Vector3f::Ones());

/// Scans first, ... of another room.
void write_scans_of_another_room(const TemporaryFolder& folder, int first, int count);

/// Thin sticks in all directions: a wall or a floor finds next to nothing to lie on.
PointCloud sticks();

/// Writes cloud_bin_0.ply, ... and returns nothing but true files: `scans` scans of the room, then
/// sticks, then two points alone.
void write_scans(const TemporaryFolder& folder, int scans, bool with_hopeless_ones);

/// Writes a cloud as PLY and returns its path.
std::string write_cloud(const TemporaryFolder& folder, const std::string& name,
                        const PointCloud& cloud);

nlohmann::json json_of(const std::string& path);

/// The data of a page of the command.
nlohmann::json data_of(const std::string& page);
/// Nothing on the page comes from elsewhere, and no mark of its template is left.
void expect_self_contained(const std::string& page);

/// A result of `batch --json` without what the clock, the machine and the number of threads decide.
nlohmann::json without_times(nlohmann::json document);

}  // namespace gpureg::test
