// SPDX-License-Identifier: BSD-3-Clause
#include "files/text_file.hpp"
#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "io/clouds/kitti.hpp"
#include "io/clouds/pcd.hpp"
#include "io/limits.hpp"
#include "io/ply.hpp"

namespace gpureg::io {

// The library decodes the body itself: the readers of PCL allocate by the counts of the header,
// print to the console, and need VTK at link time. They are the oracle of the tests.
PointCloud read_point_cloud(const std::string& path) {
  // What has no header is not read as a whole.
  const std::string start = files::read_start(path, kMostHeaderBytes);
  const Source named(path, start);
  if (start.empty()) named.fail("the file is empty");
  const bool ply = start.compare(0, 3, "ply") == 0, pcd = !ply && looks_like_pcd(start);
  if (!ply && !pcd && !looks_like_kitti(path)) {
    if (is_mesh(path)) named.fail("a mesh, which read_mesh reads");
    named.fail("neither a PLY nor a PCD file, nor a scan of KITTI (.bin)");
  }
  const std::string bytes = files::read_file(path, kMostDataBytes);
  Source source(path, bytes);
  return ply ? read_ply(source) : pcd ? read_pcd(source) : read_kitti(source);
}

}  // namespace gpureg::io
