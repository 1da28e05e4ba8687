// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/change.hpp"

#include <iostream>
#include <memory>
#include <optional>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "inputs/initial_poses.hpp"
#include "inputs/map_input.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"
#include "options/output_path.hpp"
#include "options/place_options.hpp"
#include "records/locate_json.hpp"
#include "records/result_json.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

using localization::ChangeLabel;
using localization::ChangeOptions;
using localization::ChangeResult;
using localization::LocateOptions;
using localization::LocateResult;
using localization::LocateStatus;
using localization::MapOptions;
using localization::PointChanges;
using localization::PreparedMap;

constexpr ChangeLabel kLabels[] = {ChangeLabel::same, ChangeLabel::appeared, ChangeLabel::gone,
                                   ChangeLabel::occluded, ChangeLabel::not_observed};

struct Options {
  std::string scan, map, pose, json, scan_ply, map_ply;
  MethodOptions method;
  PlaceOptions place;
  std::optional<double> tolerance;  // none: from the voxel size
  bool recursive = false;
};

Json counts(const PointChanges& changes) {
  Json json{{"points", changes.labels.size()}};
  for (const ChangeLabel label : kLabels)
    json[localization::to_string(label)] = changes.count(label);
  return json;
}

void print(const char* name, const PointChanges& changes) {
  std::cout << pad_right(name, 9);
  const char* before = "";
  for (const ChangeLabel label : kLabels) {
    std::cout << before << localization::to_string(label) << " " << grouped(changes.count(label));
    before = ", ";
  }
  std::cout << "\n";
}

/// The pose of the scan; none: it is not there.
std::optional<UnalignedIsometry3d> locate_scan(const Options& o, const Context& context,
                                               const PointCloudView& scan, const PreparedMap& map,
                                               const LocateOptions& options, Json& record) {
  const LocateResult result =
      localization::locate(context, {scan}, map, options, {o.place.prior()}, {o.scan}).front();
  record["located"] = to_json(result, o.scan);
  std::cout << "status   " << localization::to_string(result.status);
  if (result.status != LocateStatus::found) {
    std::cout << ": not compared. In a place that has changed, --min-confidence asks for less, and "
                 "--pose gives the pose\n";
    return std::nullopt;
  }
  std::cout << ", confidence " << fixed(result.poses.front().confidence, 3) << "\n";
  return result.poses.front().map_from_scan;
}

int run(Options o) {
  o.method.registration();  // what is wrong with it shall be said before clouds are read
  o.place.check();
  if (!o.pose.empty()) {
    const std::string why = "with --pose: the scan is not searched for";
    o.method.refuse({"--quality", "--seed", "--min-confidence", "--up", "--near"}, why);
    o.method.refuse_set_outside({"prepare"}, why);
  }
  check_outputs({{"--json", o.json}, {"--scan-ply", o.scan_ply}, {"--map-ply", o.map_ply}},
                {{"SCAN", o.scan}, {"MAP", o.map}, {"--pose", o.pose}});
  std::optional<UnalignedIsometry3d> pose;
  if (!o.pose.empty()) pose = read_pose(o.pose);
  const Context context = o.method.context();
  const MapInput input(o.map, o.recursive);
  choose_voxel_size(o.method, input, {o.scan});
  const LocateOptions options = locate_options(o.method);
  const MapOptions of_map{o.method.voxel_size, options.registration.prepare};
  ChangeOptions change;
  if (o.tolerance) change.tolerance = *o.tolerance / static_cast<double>(o.method.voxel_size);
  change.validate();
  // A bad scan shall show before the map is prepared.
  PointCloud scan = read_scan(o.scan, context, input.options_or(of_map));
  const PreparedMap map = input.prepare(context, of_map);
  o.place.viewpoint.check_cloud("--viewpoint", scan, o.scan);
  o.place.viewpoint.apply(scan);
  const PointCloudView view = o.place.viewpoint.view(scan);
  Json record;
  record["gpureg"] = "change";
  record["environment"] = environment(context);
  if (!pose) pose = locate_scan(o, context, view, map, options, record);
  if (pose) {
    const ChangeResult result = localization::find_changes(context, view, map, *pose, change);
    std::cout << "inliers  " << percent(result.inlier_ratio) << " %\n";
    print("scan", result.scan);
    print("map", result.map);
    record["map_from_scan"] = to_json(result.map_from_scan.matrix());
    record["inlier_ratio"] = result.inlier_ratio;
    record["scan"] = counts(result.scan);
    record["map"] = counts(result.map);
    if (!o.scan_ply.empty()) localization::write_changes(o.scan_ply, scan, result.scan);
    if (!o.map_ply.empty()) localization::write_changes(o.map_ply, map.cloud(), result.map);
  }
  if (!o.json.empty()) write_document(o.json, record);
  return pose ? kOk : kNoAlignment;
}

}  // namespace

void add_change(CommandLine& line) {
  const auto o = std::make_shared<Options>();
  Verb verb = line.verb("change", "Tell what has changed between a map and a scan");
  verb.option("SCAN", o->scan, "A cloud, or a folder of scans with poses by odometry").required();
  verb.option("MAP", o->map,
              "A cloud, a folder of scans with poses, the output of reconstruct, or a file of "
              "locate --save-map")
      .required();
  verb.flag("--recursive", o->recursive, kRecursiveHelp);
  o->method.add_to(verb);
  o->place.add_to(verb);
  verb.option("--pose", o->pose,
              "File with map_from_scan, a 4 x 4 matrix row by row, which is refined; without, the "
              "scan is located");
  verb.option(
      "--tolerance", o->tolerance,
      "Surfaces closer together are the same, in the unit of the clouds (without: a voxel)");
  verb.option("--scan-ply", o->scan_ply, "Write the scan with labels, probabilities and colours");
  verb.option("--map-ply", o->map_ply, "Write the map with labels, probabilities and colours");
  verb.option("--json", o->json, "Write pose and numbers of points");
  verb.notes("Exit status 0: compared, 1: the scan is not in the map. ");
  verb.run([o] { return run(*o); });
}

}  // namespace gpureg::cli
