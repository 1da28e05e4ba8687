// SPDX-License-Identifier: BSD-3-Clause
#include "files/text_file.hpp"
#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "io/kitti.hpp"
#include "io/pcd.hpp"
#include "io/ply.hpp"

namespace gpureg::io {

// The library decodes the body itself: the readers of PCL allocate by the counts of the header,
// print to the console, and need VTK at link time. They are the oracle of the tests.
PointCloud read_point_cloud(const std::string& path) {
  const std::string bytes = files::read_file(path, std::size_t{1} << 36);
  Source source(path, bytes);
  if (bytes.empty()) source.fail("the file is empty");
  if (bytes.compare(0, 3, "ply") == 0) return read_ply(source);
  if (looks_like_pcd(bytes)) return read_pcd(source);
  if (looks_like_kitti(path)) return read_kitti(source);
  if (is_mesh(path)) source.fail("a mesh, which read_mesh reads");
  source.fail("neither a PLY nor a PCD file, nor a scan of KITTI (.bin)");
}

}  // namespace gpureg::io
