// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>

#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "io/clouds/foreign.hpp"
#include "io/clouds/kitti.hpp"
#include "io/clouds/pcd.hpp"
#include "io/clouds/ptx.hpp"
#include "io/clouds/text_cloud.hpp"
#include "io/extension.hpp"
#include "io/limits.hpp"
#include "io/meshes/mesh_formats.hpp"
#include "io/ply.hpp"

namespace gpureg::io {
namespace {

/// Notepad and spreadsheets begin a text with it.
constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";

constexpr std::array kText = {".xyz", ".txt", ".csv", ".asc", ".pts", ".xyzn", ".xyzrgb", ".dat"};
/// Their content would have told.
constexpr std::array kOthers = {".ply", ".pcd", ".stl", ".obj", ".off", ".ptx"};

template <std::size_t Count>
bool is_among(const std::string& extension, const std::array<const char*, Count>& names) {
  return std::find(names.begin(), names.end(), extension) != names.end();
}

/// Of a PTX of which no scan is named. source is at its begin.
void check_only(Source source, const std::string& file) {
  const std::size_t scans = index_ptx(source).size();
  if (scans > 1)
    source.fail("it holds " + std::to_string(scans) + " scans: name one of them, '" + file +
                "#1' to '#" + std::to_string(scans) + "'");
}

enum class Format { unknown, ply, pcd, ptx, off, obj, rows, text };

/// rows: those of KITTI and nuScenes.
Format format_of(const std::string& file, std::string_view start) {
  if (start.substr(0, 3) == "ply") return Format::ply;
  if (looks_like_pcd(start)) return Format::pcd;
  if (looks_like_ptx(start)) return Format::ptx;
  if (looks_like_off(start)) return is_mesh(file) ? Format::unknown : Format::off;
  if (!foreign_format(file, start).empty()) return Format::unknown;
  if (looks_like_kitti(file)) return Format::rows;
  const std::string extension = extension_of(file);
  if (extension == ".obj" && !is_mesh(file)) return Format::obj;
  if (is_among(extension, kOthers)) return Format::unknown;
  const bool binary = start.find('\0') != start.npos;
  return looks_like_text_cloud(start) || (is_among(extension, kText) && !binary) ? Format::text
                                                                                 : Format::unknown;
}

PointCloud read(Format format, const std::string& file, Source& source, std::size_t scan) {
  switch (format) {
    case Format::ply:
      return read_ply(source);
    case Format::pcd:
      return read_pcd(source);
    case Format::ptx:
      return read_ptx(source, scan);
    case Format::off:
      return read_off_points(source);
    case Format::obj:
      return read_obj_points(source);
    case Format::rows:
      return read_kitti(source);
    default:
      return read_text_cloud(file, source);
  }
}

/// What is neither recognised nor text.
[[noreturn]] void fail_unknown(const Source& source, const std::string& path,
                               std::string_view start) {
  const std::string foreign = foreign_format(path, start);
  if (!foreign.empty()) source.fail(foreign);
  if (is_mesh(path)) source.fail("a mesh, which read_mesh reads");
  source.fail(
      "neither a PLY nor a PCD file, nor a scan of KITTI (.bin), nor rows of numbers x y z");
}

}  // namespace

// The library decodes the body itself: the readers of PCL allocate by the counts of the header,
// print to the console, and need VTK at link time. They are the oracle of the tests.
PointCloud read_point_cloud(const std::string& path, std::size_t part, std::string* note) {
  const ScanPath scan = scan_path(path);
  const std::string& file = scan.file;
  if (scan.part != 0 && part != 0 && scan.part != part)
    throw InvalidArgument("part is " + std::to_string(part) + ", but " + path + " names another");
  part = std::max(part, scan.part);
  // What is not recognised is not read as a whole.
  const std::string start = files::read_start(file, kMostHeaderBytes);
  const Source named(file, start);
  if (start.empty()) named.fail("the file is empty");
  const bool has_mark = start.compare(0, kUtf8Mark.size(), kUtf8Mark) == 0;
  const std::string_view text = std::string_view(start).substr(has_mark ? kUtf8Mark.size() : 0);
  const Format format = format_of(file, text);
  if (format == Format::unknown) fail_unknown(named, file, start);
  const std::string bytes = files::read_file(file, kMostDataBytes);
  Source source(file, bytes);
  if (has_mark && format != Format::rows) source.skip(kUtf8Mark.size());
  if (format != Format::ptx && part > 1)
    source.fail("it holds one scan, there is no scan " + std::to_string(part));
  if (format == Format::ptx && part == 0) check_only(source, file);
  PointCloud cloud = read(format, file, source, std::max<std::size_t>(part, 1) - 1);
  if (note != nullptr) *note = source.notes();
  return cloud;
}

}  // namespace gpureg::io
