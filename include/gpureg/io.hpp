// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gpureg/point_cloud.hpp"

/// Component `io`: readers of clouds and lists, a writer of clouds. Needs no other library; every
/// function is thread-safe.
namespace gpureg::io {

/// A scan of a file that holds several.
struct StoredScan {
  /// Without alignment, as UnalignedIsometry3d.
  using Pose = Eigen::Matrix<double, 4, 4, Eigen::DontAlign>;
  std::string name;        ///< may be empty
  std::size_t points = 0;  ///< that the file announces; of PTX rows without a return are among them
  /// Pose of the scan in the frame of its file, metres; none if the file gives none.
  std::optional<Pose> file_from_scan;
};

/// The scans of a file of a format that can hold several: PTX, E57 (of which no point is read).
/// Empty for any other file.
/// @throws IoError if the file cannot be read, or its list of scans is damaged.
std::vector<StoredScan> scans_in(const std::string& path);

/// Number of scans of a file: that of scans_in(), and 1 for formats that hold one.
/// @throws IoError as scans_in() does.
std::size_t count_scans(const std::string& path);

/// A scan of a file as the command and Python name it.
struct ScanPath {
  std::string file;
  std::size_t part = 0;  ///< from 1; 0: the only scan of the file
};

/// "project.e57#2" is the second scan of project.e57, unless a file has that very name.
ScanPath scan_path(const std::string& path);

/// Reads a PLY (text or binary of either byte order; of a mesh the vertices, see mesh.hpp for its
/// faces) or PCD file (text, binary, compressed); of these two the content decides, not the
/// extension. Coordinates of any numeric type become float; if that is too coarse, as for those
/// of maps, the cloud gets an origin first. Normals are read if the file has them. Points with a
/// NaN or infinite coordinate stay; prepare() drops them. A file that is neither and ends in .bin
/// is a scan of KITTI (rows of float32 x y z reflectance) or of nuScenes (x y z intensity ring), or
/// has rows of three or six numbers: the columns of 64 rows or more tell, and if they do not,
/// the file is refused. The VIEWPOINT of a PCD becomes the viewpoint unless it is the origin; the
/// scanner of a PTX is its viewpoint. Rows of numbers in text (XYZ, TXT, ASC, CSV, PTS) are read,
/// and OBJ and OFF without faces. Memory is bounded by the size of the file.
/// @param path may name a scan, see scan_path().
/// @param part of a file that holds several scans (PTX): the scan, from 1. 0: the only one.
/// @param note gets what is strange about a file that is read nonetheless, such as rows after the
///   last one that its header announces; empty if nothing is.
/// @throws IoError naming file (and line, in text) and reason: missing, empty, truncated, a false
///   count in the header, no x y z, several scans and none named (with a list of them), no such
///   scan; of formats that are not read, what to do.
PointCloud read_point_cloud(const std::string& path, std::size_t part = 0,
                            std::string* note = nullptr);

/// What the coordinates of a file have lost to float32: beyond 1e5, and with less than 2^17 steps
/// across the cloud. Coordinates of finer types have an origin then, and lose nothing.
/// @return a sentence for a note, with a remedy; empty if they are fine enough.
std::string coarse_coordinates(const PointCloud& cloud);

/// Writes a binary PLY with x y z (and normals if the cloud has them), all or nothing. x y z are
/// float32, or double if the cloud has an origin.
/// @throws IoError if writing fails.
/// @throws InvalidArgument if the number of normals is neither 0 nor that of the points.
void write_point_cloud(const std::string& path, const PointCloud& cloud);

/// One scan of a folder, a list or a file.
struct ScanFile {
  int number = 0;    ///< what files of results call it; see list_scans()
  std::string path;  ///< as read_point_cloud() takes it: "a.e57#2" of a file with several scans
  std::string name;  ///< for people: of the file, or what a list calls it; unique
};

/// Lists the scans of
/// - a folder: its files cloud_bin_<i> with their numbers, and if it has none, all its clouds
/// and
///   meshes in natural order (scan2 before scan10) but for hidden files. Names that differ by a
///   number alone keep it (scan_12.ply is 12); else numbers count from 0. Of a file with several
///   scans each is one, "a.e57#2". Recursive: clouds of subfolders too, whose names have the
///   path.
/// - a pattern, as "scans/*.ply" or "scans/**/*.pcd", likewise.
/// - a list: a text file with one path a line, relative to its folder, and perhaps a name after it;
///   lines that begin with # are comments. Numbers count the lines from 0.
/// - a file with several scans.
/// @param notes receives sentences about what was skipped; may be null.
/// @return ascending by number.
/// @throws IoError saying what was found instead and what to do: no cloud, a number or a scan
/// twice,
///   a missing file of a list.
std::vector<ScanFile> list_scans(const std::string& path, bool recursive = false,
                                 std::vector<std::string>* notes = nullptr);

/// Whether a path names several scans as list_scans() takes them: a folder, a pattern, or a list,
/// which is a text whose first rows are no points. A file with several scans is none of these.
bool names_scans(const std::string& path);

/// Folder of such a path, if files beside the scans are: cameras.txt, poses.txt.
std::string folder_of_scans(const std::string& path);

/// Place of the scan that a word of a text file means: digits are a number; else its name, with or
/// without folder and extension, if no other scan has it too. None: there is no such scan.
std::optional<std::size_t> find_scan(const std::vector<ScanFile>& scans, std::string_view word);

/// Reads cameras.txt: lines `fragment frame tx ty tz qx qy qz qw` (fragment_from_camera); '#'
/// starts a comment.
/// @param scans of which a fragment is one, by number or name, see find_scan(); empty: numbers
/// alone.
/// @return camera positions of each fragment by number, metres, in the order of the file.
/// @throws IoError naming file and line.
std::map<int, std::vector<Eigen::Vector3d>> read_cameras(const std::string& path,
                                                         const std::vector<ScanFile>& scans = {});

/// Reads pairs: one `i j` per line, i != j; '#' starts a comment.
/// @param scans as for read_cameras().
/// @throws IoError naming file and line.
std::vector<std::pair<int, int>> read_pairs(const std::string& path,
                                            const std::vector<ScanFile>& scans = {});

}  // namespace gpureg::io
