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
#include "gpureg/reconstruction/scales.hpp"
#include "inputs/odometry_file.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"
#include "options/method_options.hpp"
#include "options/output_path.hpp"
#include "options/resume_options.hpp"
#include "options/scale_option.hpp"
#include "pages/map_page.hpp"
#include "records/map_document.hpp"
#include "records/map_files.hpp"
#include "records/pair_store.hpp"
#include "run/interrupt.hpp"
#include "run/progress.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJournal = "pairs.journal";

struct ReconstructOptions {
  ScanInput input;
  std::string output, pairs = "all", results, odometry;
  MethodOptions method;
  ScaleChoice scale;
  std::uint32_t prune = 0;
  pose_graph::DriftOptions drift;
  std::optional<float> map_voxel_size;
  bool no_refine = false, no_map = false, no_audit = false;
  ResumeOptions resume;
  bool quiet = false;

  std::string file(const std::string& name) const { return (fs::path(output) / name).string(); }
  std::string journal() const { return file(kJournal); }
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

void choose_voxel_size(ReconstructOptions& o) {
  if (o.method.automatic_voxel_size && !o.results.empty()) {
    if (const float known = voxel_size_of_pairs(o.results); known > 0)
      return o.method.take_voxel_size(known);
    // A bad file shall show before the clouds are read.
    read_pairs(o.results, FragmentFolder(o.input, true), o.method.voxel_size);
  }
  o.method.choose_voxel_size(o.input, o.resume.resume ? o.journal() : "");
}

/// What scales that are searched do not go with.
void check_scale(const ReconstructOptions& o) {
  if (!o.scale.given()) return;
  if (o.scale.range().is_known())
    throw InvalidArgument("--scale is " + o.scale.text +
                          ", expected free or MIN:MAX: each scan of a map has a scale of its own");
  for (const auto& [given, name] :
       {std::pair(!o.results.empty(), "--results"), std::pair(!o.odometry.empty(), "--odometry")})
    if (given) throw InvalidArgument(std::string("--scale and ") + name + " do not go together");
}

/// Progress of each step of the library on stderr.
class StepProgress {
 public:
  explicit StepProgress(bool quiet) : quiet_(quiet) {}

  void update(reconstruction::MapStep step, std::size_t done, std::size_t total) {
    static constexpr const char* kLabels[] = {"preparing", "aligning", "preparing finer",
                                              "refining"};
    static constexpr const char* kUnits[] = {"fragments", "pairs", "fragments", "iterations"};
    if (!progress_ || step != step_) {
      step_ = step;
      progress_.reset();  // its last state stays on the screen above the next
      const auto k = static_cast<std::size_t>(step);
      progress_.emplace(kLabels[k], kUnits[k], total, quiet_, done);
    }
    progress_->update(done);
    if (done >= total) progress_.reset();
  }
  void end() { progress_.reset(); }

 private:
  bool quiet_;
  reconstruction::MapStep step_{};
  std::optional<Progress> progress_;
};

/// One run, from the folder to the map.
class Reconstruct {
 public:
  explicit Reconstruct(ReconstructOptions& o)
      : o_(o),
        context_(o.method.context()),
        set_(FragmentFolder(o.input, o.quiet), o.quiet),
        progress_(o.quiet) {
    run_.input = o.input;
    run_.output = o.output;
    run_.options = o.method.registration();
    run_.scene = set_.folder();
    run_.aligned_here = o.results.empty();
  }

  int run() {
    if (run_.aligned_here) o_.resume.check(o_.journal());
    const InterruptGuard guard;
    const reconstruction::MapInput known = input();
    try {
      if (o_.scale.given())
        make_scaled(known);
      else
        o_.resume.with(o_.journal(), [&] {
          run_.made = reconstruction::reconstruct(context_, set_, known, options(), callbacks());
        });
    } catch (const reconstruction::Cancelled&) {
      return say_interrupted();
    }
    progress_.end();
    if (!write_outputs()) return say_interrupted();
    if (run_.made.journal) ResumeOptions::close(*run_.made.journal, run_.scene, o_.quiet);
    if (!o_.quiet) {
      std::cout << "voxel size " << o_.method.voxel_size_text() << "\n";
      std::cout << map_summary(run_, context_);
    }
    if (!run_.scene.unusable.empty()) return kIncomplete;
    return run_.made.map.islands.empty() ? kNoAlignment : kOk;
  }

 private:
  /// Finds the scales of the scans, then makes the map of the scaled scans.
  void make_scaled(const reconstruction::MapInput& known) {
    reconstruction::ScaleSearch search;
    search.range = o_.scale.range();
    search.journal = o_.journal();
    search.journal_mode = o_.resume.mode();
    std::optional<Progress> progress;
    search.on_progress = [&](std::size_t done, std::size_t total) {
      if (!progress) progress.emplace("finding scales", "pairs", total, o_.quiet);
      progress->update(done);
    };
    search.should_stop = InterruptGuard::requested;
    reconstruction::FoundScales found;
    o_.resume.with(o_.journal(), [&] {
      found = reconstruction::find_scales(context_, set_, run_.options, search);
    });
    progress.reset();
    if (!o_.quiet) o_.resume.tell(o_.journal(), found.journal->resumed(), found.journal->size());
    std::vector<double> scales;
    for (const reconstruction::ScanScale& scan : found.scans) scales.push_back(scan.scale);
    const reconstruction::ScaledFragments scaled(set_, scales);
    o_.method.choose_voxel_size(
        scaled.size(), [&](std::size_t k) { return scaled.read(k, run_.options); }, o_.input.path);
    run_.options = o_.method.registration();
    const auto guesses =
        std::count_if(found.scans.begin(), found.scans.end(),
                      [](const reconstruction::ScanScale& scan) { return scan.part > 0; });
    if (guesses > 0 && !o_.quiet)
      std::cerr << "gpureg: note: no pair tells the scale of " << guesses << " of "
                << found.scans.size() << " scans to the first one" << std::endl;
    reconstruction::MapOptions map_options = options();
    map_options.journal.clear();
    reconstruction::ScaledMapOfSet map =
        reconstruction::reconstruct_scaled(context_, set_, scales, known, map_options, callbacks());
    run_.made = std::move(map.made);
    for (const std::size_t k : run_.made.scans) run_.scales.push_back(map.scales[k]);
    run_.made.journal = std::move(found.journal);
  }

  reconstruction::MapInput input() const {
    reconstruction::MapInput known;
    if (!o_.odometry.empty()) known = read_odometry(o_.odometry, run_.scene.scans, o_.input.path);
    if (!o_.results.empty()) {
      StoredPairs stored = read_pairs(o_.results, run_.scene, run_.options.voxel_size);
      known.pairs = std::move(stored.pairs);
      known.results = std::move(stored.results);
    } else if (o_.prune == 0) {
      known.pairs = choose_pairs(run_.scene, o_.pairs, o_.quiet);
      if (known.pairs->empty())
        throw InvalidArgument(o_.input.path + " holds one scan, " + run_.scene.scans[0].name +
                              "; a map needs two");
    }
    return known;
  }

  reconstruction::MapOptions options() const {
    reconstruction::MapOptions options{run_.options};
    options.graph.threads = static_cast<int>(o_.method.threads);
    options.graph.drift = o_.drift;
    options.with_audit = !o_.no_audit;
    options.with_refinement = !o_.no_refine;
    options.with_surfaces = !o_.no_map;
    options.prune = o_.prune;
    options.journal = o_.journal();
    options.journal_mode = o_.resume.mode();
    return options;
  }

  reconstruction::MapCallbacks callbacks() {
    using reconstruction::MapOfSet;
    reconstruction::MapCallbacks callbacks;
    callbacks.should_stop = InterruptGuard::requested;
    callbacks.on_progress = [this](reconstruction::MapStep step, std::size_t done,
                                   std::size_t total) {
      if (step == reconstruction::MapStep::align) {
        if (!pairs_ && !o_.quiet && !o_.scale.given()) o_.resume.tell(o_.journal(), done, total);
        pairs_ = {done, total};
      }
      progress_.update(step, done, total);
    };
    callbacks.on_prepared = [this](const MapOfSet& made) {
      progress_.end();
      set_.print_notes(made.scans, made.prepared);
      run_.scene.leave_out(made.unusable);
      if (run_.aligned_here)
        o_.method.check_sizes(run_.options.voxel_size, sizes_of(set_, made.scans, made.prepared),
                              o_.quiet);
    };
    callbacks.on_aligned = [this](const MapOfSet& made) {
      progress_.end();
      if (!run_.aligned_here) return;
      clear_output();
      if (o_.scale.given()) return;  // pairs of scaled scans are of no use elsewhere
      // The work of hours is safe from here on, whatever becomes of the map.
      write_pairs(
          o_.file("pairs.json"), pairs_head(run_, made, context_), made.pairs,
          [&](std::size_t k) { return made.results[k]; }, run_.scene, true);
    };
    return callbacks;
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
  bool write_outputs() {
    const auto start = std::chrono::steady_clock::now();
    if (!run_.aligned_here) clear_output();
    write_poses(run_);
    if (!o_.no_map) {
      const float voxel_size =
          o_.map_voxel_size.value_or(static_cast<float>(o_.method.voxel_size / 2));
      if (!write_merged_maps(run_, voxel_size, o_.quiet)) return false;
      write_map_page(run_);
    }
    run_.seconds_of_writing =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (InterruptGuard::requested()) return false;
    write_document(o_.file("reconstruction.json"), map_document(run_, context_));
    return true;
  }

  int say_interrupted() {
    progress_.end();
    std::cerr << "gpureg: interrupted";
    if (o_.scale.given())
      std::cerr << "; go on with the same command and --resume";
    else if (pairs_)
      std::cerr << ", " << pairs_->first << " of " << pairs_->second
                << " pairs are in the journal; go on with the same command and --resume";
    else
      std::cerr << ", no map written";
    std::cerr << std::endl;
    return kInterrupted;
  }

  ReconstructOptions& o_;
  Context context_;
  FolderSet set_;
  MapRun run_;
  StepProgress progress_;
  std::optional<std::pair<std::size_t, std::size_t>> pairs_;  // done, all; none before the first
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
  o->scale.add_to(verb);
  o->method.add_to(verb);
  o->method.add_calibration_to(verb);
  verb.flag("--no-audit", o->no_audit,
            "Without asking the scans whether they contradict each other where the map puts them");
  verb.flag("--no-refine", o->no_refine, "Without the joint refinement of all poses");
  verb.flag("--no-map", o->no_map, "Without map.ply and map.html");
  verb.option("--map-voxel-size", o->map_voxel_size,
              "Voxel size of map.ply; default: half the voxel size")
      .positive();
  auto [resume, restart] = o->resume.add_to(verb);
  resume.excludes(results);
  restart.excludes(results);
  verb.flag("--quiet", o->quiet, "No progress, no summary");
  verb.run([o] {
    o->method.registration();  // reports bad options before the clouds are read
    check_scale(*o);
    if (!o->results.empty() && !o->method.calibration.empty())
      throw InvalidArgument(
          "--calibration scales confidences that are made here, --results has "
          "its own");
    if (!o->results.empty() && o->no_audit)
      o->method.refuse({"--seed", "--quality", "--min-confidence"},
                       "with --results and --no-audit: no pair is aligned");
    if (o->no_map) o->method.refuse({"--map-voxel-size"}, "with --no-map");
    check_output_folder(*o);
    check_pairs(o->input, o->pairs);  // a bad file shall show before the clouds are read
    if (!o->odometry.empty())
      read_odometry(o->odometry, FragmentFolder(o->input, true).scans, o->input.path);
    if (!o->scale.given()) choose_voxel_size(*o);
    if (!o->quiet) o->method.note_calibration();
    return Reconstruct(*o).run();
  });
}

}  // namespace gpureg::cli
