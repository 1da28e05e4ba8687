// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "command.hpp"
#include "gpureg/context.hpp"
#include "gpureg/io.hpp"
#include "gpureg/preparation/sensor_fixed.hpp"
#include "gpureg/voxel_size.hpp"
#include "inputs/cloud_file.hpp"
#include "options/output_path.hpp"
#include "run/sensor_fixed_note.hpp"
#include "run/spacing.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

std::string describe(const Eigen::Vector3d& v, int digits) {
  return significant(v.x(), digits) + " " + significant(v.y(), digits) + " " +
         significant(v.z(), digits);
}

/// Of a file that holds several scans.
void print_scans(const std::string& path, const std::vector<io::StoredScan>& scans) {
  std::cout << path << "\n  scans            " << scans.size() << ", named " << path << "#1 to "
            << path << "#" << scans.size() << "\n";
  for (std::size_t k = 0; k < scans.size(); ++k) {
    const io::StoredScan& scan = scans[k];
    std::cout << "  #" << k + 1 << (scan.name.empty() ? "" : " " + scan.name) << ": "
              << grouped(scan.points) << " points";
    if (scan.file_from_scan)
      std::cout << ", scanned from "
                << describe(Eigen::Vector3d(scan.file_from_scan->topRightCorner<3, 1>()), 10);
    std::cout << "\n";
  }
}

/// Returns the cloud; of a file that holds several scans, none.
PointCloud print_cloud(const std::string& path) {
  const std::vector<io::StoredScan> scans = io::scans_in(io::scan_path(path).file);
  if (scans.size() > 1 && io::scan_path(path).part == 0) {
    print_scans(path, scans);
    return {};
  }
  PointCloud cloud = read_cloud(path, 0, MeshNote::print);
  const std::vector<Eigen::Vector3f> points = finite_points(cloud.points);
  std::cout << path << "\n  points           " << grouped(cloud.points.size())
            << (cloud.normals.empty() ? ", without normals" : ", with normals") << "\n"
            << "  not finite       " << grouped(cloud.points.size() - points.size()) << "\n";
  if (points.empty()) return cloud;
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : points) box.extend(p);
  const Eigen::Vector3d low = box.min().cast<double>() + cloud.origin,
                        high = box.max().cast<double>() + cloud.origin;
  const int digits = cloud.origin.isZero(0) ? 4 : 10;
  const VoxelSizeSuggestion suggestion = suggest_voxel_size({cloud.view()});
  std::cout << "  extent           " << describe((high - low).eval(), 4) << ", from "
            << describe(low, digits) << " to " << describe(high, digits) << "\n  spacing          "
            << (suggestion.valid() ? significant(suggestion.spacing, 3) +
                                         " (median distance to the nearest neighbour)"
                                   : std::string("none, ") + explain(suggestion.reason))
            << "\n";
  if (const RangeLimits limits = range_limits(cloud.view()); limits.points() > 0)
    std::cout << "  without return   "
              << at_range_limits(limits.points(), limits.smallest_range, limits.largest_range)
              << " (left out)\n";
  if (!suggestion.valid()) return cloud;
  if (suggestion.flat)
    std::cout << "  flat             a scan of a 2-D scanner: poses stay in its plane\n";
  std::cout << "  noise            " << significant(suggestion.noise, 2)
            << (suggestion.flat ? " (median distance from the line of the surroundings)\n"
                                : " (median distance from the plane of the surroundings)\n")
            << "  suggested        --voxel-size "
            << significant(static_cast<double>(suggestion.voxel_size), 3) << " (leaves about "
            << grouped(suggestion.points)
            << (suggestion.flat ? " points in layers)\n" : " points)\n");
  return cloud;
}

/// Scans that are compared, so that a long list does not fill the memory.
constexpr std::size_t kComparedScans = 32;

void print_fixed_parts(const std::vector<std::string>& paths,
                       const std::vector<PointCloud>& clouds) {
  const std::vector<PointCloudView> views = views_of(clouds);
  const FixedParts parts = find_fixed_parts(views);
  for (std::size_t k = 0; k < views.size(); ++k)
    if (const std::size_t rows = rows_in(parts, views[k]).size(); rows > 0)
      std::cout << paths[k] << "\n  fixed to sensor  " << grouped(rows) << " points ("
                << percent(static_cast<double>(rows) / static_cast<double>(views[k].size))
                << " %) at the same place in most of these scans (left out of sets)\n";
}

int run(const std::vector<std::string>& clouds) {
  if (clouds.empty()) {
    std::cout << "gpureg " GPUREG_VERSION "\n";
    for (const std::string& line : describe_backends()) std::cout << line << "\n";
  }
  std::vector<NamedPath> inputs;
  for (const std::string& path : clouds) inputs.push_back({"CLOUD", path});
  check_outputs({}, inputs);
  std::vector<PointCloud> compared;
  for (const std::string& path : clouds) {
    PointCloud cloud = print_cloud(path);
    if (compared.size() < kComparedScans) compared.push_back(std::move(cloud));
  }
  print_fixed_parts(clouds, compared);
  return kOk;
}

}  // namespace

void add_info(CommandLine& line) {
  const auto clouds = std::make_shared<std::vector<std::string>>();
  Verb verb = line.verb("info", "Describe clouds; without any, version and devices");
  verb.option("CLOUD", *clouds,
              "Clouds (PLY, PCD, LAS, E57, PTX, text, KITTI .bin) or meshes (STL, OBJ, OFF, PLY)");
  verb.run([clouds] { return run(*clouds); });
}

}  // namespace gpureg::cli
