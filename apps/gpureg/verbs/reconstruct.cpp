// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "gpureg/pruning.hpp"
#include "inputs/cloud_file.hpp"
#include "inputs/odometry_file.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"
#include "options/output_path.hpp"
#include "pages/map_page.hpp"
#include "records/map_document.hpp"
#include "records/map_files.hpp"
#include "records/pair_store.hpp"
#include "run/interrupt.hpp"
#include "run/pair_run.hpp"
#include "run/progress.hpp"
#include "run/spacing.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJournal = "pairs.journal";

struct ReconstructOptions {
  ScanInput input;
  std::string output, pairs = "all", results, odometry;
  MethodOptions method;
  std::uint32_t prune = 0;
  pose_graph::DriftOptions drift;
  std::optional<float> map_voxel_size;
  bool no_refine = false, no_map = false, no_audit = false;
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
  const std::vector<NamedPath> inputs = {{"SCANS", o.input.path},
                                         {"--results", o.results},
                                         {"--odometry", o.odometry},
                                         {"--pairs", o.pairs == "all" ? "" : o.pairs},
                                         {"--calibration", o.method.calibration}};
  check_outputs({}, inputs);  // before a folder is made
  std::error_code error;
  if (fs::exists(o.output, error) && !fs::is_directory(o.output, error))
    throw IoError("cannot write " + o.output + ": it is no folder");
  // The poses.txt of a data set is its truth.
  if (fs::equivalent(o.output, o.input.folder(), error))
    throw InvalidArgument("-o and SCANS must be different folders, not both " + o.output);
  fs::create_directories(o.output, error);
  if (error) throw IoError("cannot make the folder " + o.output + ": " + error.message());
  if (const std::string pairs = o.file("pairs.json");
      !o.results.empty() && fs::exists(pairs, error) && !fs::equivalent(pairs, o.results, error))
    throw InvalidArgument("-o holds the pairs of another map, " + pairs +
                          ": give --results that file, or -o another folder");
  // Those of the map of an earlier run are removed. Its pairs may make another map.
  for (const std::string& file : map_files_in(o.output))
    if (fs::path(file).filename() != "pairs.json" || !fs::equivalent(file, o.results, error))
      check_outputs({{"a file of -o", file}}, inputs);
  std::vector<NamedPath> outputs = {{"the journal of -o", o.journal()}};
  for (const char* name : kMapFiles)
    if (o.results.empty() || std::string(name) != "pairs.json")
      outputs.push_back({"a file of -o", o.file(name)});
  check_outputs(outputs, inputs);
}

/// A bad file shall show before the clouds are read.
void check_inputs(const ReconstructOptions& o) {
  check_pairs(o.input, o.pairs);
  if (o.odometry.empty()) return;
  read_odometry(o.odometry, FragmentFolder(o.input, true).scans, o.input.path);
}

/// One run, from the folder to the map.
class Reconstruct {
 public:
  explicit Reconstruct(const ReconstructOptions& o) : o_(o), context_(o.method.context()) {
    run_.input = o.input;
    run_.output = o.output;
    run_.options = o.method.registration();
  }

  int run() {
    if (o_.results.empty()) Journal::check(o_.journal(), o_.journal_mode());
    const InterruptGuard guard;
    if (o_.results.empty()) {
      if (!align_pairs()) return say_interrupted();
    } else {
      run_.scene = PreparedFolder(FragmentFolder(o_.input, o_.quiet));
      run_.pairs = read_pairs(o_.results, run_.scene, run_.options.prepare.voxel_size);
      if (!o_.no_audit) {
        PreparedFolder scene = prepare_folder(context_, o_.input, run_.options.prepare, o_.quiet);
        if (scene.interrupted) return say_interrupted();
        run_.seconds.prepare = scene.seconds;
        run_.scene = std::move(scene);
      } else if (!(o_.no_refine && o_.no_map)) {
        run_.scene.leave_out_unreadable();
      }
      if (!run_.scene.unusable.empty())
        run_.pairs = read_pairs(o_.results, run_.scene, run_.options.prepare.voxel_size);
    }
    if (!o_.odometry.empty() && odometry_.empty()) odometry_ = known_poses();
    if (!reconstruct()) return say_interrupted();
    if (!(o_.no_refine && o_.no_map)) {
      const Clock::time_point start = Clock::now();
      if (!make_surfaces()) return say_interrupted();
      run_.seconds.surfaces = since(start);
    }
    if (!o_.no_refine && !refine()) return say_interrupted();
    if (!write_outputs()) return say_interrupted();
    if (pairs_) pairs_->close_journal();
    if (!o_.quiet) {
      if (o_.method.automatic_voxel_size)
        std::cout << "voxel size " << significant(static_cast<double>(o_.method.voxel_size), 3)
                  << "\n";
      std::cout << map_summary(run_, context_);
    }
    if (!run_.scene.unusable.empty()) return kIncomplete;
    return run_.map.islands.empty() ? kNoAlignment : kOk;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static double since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  }

  /// Prepares and aligns. false: interrupted.
  bool align_pairs() {
    PreparedFolder& scene = run_.scene;
    scene = prepare_folder(context_, o_.input, run_.options.prepare, o_.quiet);
    if (scene.interrupted) return false;
    run_.seconds.prepare = scene.seconds;
    check_voxel_size(run_.options.prepare.voxel_size, scene.extent, "the largest fragment");
    if (o_.method.automatic_voxel_size && !o_.quiet) note_few_points(scene.prepared_sizes());
    if (!o_.method.given("--voxel-size") && !o_.quiet)
      note_unusual_points(o_.method.voxel_size, scene.prepared_sizes());
    // A bad file shall show before hours of work.
    if (!o_.odometry.empty()) odometry_ = known_poses();
    const Pairs pairs = o_.prune > 0 ? likely_pairs() : choose_pairs(scene, o_.pairs, o_.quiet);
    if (pairs.empty())
      throw InvalidArgument(o_.input.path + " holds one scan, " + scene.scans[0].name +
                            "; a map needs two");
    pairs_.emplace(scene, pairs, run_.options, std::nullopt, o_.journal(), o_.journal_mode(),
                   o_.quiet);
    pairs_->align(context_);
    if (!pairs_->complete()) return false;
    run_.pairs = pairs_->take_store();
    run_.aligned_here = true;
    run_.seconds.align = pairs_->seconds();
    run_.pairs_in_this_run = pairs_->in_this_run();
    clear_output();
    // The work of hours is safe from here on, whatever becomes of the map.
    write_pairs(o_.file("pairs.json"), pairs_head(run_, context_), run_.pairs, scene, true);
    for (RegistrationResult& result : run_.pairs.results) reduce_moments(result);
    return true;
  }

  std::vector<reconstruction::Odometry> known_poses() const {
    std::vector<int> unusable;
    for (const UnusableFragment& fragment : run_.scene.unusable)
      unusable.push_back(fragment.scan.number);
    return read_odometry(o_.odometry, run_.scene.scans, o_.input.path, unusable);
  }

  /// The pairs of --prune, and of consecutive scans where odometry knows them.
  Pairs likely_pairs() {
    const Clock::time_point start = Clock::now();
    pruning::Options options;
    options.neighbors = o_.prune;
    options.threads = static_cast<int>(o_.method.threads);
    Pairs pairs;
    for (const Pair& pair : pruning::likely_pairs(run_.scene.clouds, options))
      pairs.emplace_back(pair.target, pair.source);
    for (const reconstruction::Odometry& edge : odometry_)
      pairs.push_back(std::minmax(edge.source, edge.target));
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    run_.seconds.prune = since(start);
    return pairs;
  }

  /// Removes the map of an earlier run. A folder without reconstruction.json, which is written
  /// last, holds no finished map.
  void clear_output() const {
    std::vector<std::string> files = map_files_in(o_.output);
    std::stable_partition(files.begin(), files.end(), [&](const std::string& file) {
      return file == o_.file("reconstruction.json");
    });
    for (const std::string& file : files) {
      std::error_code error;
      if (fs::equivalent(file, o_.results, error)) continue;
      if (!fs::remove(file, error) && error)
        throw IoError("cannot remove " + file + ": " + error.message());
    }
  }

  /// false: interrupted.
  bool reconstruct() {
    const Clock::time_point start = Clock::now();
    auto options = reconstruction::Options::from_voxel_size(run_.options.prepare.voxel_size);
    options.threads = static_cast<int>(o_.method.threads);
    options.drift = o_.drift;
    if (o_.no_audit) {
      run_.map = reconstruction::reconstruct_from_poses(run_.scene.numbers.size(), run_.pairs.pairs,
                                                        run_.pairs.results, options, odometry_);
    } else {
      const float voxel_size = run_.options.prepare.voxel_size;
      auto audit = reconstruction::AuditOptions::from_voxel_size(voxel_size);
      audit.should_stop = InterruptGuard::requested;
      reconstruction::AuditedReconstruction audited;
      try {
        audited = reconstruction::reconstruct(context_, run_.scene.clouds, run_.pairs.pairs,
                                              run_.pairs.results, options, odometry_, run_.options,
                                              audit);
      } catch (const reconstruction::Cancelled&) {
        return false;
      }
      run_.map = std::move(audited.map);
      run_.audit = std::move(audited.audit);
      run_.places_look_alike = audited.places_look_alike;
    }
    run_.seconds.graph = since(start);
    return !InterruptGuard::requested();
  }

  /// Points and normals of the placed scans. false: interrupted.
  bool make_surfaces() {
    const PreparedFolder& scene = run_.scene;
    surfaces_.resize(scene.numbers.size());
    Progress progress("preparing finer", "fragments", surfaces_.size(), o_.quiet);
    for (std::size_t k = 0; k < surfaces_.size(); ++k) {
      if (InterruptGuard::requested()) return false;
      if (run_.map.scans[k].placed) {
        const PointCloud cloud =
            scene.read(k, mesh_spacing(run_.options.prepare.voxel_size), MeshNote::none);
        surfaces_[k] = reconstruction::surface_of(context_, cloud.view(), run_.options.prepare);
      }
      progress.update(k + 1);
    }
    return true;
  }

  /// false: interrupted.
  bool refine() {
    const Clock::time_point start = Clock::now();
    auto options =
        reconstruction::RefineOptions::for_depth_cameras(run_.options.prepare.voxel_size);
    options.threads = static_cast<int>(o_.method.threads);
    Progress iterations("refining", "iterations", static_cast<std::size_t>(options.iterations),
                        o_.quiet);
    options.should_stop = [&](int k) {
      iterations.update(static_cast<std::size_t>(k));
      return InterruptGuard::requested();
    };
    run_.refined = reconstruction::refine(context_, surfaces_, run_.map, options);
    run_.seconds.refine = since(start);
    return !InterruptGuard::requested();
  }

  /// false: interrupted.
  bool write_outputs() {
    const Clock::time_point start = Clock::now();
    if (!run_.aligned_here) clear_output();
    write_poses(run_);
    if (!o_.no_map) {
      const float voxel_size =
          o_.map_voxel_size.value_or(static_cast<float>(o_.method.voxel_size / 2));
      if (!write_merged_maps(run_, voxel_size, o_.quiet)) return false;
      write_map_page(run_, surfaces_);
    }
    run_.seconds.write = since(start);
    if (InterruptGuard::requested()) return false;
    write_document(o_.file("reconstruction.json"), map_document(run_, context_));
    return true;
  }

  int say_interrupted() const {
    std::cerr << "gpureg: interrupted";
    if (pairs_)
      std::cerr << ", " << pairs_->done() << " of " << pairs_->size()
                << " pairs are in the journal; go on with the same command and --resume";
    else
      std::cerr << ", no map written";
    std::cerr << std::endl;
    return kInterrupted;
  }

  const ReconstructOptions& o_;
  Context context_;
  MapRun run_;
  std::optional<PairRun> pairs_;  // none: the results come from a file
  std::vector<reconstruction::Odometry> odometry_;
  std::vector<reconstruction::Surface> surfaces_;
};

}  // namespace

void add_reconstruct(CommandLine& line) {
  const auto o = std::make_shared<ReconstructOptions>();
  Verb verb = line.verb("reconstruct", "Make one map of the unordered scans of a folder");
  verb.option("SCANS", o->input.path, kScansHelp).required();
  verb.flag("--recursive", o->input.recursive, kRecursiveHelp);
  verb.option(
          "-o,--output", o->output,
          "Folder for reconstruction.json, edges.log (Redwood), map.html, pairs.json, scans.csv "
          "(names of the numbers), and of each island poses.txt, trajectory.txt (TUM), graph.g2o "
          "and map.ply")
      .required();
  const Option pairs = verb.option("--pairs", o->pairs, kPairsHelp).show_default();
  const Option results =
      verb.option("--results", o->results,
                  "JSON of `gpureg batch`, or pairs.json of a map, instead of aligning");
  verb.option("--prune", o->prune,
              "For large sets: align so many pairs per fragment on average, those that look most "
              "alike; without: all pairs")
      .between(1u, 1000000u)
      .excludes(pairs)
      .excludes(results);
  const Option odometry = verb.option(
      "--odometry", o->odometry,
      "Known relative poses: a trajectory (TUM with numbers or names of scans as times, or "
      "poses.txt), of which those of consecutive scans count, or a Redwood log of pairs");
  verb.option("--drift", o->drift.translation_per_metre,
              "Odometry: metres of error per metre travelled")
      .show_default()
      .not_negative()
      .needs(odometry);
  verb.option("--drift-rotation", o->drift.rotation_per_metre,
              "Odometry: degrees of error per metre travelled")
      .show_default()
      .not_negative()
      .needs(odometry);
  verb.option("--drift-turn", o->drift.rotation_per_degree,
              "Odometry: degrees of error per degree turned")
      .show_default()
      .not_negative()
      .needs(odometry);
  o->method.add_to(verb);
  o->method.add_calibration_to(verb);
  verb.flag("--no-audit", o->no_audit,
            "Without asking the scans whether they contradict each other where the map puts them");
  verb.flag("--no-refine", o->no_refine, "Without the joint refinement of all poses");
  verb.flag("--no-map", o->no_map, "Without map.ply and map.html");
  verb.option("--map-voxel-size", o->map_voxel_size,
              "Voxel size of map.ply; default: half the voxel size")
      .positive();
  const Option resume =
      verb.flag("--resume", o->resume, "Go on where an interrupted run of this output stopped")
          .excludes(results);
  verb.flag("--restart", o->restart, "Discard what an interrupted run of this output did")
      .excludes(resume)
      .excludes(results);
  verb.flag("--quiet", o->quiet, "No progress, no summary");
  verb.run([o] {
    o->method.registration();  // reports bad options before the clouds are read
    if (!o->results.empty() && !o->method.calibration.empty())
      throw InvalidArgument(
          "--calibration scales confidences that are made here, --results has "
          "its own");
    if (!o->results.empty() && o->no_audit)
      o->method.refuse({"--seed", "--quality", "--min-score"},
                       "with --results and --no-audit: no pair is aligned");
    if (o->no_map) o->method.refuse({"--map-voxel-size"}, "with --no-map");
    check_output_folder(*o);
    check_inputs(*o);
    choose_voxel_size(o->method, o->input, o->resume ? o->journal() : "");
    if (!o->quiet) o->method.note_calibration();
    return Reconstruct(*o).run();
  });
}

}  // namespace gpureg::cli
