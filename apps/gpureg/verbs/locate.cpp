// SPDX-License-Identifier: BSD-3-Clause
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

void print(const std::string& file, const LocateResult& result) {
  std::cout << "scan     " << file << ": " << grouped(result.scan_points) << " points, "
            << result.tiles << (result.tiles == 1 ? " tile\n" : " tiles\n") << "status   "
            << localization::to_string(result.status)
            << ", not at any of these poses with probability "
            << fixed(result.absent_probability, 3) << "\n";
  constexpr std::size_t kShown = 3;
  for (std::size_t k = 0; k < std::min(kShown, result.poses.size()); ++k) {
    const LocatedPose& pose = result.poses[k];
    std::cout << "pose " << k + 1 << "   confidence " << fixed(pose.confidence, 3)
              << (pose.alias ? ", an alias of pose 1" : "") << ", inliers "
              << percent(pose.verification.inlier_ratio) << " %, map_from_scan\n";
    std::cout << pose_text(pose.map_from_scan.matrix());
  }
  constexpr double kLittle = 0.05;
  if (result.status == LocateStatus::found &&
      result.poses.front().verification.inlier_ratio < kLittle)
    std::cerr << "gpureg: note: only " << percent(result.poses.front().verification.inlier_ratio)
              << " % of " << file
              << " lies on the map under this pose: is it the scan, and the map the last argument?"
              << std::endl;
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
                const LocateOptions& options, const std::vector<LocateResult>& results,
                double seconds) {
  Json head;
  head["gpureg"] = "locate";
  head["environment"] = environment(context);
  head["options"] = to_json(options.registration);
  head["map"] = {{"file", o.map()}, {"points", map.size()}, {"tiles", map.tiles()}};
  head["seconds"] = seconds;
  head["peak_memory_mib"] = peak_memory_mib();
  write_document(o.json, head, {"scans", results.size(), [&](std::size_t k) {
                                  Json json = {{"file", o.scans[k].path},
                                               {"name", o.scans[k].name}};
                                  json.update(to_json(results[k], o.scans[k].path));
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
        {"--quality", "--seed", "--min-score", "--viewpoint", "--up", "--near", "--json"}, why);
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
  MapOptions of_map = MapOptions::from_voxel_size(o.method.voxel_size);
  of_map.prepare = options.registration.prepare;
  // A bad scan shall show before the map is prepared.
  const std::vector<PointCloud> scans = read_scans(o, context, input.options_or(of_map), options);
  const PreparedMap map = input.prepare(context, of_map);
  std::cout << "map      " << o.map() << ": " << grouped(map.size()) << " points, " << map.tiles()
            << (map.tiles() == 1 ? " tile\n" : " tiles\n") << "backend  " << context.description()
            << "\n";
  if (!o.save_map.empty()) map.save(o.save_map);
  if (o.scans.empty()) return kOk;
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<LocateResult> results = locate_all(o, context, scans, map, options);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  bool all = true;
  for (std::size_t k = 0; k < results.size(); ++k) {
    print(o.scans[k].path, results[k]);
    all = all && results[k].status == LocateStatus::found;
  }
  if (!all)
    std::cout
        << "try      is the scan of this place, in the unit of the map, and the map sharp (its "
           "poses)? Then --up, --near, another --voxel-size\n";
  std::cout << "seconds  " << fixed(seconds, 2) << "\n";
  if (!o.json.empty()) write_json(o, context, map, options, results, seconds);
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
