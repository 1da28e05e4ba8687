// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/files.hpp"
#include "gpureg/io.hpp"
#include "gpureg/reconstruction.hpp"
#include "interrupt.hpp"
#include "json_file.hpp"
#include "options_json.hpp"
#include "output_path.hpp"
#include "pair_run.hpp"
#include "progress.hpp"
#include "result_json.hpp"
#include "spacing.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJournal = "pairs.journal";
constexpr const char* kOutputs[] = {"poses.txt",          "trajectory.txt", "edges.log",
                                    "graph.g2o",          "map.ply",        "pairs.json",
                                    "reconstruction.json"};

struct ReconstructOptions {
  std::string folder, output, pairs = "all", results;
  MethodOptions method;
  std::optional<float> map_voxel_size;
  bool no_refine = false, no_map = false;
  bool resume = false, restart = false, quiet = false;

  std::string file(const std::string& name) const { return (fs::path(output) / name).string(); }
  std::string journal() const { return file(kJournal); }
  Journal::Mode journal_mode() const {
    if (resume) return Journal::Mode::resume;
    return restart ? Journal::Mode::restart : Journal::Mode::fresh;
  }
};

/// Makes the output folder, and refuses one whose files could be inputs.
void check_output_folder(const ReconstructOptions& o) {
  const std::vector<NamedPath> inputs = [&] {
    std::vector<NamedPath> files = scene_files("DIR", o.folder);
    files.push_back({"--results", o.results});
    if (o.pairs != "all") files.push_back({"--pairs", o.pairs});
    return files;
  }();
  std::error_code error;
  if (fs::exists(o.output, error) && !fs::is_directory(o.output, error))
    throw IoError("cannot write " + o.output + ": it is no folder");
  // The poses.txt of a data set is its truth.
  if (fs::equivalent(o.output, o.folder, error))
    throw InvalidArgument("-o and DIR must be different folders, not both " + o.output);
  fs::create_directories(o.output, error);
  if (error) throw IoError("cannot make the folder " + o.output + ": " + error.message());
  std::vector<NamedPath> outputs = {{"the journal of -o", o.journal()}};
  for (const char* name : kOutputs)
    if (o.results.empty() || std::string(name) != "pairs.json")
      outputs.push_back({"a file of -o", o.file(name)});
  check_outputs(outputs, inputs);
}

void append(std::string& text, double value) {
  char buffer[40];
  text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

/// One run, from the folder to the map.
class Reconstruct {
 public:
  explicit Reconstruct(const ReconstructOptions& o)
      : o_(o), options_(o.method.registration()), context_(o.method.context()) {}

  int run() {
    if (o_.results.empty()) Journal::check(o_.journal(), o_.journal_mode());
    const InterruptGuard guard;
    if (!(o_.results.empty() ? align_pairs() : read_pairs())) return say_interrupted();
    reconstruct();
    if (!o_.no_refine && !refine()) return say_interrupted();
    write_outputs();
    if (run_) run_->journal()->remove();
    return summarise();
  }

 private:
  using Clock = std::chrono::steady_clock;
  static double since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  }

  /// Prepares and aligns. false: interrupted.
  bool align_pairs() {
    scene_ = prepare_scene(context_, o_.folder, options_.prepare, o_.quiet);
    if (scene_.interrupted) return false;
    check_voxel_size(options_.prepare.voxel_size, scene_.extent, "the largest fragment");
    Pairs pairs = choose_pairs(scene_, o_.pairs, o_.quiet);
    if (pairs.empty())
      throw InvalidArgument(o_.pairs == "all" ? o_.folder + " holds one fragment; a map needs two"
                                              : o_.pairs + " lists no pair");
    run_.emplace(scene_, std::move(pairs), options_, std::nullopt, o_.journal(), o_.journal_mode(),
                 o_.quiet);
    run_->align(context_);
    if (!run_->complete()) return false;
    for (const auto& [i, j] : run_->pairs()) {
      const Journal::Entry& entry = run_->done().at({scene_.numbers[i], scene_.numbers[j]});
      records_.push_back(entry.pair);
      information_.push_back(entry.information);
    }
    return true;
  }

  /// Takes the results of an earlier run of `reconstruct` or `batch`.
  bool read_pairs() {
    for (auto& [number, file] : io::list_fragments(o_.folder)) {
      scene_.numbers.push_back(number);
      scene_.files.push_back(file);
    }
    const auto fail = [&](const std::string& why) { throw IoError(o_.results + ": " + why); };
    Json document;
    try {
      document = Json::parse(read_text(o_.results));
    } catch (const Json::exception& error) {
      fail(error.what());
    }
    if (!document.is_object() || !document.contains("pairs") || !document["pairs"].is_array())
      fail("is not the JSON of `gpureg batch` or of `gpureg reconstruct`");
    if (document.contains("loop_consistency"))
      fail("its scores are those of `gpureg consistency`; give the JSON of the batch");
    if (document.contains("complete") && document["complete"] == false)
      fail("is of an unfinished batch");
    for (Json& json : document["pairs"]) try {
        records_.push_back(PairRecord::from_json(json));
        const auto found = json.find("information");
        information_.push_back(found == json.end() ? Json(nullptr) : *found);
      } catch (const InvalidArgument& error) {
        fail("pairs[" + std::to_string(records_.size()) + "]: " + error.what());
      }
    check_voxel_size_of(document);
    return true;
  }

  /// Tolerances belong to the voxel size of the results.
  void check_voxel_size_of(const Json& document) const {
    const Json prepare = document.value("options", Json::object()).value("prepare", Json::object());
    const auto found = prepare.find("voxel_size");
    if (found == prepare.end() || !found->is_number()) return;
    const auto voxel_size = found->get<float>();
    if (voxel_size != options_.prepare.voxel_size)
      throw InvalidArgument("--voxel-size is " + significant(o_.method.voxel_size, 4) + ", but " +
                            o_.results + " was made with " +
                            significant(static_cast<double>(voxel_size), 4));
  }

  std::uint32_t index_of(int number) const {
    const auto at = std::lower_bound(scene_.numbers.begin(), scene_.numbers.end(), number);
    if (at == scene_.numbers.end() || *at != number)
      throw IoError(o_.results + ": names fragment " + std::to_string(number) + ", which " +
                    o_.folder + " lacks");
    return static_cast<std::uint32_t>(at - scene_.numbers.begin());
  }

  void reconstruct() {
    const Clock::time_point start = Clock::now();
    std::vector<Pair> pairs;
    std::vector<RegistrationResult> results;
    for (std::size_t k = 0; k < records_.size(); ++k) {
      pairs.push_back({index_of(records_[k].j), index_of(records_[k].i)});
      results.push_back(result_from_record(records_[k], information_[k]));
    }
    auto options = reconstruction::Options::from_voxel_size(options_.prepare.voxel_size);
    options.threads = static_cast<int>(o_.method.threads);
    map_ = reconstruction::reconstruct(scene_.numbers.size(), pairs, results, options);
    graph_seconds_ = since(start);
  }

  /// Points of half the voxel size, with normals. Features are of no use here: one constant per
  /// point takes their place.
  reconstruction::Surface surface_of(int number, const std::string& file) const {
    PointCloud cloud = io::read_point_cloud(file);
    cloud.viewpoints = viewpoints_of(number);
    const std::vector<float> no_features(cloud.points.size(), 0);
    PointCloudView view = cloud.view();
    view.features = no_features.data();
    view.feature_dimension = 1;
    PrepareOptions prepare = options_.prepare;
    prepare.voxel_size /= 2;
    prepare.depth_maps = 0;
    prepare.surface_side_distance = 0;
    const PreparedCloud prepared = gpureg::prepare(context_, view, prepare);
    return {prepared.points(), prepared.normals(), viewpoints_of(number)};
  }
  std::vector<Eigen::Vector3f> viewpoints_of(int number) const {
    const auto found = cameras_.find(number);
    return found == cameras_.end() ? std::vector<Eigen::Vector3f>() : found->second;
  }

  /// false: interrupted.
  bool refine() {
    const Clock::time_point start = Clock::now();
    std::vector<reconstruction::Surface> surfaces(scene_.numbers.size());
    const std::string cameras = (fs::path(o_.folder) / "cameras.txt").string();
    if (fs::exists(cameras)) cameras_ = io::read_cameras(cameras);
    Progress progress("preparing finer", "fragments", surfaces.size(), o_.quiet);
    for (std::size_t k = 0; k < surfaces.size(); ++k) {
      if (InterruptGuard::requested()) return false;
      if (map_.scans[k].placed) surfaces[k] = surface_of(scene_.numbers[k], scene_.files[k]);
      progress.update(k + 1);
    }
    auto options = reconstruction::RefineOptions::from_voxel_size(options_.prepare.voxel_size);
    // Depth cameras: beyond, their noise grows with the square of the range.
    constexpr double kNoiseRangeVoxels = 30;
    options.noise_range = kNoiseRangeVoxels * o_.method.voxel_size;
    options.threads = static_cast<int>(o_.method.threads);
    Progress iterations("refining", "iterations", static_cast<std::size_t>(options.iterations),
                        o_.quiet);
    options.should_stop = [&](int k) {
      iterations.update(static_cast<std::size_t>(k));
      return InterruptGuard::requested();
    };
    refined_ = reconstruction::refine(surfaces, map_, options);
    refine_seconds_ = since(start);
    return !InterruptGuard::requested();
  }

  void write_outputs() {
    const Clock::time_point start = Clock::now();
    if (run_) write_document(o_.file("pairs.json"), pairs_document());
    files::write_atomically(o_.file("poses.txt"), poses_text());
    files::write_atomically(o_.file("trajectory.txt"), trajectory_text());
    write_edges();
    std::vector<std::int64_t> ids(scene_.numbers.begin(), scene_.numbers.end());
    pose_graph::write_g2o(o_.file("graph.g2o"), reconstruction::graph_of(map_, ids));
    if (!o_.no_map) write_maps();
    write_seconds_ = since(start);
    write_document(o_.file("reconstruction.json"), document());
  }

  /// What `gpureg report` and `--results` read.
  Json pairs_document() const {
    Json json;
    json["gpureg"] = "batch";
    json["environment"] = environment(context_);
    json["options"] = to_json(options_);
    json["folder"] = o_.folder;
    json["complete"] = true;
    json["seconds"] = {{"prepare", scene_.seconds},
                       {"align", run_->seconds()},
                       {"pairs_per_second", run_->rate()},
                       {"pairs_in_this_run", run_->in_this_run()}};
    json["fragments"] = fragments_json(scene_);
    Json records = Json::array();
    for (std::size_t k = 0; k < records_.size(); ++k) {
      records.push_back(records_[k].json);
      if (records_[k].transform) records.back()["information"] = information_[k];
    }
    json["pairs"] = std::move(records);
    return json;
  }

  std::string poses_text() const {
    std::string text;
    for (std::size_t k = 0; k < map_.scans.size(); ++k) {
      if (!map_.scans[k].placed) continue;
      text += std::to_string(scene_.numbers[k]) + "\n";
      const Eigen::Matrix4d pose = map_.scans[k].island_from_scan.matrix();
      for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) {
          append(text, pose(row, column));
          text += column < 3 ? ' ' : '\n';
        }
    }
    return text;
  }

  /// TUM: time stamp, position, quaternion (x, y, z, w). The number stands for the time.
  std::string trajectory_text() const {
    std::string text;
    for (std::size_t k = 0; k < map_.scans.size(); ++k) {
      if (!map_.scans[k].placed) continue;
      text += std::to_string(scene_.numbers[k]);
      const UnalignedIsometry3d& pose = map_.scans[k].island_from_scan;
      const Eigen::Matrix3d turn = pose.linear();
      const Eigen::Quaterniond q = Eigen::Quaterniond(turn).normalized();
      for (const double value : {pose.translation().x(), pose.translation().y(),
                                 pose.translation().z(), q.x(), q.y(), q.z(), q.w()}) {
        text += ' ';
        append(text, value);
      }
      text += '\n';
    }
    return text;
  }

  /// Accepted edges with the poses of the map.
  void write_edges() const {
    std::vector<evaluation::LogEntry> log;
    for (const reconstruction::Edge& edge : map_.edges)
      if (edge.accepted && map_.scans[edge.source].placed)
        log.push_back({scene_.numbers[edge.target], scene_.numbers[edge.source], scene_.count(),
                       (map_.scans[edge.target].island_from_scan.inverse() *
                        map_.scans[edge.source].island_from_scan)
                           .matrix()});
    evaluation::write_log(o_.file("edges.log"), log);
  }

  std::string map_name(std::size_t island) const {
    return island == 0 ? "map.ply" : "map_" + std::to_string(island) + ".ply";
  }

  /// One map per island, one scan in memory at a time.
  void write_maps() {
    const float voxel_size =
        o_.map_voxel_size.value_or(static_cast<float>(o_.method.voxel_size / 2));
    Progress progress("merging", "scans", map_.placed(), o_.quiet);
    std::size_t merged = 0;
    for (std::size_t k = 0; k < map_.islands.size(); ++k) {
      reconstruction::VoxelMap map(voxel_size);
      for (const std::uint32_t scan : map_.islands[k].scans) {
        const PointCloud cloud = io::read_point_cloud(scene_.files[scan]);
        map.add(cloud.view(), map_.scans[scan].island_from_scan);
        progress.update(++merged);
      }
      map_points_ += map.size();
      io::write_point_cloud(o_.file(map_name(k)), map.cloud());
    }
  }

  Json document() const {
    Json json;
    json["gpureg"] = "reconstruct";
    json["environment"] = environment(context_);
    json["options"] = to_json(options_);
    json["folder"] = o_.folder;
    json["seconds"] = {{"prepare", scene_.seconds},
                       {"align", run_ ? run_->seconds() : 0.0},
                       {"graph", graph_seconds_},
                       {"refine", refine_seconds_},
                       {"write", write_seconds_}};
    json["peak_memory_mib"] = peak_memory_mib();
    json["graph"] = pose_graph::to_string(map_.status);
    json["refinement"] = nullptr;
    if (refined_)
      json["refinement"] = {{"pairs", refined_->pairs},
                            {"correspondences", refined_->correspondences},
                            {"iterations", refined_->iterations},
                            {"rejected_edges", refined_->rejected_edges},
                            {"initial_rmse", refined_->initial_rmse},
                            {"final_rmse", refined_->final_rmse}};
    json["islands"] = Json::array();
    for (const reconstruction::Island& island : map_.islands) {
      Json numbers = Json::array();
      for (const std::uint32_t scan : island.scans) numbers.push_back(scene_.numbers[scan]);
      json["islands"].push_back(std::move(numbers));
    }
    json["scans"] = Json::array();
    for (std::size_t k = 0; k < map_.scans.size(); ++k) {
      const reconstruction::Scan& scan = map_.scans[k];
      json["scans"].push_back({{"id", scene_.numbers[k]},
                               {"placed", scan.placed},
                               {"island", scan.placed ? Json(scan.island) : Json(nullptr)},
                               {"confidence", scan.confidence},
                               {"reason", reconstruction::to_string(scan.reason)}});
    }
    json["edges"] = Json::array();
    for (const reconstruction::Edge& edge : map_.edges)
      json["edges"].push_back({{"i", scene_.numbers[edge.target]},
                               {"j", scene_.numbers[edge.source]},
                               {"T_ij", to_json(edge.target_from_source.matrix())},
                               {"confidence", edge.confidence},
                               {"weight", edge.weight},
                               {"state", edge.accepted ? "accepted" : "rejected"},
                               {"reason", reconstruction::to_string(edge.reason)},
                               {"mode", edge.mode}});
    return json;
  }

  int say_interrupted() const {
    std::cerr << "gpureg: interrupted";
    if (run_)
      std::cerr << ", " << run_->done().size() << " of " << run_->pairs().size()
                << " pairs are in the journal; go on with the same command and --resume";
    else
      std::cerr << ", nothing written";
    std::cerr << std::endl;
    return kInterrupted;
  }

  int summarise() const {
    if (!o_.quiet) {
      std::size_t accepted = 0;
      for (const reconstruction::Edge& edge : map_.edges) accepted += edge.accepted;
      if (o_.method.automatic_voxel_size)
        std::cout << "voxel size " << significant(static_cast<double>(o_.method.voxel_size), 3)
                  << "\n";
      if (run_)
        std::cout << "fragments  " << scene_.numbers.size() << ", prepared in "
                  << fixed(scene_.seconds, 2) << " s\n"
                  << "pairs      " << records_.size() << ", in " << fixed(run_->seconds(), 2)
                  << " s (" << context_.description() << ")\n";
      std::cout << "edges      " << accepted << " accepted, " << map_.edges.size() - accepted
                << " rejected, in " << fixed(graph_seconds_, 2) << " s\n"
                << "placed     " << map_.placed() << " of " << map_.scans.size() << ", islands of";
      for (const reconstruction::Island& island : map_.islands)
        std::cout << " " << island.scans.size();
      std::cout << (map_.islands.empty() ? " no scan\n" : " scans\n");
      for (std::size_t k = 0; k < map_.scans.size(); ++k)
        if (!map_.scans[k].placed)
          std::cout << "left out   " << scene_.numbers[k] << ": "
                    << reconstruction::describe(map_.scans[k].reason) << "\n";
      if (refined_)
        std::cout << "refined    " << refined_->pairs << " overlapping pairs, RMS distance "
                  << fixed(1000 * refined_->initial_rmse, 1) << " mm before, "
                  << fixed(1000 * refined_->final_rmse, 1) << " mm after, in "
                  << fixed(refine_seconds_, 2) << " s\n";
      if (!o_.no_map) std::cout << "map        " << grouped(map_points_) << " points\n";
      std::cout << "memory     " << fixed(peak_memory_mib(), 0) << " MiB at most\n"
                << "written    to " << o_.output << "\n";
    }
    return map_.islands.empty() ? kNoAlignment : kOk;
  }

  const ReconstructOptions& o_;
  RegistrationOptions options_;
  Context context_;
  Scene scene_;
  std::optional<PairRun> run_;                           // none: the results come from a file
  std::map<int, std::vector<Eigen::Vector3f>> cameras_;  // of each fragment
  std::vector<PairRecord> records_;
  std::vector<Json> information_;  // of each record; null: not known
  reconstruction::Reconstruction map_;
  std::optional<reconstruction::RefineReport> refined_;
  std::size_t map_points_ = 0;
  double graph_seconds_ = 0, refine_seconds_ = 0, write_seconds_ = 0;
};

}  // namespace

void add_reconstruct(CLI::App& app, Action& chosen) {
  const auto o = std::make_shared<ReconstructOptions>();
  CLI::App* verb = app.add_subcommand(
      "reconstruct", "Make one map of the unordered fragments cloud_bin_<i> of a folder");
  verb->add_option("DIR", o->folder, "Folder with cloud_bin_<i>.ply|pcd, and perhaps cameras.txt")
      ->required();
  verb->add_option("-o,--output", o->output,
                   "Folder for poses.txt, reconstruction.json, trajectory.txt (TUM), edges.log "
                   "(Redwood), graph.g2o, map.ply and pairs.json")
      ->required();
  verb->add_option("--pairs", o->pairs, "all, or a file with one pair `i j` a line")
      ->capture_default_str();
  CLI::Option* results =
      verb->add_option("--results", o->results,
                       "JSON of `gpureg batch`, or pairs.json of a map, instead of aligning");
  o->method.add_to(*verb);
  verb->add_flag("--no-refine", o->no_refine, "Without the joint refinement of all poses");
  verb->add_flag("--no-map", o->no_map, "Without map.ply");
  verb->add_option("--map-voxel-size", o->map_voxel_size,
                   "Voxel size of map.ply; default: half the voxel size")
      ->check(CLI::PositiveNumber);
  CLI::Option* resume =
      verb->add_flag("--resume", o->resume, "Go on where an interrupted run of this output stopped")
          ->excludes(results);
  verb->add_flag("--restart", o->restart, "Discard what an interrupted run of this output did")
      ->excludes(resume)
      ->excludes(results);
  verb->add_flag("--quiet", o->quiet, "No progress, no summary");
  verb->callback([o, &chosen] {
    chosen = [o] {
      o->method.registration();  // reports bad options before the clouds are read
      check_output_folder(*o);
      choose_voxel_size(o->method, o->folder);
      return Reconstruct(*o).run();
    };
  });
}

}  // namespace gpureg::cli
