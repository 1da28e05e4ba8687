// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
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

struct LocateRun {
  std::vector<std::string> files;  // scans, then the map
  MethodOptions method;
  PlaceOptions place;
  std::string json, save_map;

  std::vector<std::string> scans() const { return {files.begin(), files.end() - 1}; }
  const std::string& map() const { return files.back(); }
};

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
}

std::vector<PointCloud> read_scans(const LocateRun& o, const Context& context,
                                   const MapOptions& of_map, const LocateOptions& options) {
  std::vector<PointCloud> clouds;
  ViewpointNote note;
  for (const std::string& file : o.scans()) {
    clouds.push_back(read_scan(file, context, of_map));
    o.place.viewpoint.check_cloud("--viewpoint", clouds.back(), file);
    o.place.viewpoint.apply(clouds.back());
    if (options.registration.prepare.depth_maps > 0) note.see(clouds.back(), file);
  }
  note.print();
  return clouds;
}

std::vector<LocateResult> locate_all(const LocateRun& o, const Context& context,
                                     const std::vector<PointCloud>& clouds, const PreparedMap& map,
                                     const LocateOptions& options) {
  std::vector<PointCloudView> views;
  for (const PointCloud& cloud : clouds) views.push_back(o.place.viewpoint.view(cloud));
  return localization::locate(context, views, map, options,
                              std::vector<LocatePrior>(views.size(), o.place.prior()), o.scans());
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
  const std::vector<std::string> scans = o.scans();
  write_document(o.json, head, {"scans", results.size(), [&](std::size_t k) {
                                  return to_json(results[k], scans[k]);
                                }});
}

int run(LocateRun o) {
  if (o.files.size() < 2 && o.save_map.empty())
    throw InvalidArgument("one file is given, expected scans and then the map");
  o.method.registration();  // what is wrong with it shall be said before clouds are read
  o.place.check();
  if (o.scans().empty()) {
    const std::string why = "without a scan";
    o.method.refuse(
        {"--quality", "--seed", "--min-score", "--viewpoint", "--up", "--near", "--json"}, why);
    o.method.refuse_set_outside({"prepare"}, why);
  }
  std::vector<NamedPath> inputs{{"MAP", o.map()}};
  for (const std::string& file : o.scans()) inputs.push_back({"SCAN", file});
  check_outputs({{"--json", o.json}, {"--save-map", o.save_map}}, inputs);
  const Context context = o.method.context();
  const MapInput input(o.map());
  choose_voxel_size(o.method, input);
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
  if (o.scans().empty()) return kOk;
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<LocateResult> results = locate_all(o, context, scans, map, options);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  bool all = true;
  for (std::size_t k = 0; k < results.size(); ++k) {
    print(o.files[k], results[k]);
    all = all && results[k].status == LocateStatus::found;
  }
  std::cout << "seconds  " << fixed(seconds, 2) << "\n";
  if (!o.json.empty()) write_json(o, context, map, options, results, seconds);
  return all ? kOk : kNoAlignment;
}

}  // namespace

void add_locate(CommandLine& line) {
  const auto o = std::make_shared<LocateRun>();
  Verb verb = line.verb("locate", "Find scans in a map, or say that they are not there");
  verb.option(
          "SCAN...MAP", o->files,
          "Scans, clouds or folders of scans with poses by odometry, which are one scan; then the "
          "map: a cloud, a folder of scans with poses, the output of "
          "reconstruct, or a file of --save-map")
      .required();
  o->method.add_to(verb);
  o->place.add_to(verb);
  verb.option("--save-map", o->save_map, "Write the prepared map; SCAN may be left out");
  verb.option("--json", o->json, "Write options, poses, evidence and times");
  verb.notes("Exit status 0: every scan was found, 1: one was not. ");
  verb.run([o] { return run(*o); });
}

}  // namespace gpureg::cli
