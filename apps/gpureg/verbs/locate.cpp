// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "gpureg/localization.hpp"
#include "inputs/cloud_file.hpp"
#include "inputs/map_input.hpp"
#include "json/fields_json.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"
#include "options/method_options.hpp"
#include "options/output_path.hpp"
#include "options/place_options.hpp"
#include "records/locate_json.hpp"
#include "records/pose_text.hpp"
#include "records/result_json.hpp"
#include "run/viewpoint_note.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

using localization::LocatedPose;
using localization::LocateOptions;
using localization::LocatePrior;
using localization::LocateResult;
using localization::LocateStatus;
using localization::MapOptions;
using localization::PreparedMap;
using localization::SearchStage;

/// A cloud, or scans with poses by odometry, which become one.
struct LocatedScan {
  std::string path, name;
};

struct LocateRun {
  std::vector<std::string> files;  // scans, then the map
  std::vector<LocatedScan> scans;  // found in these files
  bool recursive = false;
  MethodOptions method;
  PlaceOptions place;
  std::string json, save_map;

  const std::string& map() const { return files.back(); }
};

/// Of a folder, a pattern or a list without poses, and of a file with several scans, every scan is
/// looked for.
std::vector<LocatedScan> scans_in(const LocateRun& o) {
  std::vector<LocatedScan> out;
  for (std::size_t k = 0; k + 1 < o.files.size(); ++k) {
    const std::string& file = o.files[k];
    const ScanInput input{file, o.recursive && std::filesystem::is_directory(file)};
    const bool one = io::names_scans(file)
                         ? has_poses(input)
                         : io::scan_path(file).part > 0 || io::count_scans(file) < 2;
    if (one) {
      out.push_back({file, base_name(file)});
      continue;
    }
    for (const io::ScanFile& scan : input.list(false)) out.push_back({scan.path, scan.name});
  }
  return out;
}

Eigen::Vector3d sides_of(const PointCloud& cloud) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : cloud.points)
    if (p.allFinite()) box.extend(p);
  return box.isEmpty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(box.sizes().cast<double>());
}

std::string extent_text(const Eigen::Vector3d& sides) {
  return significant(sides.x(), 3) + " x " + significant(sides.y(), 3) + " x " +
         significant(sides.z(), 3);
}

/// Share of the scan that lies on the map at the first pose.
double share_on_map(const LocateResult& result) {
  return result.poses.front().verification.evidence.source_overlap;
}

/// Found, with enough of the scan on the map. A scan that is larger than the map may be the map.
bool is_well(const LocateResult& result) {
  constexpr double kMostlyElsewhere = 0.3;
  return result.status == LocateStatus::found && share_on_map(result) >= kMostlyElsewhere;
}

/// A scan and the map that it was looked for in.
struct Search {
  LocatedScan scan;
  LocateResult result;
  Eigen::Vector3d scan_sides, map_sides;  ///< of the boxes around their points

  std::string sides() const {
    return "the scan extends over " + extent_text(scan_sides) + ", the map over " +
           extent_text(map_sides);
  }
  /// By more than what a scan sees beyond the edge of a map.
  bool scan_is_larger() const { return scan_sides.maxCoeff() > 2 * map_sides.maxCoeff(); }

  /// What is to be asked before the place is believed; empty: nothing.
  std::string question() const {
    constexpr double kLittle = 0.05;
    if (is_well(result)) return "";
    if (result.status != LocateStatus::found) return "";
    if (!scan_is_larger() && share_on_map(result) >= kLittle) return "";
    return "only " + percent(share_on_map(result)) + " % of the scan lies on the map, and " +
           sides() + ": is the map the last argument, and are both in one unit?";
  }
  /// In words of LocateStatus, but for a place in question.
  std::string status() const {
    return question().empty() ? localization::to_string(result.status) : "in_question";
  }
  bool found() const { return status() == localization::to_string(LocateStatus::found); }
};

std::string searched_text(const LocateResult& result) {
  if (result.stage == SearchStage::from_above) return "seen from above";
  return std::to_string(result.tiles) + (result.tiles == 1 ? " tile" : " tiles") + " searched";
}

void print(const Search& search) {
  const LocateResult& result = search.result;
  std::cout << "scan     " << search.scan.path << ": " << grouped(result.scan_points) << " points, "
            << searched_text(result) << "\nstatus   " << search.status();
  if (const std::string question = search.question(); !question.empty())
    std::cout << ": " << question << "\n";
  else
    std::cout << ", not at any of these poses with probability "
              << fixed(result.absent_probability, 3) << "\n";
  if (result.status == LocateStatus::not_found)
    std::cout << "sizes    " << search.sides()
              << (search.scan_is_larger() ? ": is the map the last argument?\n" : "\n");
  constexpr std::size_t kShown = 3;
  for (std::size_t k = 0; k < std::min(kShown, result.poses.size()); ++k) {
    const LocatedPose& pose = result.poses[k];
    std::cout << "pose " << k + 1 << "   confidence " << fixed(pose.confidence, 3)
              << (pose.alias ? ", an alias of pose 1" : "") << ", inliers "
              << percent(pose.verification.inlier_ratio) << " %, map_from_scan\n";
    std::cout << pose_text(pose.map_from_scan.matrix());
  }
}

std::vector<PointCloud> read_scans(const LocateRun& o, const Context& context,
                                   const MapOptions& of_map, const LocateOptions& options) {
  std::vector<PointCloud> clouds;
  ViewpointNote note;
  for (const LocatedScan& scan : o.scans) {
    clouds.push_back(read_scan(scan.path, context, of_map));
    o.place.viewpoint.check_cloud("--viewpoint", clouds.back(), scan.path);
    o.place.viewpoint.apply(clouds.back());
    if (options.registration.prepare.depth_maps > 0) note.see(clouds.back(), scan.path);
  }
  note.print();
  return clouds;
}

std::vector<LocateResult> locate_all(const LocateRun& o, const Context& context,
                                     const std::vector<PointCloud>& clouds, const PreparedMap& map,
                                     const LocateOptions& options) {
  std::vector<PointCloudView> views;
  std::vector<std::string> paths;
  for (const PointCloud& cloud : clouds) views.push_back(o.place.viewpoint.view(cloud));
  for (const LocatedScan& scan : o.scans) paths.push_back(scan.path);
  return localization::locate(context, views, map, options,
                              std::vector<LocatePrior>(views.size(), o.place.prior()), paths);
}

void write_json(const LocateRun& o, const Context& context, const PreparedMap& map,
                const LocateOptions& options, const std::vector<Search>& searches, double seconds) {
  Json head;
  head["gpureg"] = "locate";
  head["environment"] = environment(context);
  head["options"] = to_json(options.registration);
  head["map"] = {{"file", o.map()}, {"points", map.size()}, {"tiles", map.tiles()}};
  head["seconds"] = seconds;
  head["peak_memory_mib"] = peak_memory_mib();
  write_document(o.json, head, {"scans", searches.size(), [&](std::size_t k) {
                                  const Search& search = searches[k];
                                  Json json = {{"file", search.scan.path},
                                               {"name", search.scan.name}};
                                  json.update(to_json(search.result, search.scan.path));
                                  json["status"] = search.status();
                                  if (!search.found()) json["sizes"] = search.sides();
                                  return json;
                                }});
}

int run(LocateRun o) {
  if (o.files.size() < 2 && o.save_map.empty())
    throw InvalidArgument("one file is given, expected scans and then the map");
  o.method.registration();  // what is wrong with it shall be said before clouds are read
  o.place.check();
  if (o.files.size() < 2) {
    const std::string why = "without a scan";
    o.method.refuse(
        {"--quality", "--seed", "--min-confidence", "--viewpoint", "--up", "--near", "--json"},
        why);
    o.method.refuse_set_outside({"prepare"}, why);
  }
  std::vector<NamedPath> inputs{{"MAP", o.map()}};
  for (std::size_t k = 0; k + 1 < o.files.size(); ++k) inputs.push_back({"SCAN", o.files[k]});
  check_outputs({{"--json", o.json}, {"--save-map", o.save_map}}, inputs);
  const Context context = o.method.context();
  o.scans = scans_in(o);
  const MapInput input(o.map(), o.recursive);
  std::vector<std::string> paths;
  for (const LocatedScan& scan : o.scans) paths.push_back(scan.path);
  choose_voxel_size(o.method, input, paths);
  const LocateOptions options = locate_options(o.method);
  const MapOptions of_map{o.method.voxel_size, options.registration.prepare};
  // A bad scan shall show before the map is prepared.
  const std::vector<PointCloud> scans = read_scans(o, context, input.options_or(of_map), options);
  const PreparedMap map = input.prepare(context, of_map);
  std::cout << "map      " << o.map() << ": " << grouped(map.size()) << " points, " << map.tiles()
            << (map.tiles() == 1 ? " tile, voxels of " : " tiles, voxels of ")
            << o.method.voxel_size_text() << "\nbackend  " << context.description() << "\n";
  if (!o.save_map.empty()) map.save(o.save_map);
  if (o.scans.empty()) return kOk;
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<LocateResult> results = locate_all(o, context, scans, map, options);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  bool all = true, some_lost = false;
  std::vector<Search> searches;
  const Eigen::Vector3d map_sides = std::all_of(results.begin(), results.end(), is_well)
                                        ? Eigen::Vector3d::Zero()
                                        : sides_of(map.cloud());
  for (std::size_t k = 0; k < results.size(); ++k) {
    searches.push_back({o.scans[k], results[k], sides_of(scans[k]), map_sides});
    print(searches.back());
    all = all && searches.back().found();
    some_lost = some_lost || results[k].status != LocateStatus::found;
  }
  if (some_lost)
    std::cout
        << "try      is the scan of this place, in the unit of the map, and the map sharp (its "
           "poses)? Then --up, --near, another --voxel-size\n";
  std::cout << "seconds  " << fixed(seconds, 2) << "\n";
  if (!o.json.empty()) write_json(o, context, map, options, searches, seconds);
  return all ? kOk : kNoAlignment;
}

}  // namespace

void add_locate(CommandLine& line) {
  const auto o = std::make_shared<LocateRun>();
  Verb verb = line.verb("locate", "Find scans in a map, or say that they are not there");
  verb.option("SCAN...MAP", o->files,
              "Scans: clouds, folders of clouds, patterns in quotes, lists; a folder with poses by "
              "odometry (poses.txt, trajectory.txt) is one scan. Then the map: a cloud, a folder "
              "of scans "
              "with poses, the output of reconstruct, or a file of --save-map")
      .required();
  verb.flag("--recursive", o->recursive, kRecursiveHelp);
  o->method.add_to(verb);
  o->place.add_to(verb);
  verb.option("--save-map", o->save_map, "Write the prepared map; SCAN may be left out");
  verb.option("--json", o->json, "Write options, poses, evidence and times");
  verb.notes("Exit status 0: every scan was found, 1: one was not. ");
  verb.run([o] { return run(*o); });
}

}  // namespace gpureg::cli
