// SPDX-License-Identifier: BSD-3-Clause
#include "verbs/audit.hpp"

#include <chrono>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>

#include "exit_status.hpp"
#include "gpureg/error.hpp"
#include "gpureg/evaluation/trajectory.hpp"
#include "gpureg/files.hpp"
#include "gpureg/reconstruction/mend.hpp"
#include "inputs/map_poses.hpp"
#include "inputs/saved_map.hpp"
#include "inputs/scene.hpp"
#include "json/json_file.hpp"
#include "options/method_options.hpp"
#include "options/output_path.hpp"
#include "pages/audit_page.hpp"
#include "records/audit_document.hpp"
#include "records/map_files.hpp"
#include "records/scan_table.hpp"
#include "run/interrupt.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

using reconstruction::AuditVerdict;

struct AuditVerbOptions {
  ScanInput input;
  std::string poses, json, page, mended;
  MethodOptions method;
  bool quiet = false;
};

int status_of(const reconstruction::Audit& audit) {
  return audit.verdict() == AuditVerdict::sound ? kOk : kNoAlignment;
}

const char* explained(AuditVerdict verdict) {
  switch (verdict) {
    case AuditVerdict::sound:
      return "sound: no connection is contradicted";
    case AuditVerdict::contradicted:
      return "contradicted";
    case AuditVerdict::undecided:
      break;
  }
  return "undecided: most scans do not see each other; are they poses of these scans, in the unit "
         "of their points?";
}

/// The map of the folder of a finished `gpureg reconstruct` or of its reconstruction.json, with its
/// islands; or that of read_pose_file(), whose parameters these are.
/// @throws IoError as read_pose_file(), also for a folder of an unfinished `gpureg reconstruct`.
reconstruction::Reconstruction read_map_poses(const std::string& path,
                                              const std::vector<io::ScanFile>& scans,
                                              const std::string& folder) {
  const std::string file = saved_map_file(path);
  if (file.empty()) {
    if (std::error_code ignored; std::filesystem::is_directory(path, ignored))
      throw IoError(path + " has no reconstruction.json" + kWrittenLast);
    return read_pose_file(path, scans, folder);
  }
  const SavedMap saved = read_saved_map(file);
  std::map<int, std::uint32_t> saved_island;
  for (std::uint32_t k = 0; k < saved.islands.size(); ++k)
    for (const int number : saved.islands[k]) saved_island[number] = k;
  PosesByNumber poses;
  std::map<std::int64_t, std::uint32_t> island;
  for (const io::ScanFile& scan : scans)
    if (const auto number = saved.number_of(scan)) {
      poses[scan.number] = saved.poses.at(*number);
      island[scan.number] = saved_island.at(*number);
    }
  return map_of(poses, island, scans, file, folder);
}

/// What a person reads first.
std::string summary(const AuditRun& run) {
  std::ostringstream out;
  out << "scans      " << run.scene.numbers.size() - run.missing.size() << " with a pose, "
      << run.missing.size() << " without\n"
      << "pairs      " << run.audit.pairs.size()
      << " near each other: " << run.audit.count(reconstruction::PairVerdict::supports)
      << " support their poses, " << run.audit.count(reconstruction::PairVerdict::contradicts)
      << " contradict them, in " << fixed(run.seconds, 2) << " s\n";
  if (run.audit.islands.size() > 1) {
    const std::vector<AuditVerdict> verdicts = run.audit.verdicts();
    for (std::size_t k = 0; k < verdicts.size(); ++k)
      out << "island     " << island_scans(run, k) << ": " << to_string(verdicts[k]) << "\n";
  }
  for (const reconstruction::AuditedConnection& connection : run.audit.connections)
    if (connection.verdict == reconstruction::ConnectionVerdict::contradicted)
      out << "broken     " << describe(run, connection) << "\n";
  out << "undecided  " << run.audit.count(reconstruction::ConnectionVerdict::undecided) << " of "
      << run.audit.connections.size() << " connections\n"
      << "verdict    " << explained(run.audit.verdict()) << "\n";
  return out.str();
}

/// What to say of a file of poses that make a sound map inverted, where they make none as they are.
std::string inverted(const Context& context, const AuditRun& run,
                     const reconstruction::AuditOptions& options) {
  std::error_code ignored;
  if (run.audit.verdict() == AuditVerdict::sound ||
      std::filesystem::is_directory(run.poses_file, ignored))
    return "";
  auto map = run.map;
  for (reconstruction::Scan& scan : map.scans)
    scan.island_from_scan = UnalignedIsometry3d(scan.island_from_scan.inverse());
  const auto audit = reconstruction::audit(context, run.scene.clouds, map, run.options, options);
  return audit.verdict() == AuditVerdict::sound
             ? "try        the poses look inverted: their inverses make a sound map; expected "
               "map_from_scan, which moves the points of a scan into the map\n"
             : "";
}

/// Where the mended poses of each island go.
std::vector<std::string> mended_files(const AuditVerbOptions& o, std::size_t islands) {
  std::vector<std::string> files;
  for (std::size_t k = 0; !o.mended.empty() && k < islands; ++k)
    files.push_back(file_of_island(o.mended, k));
  return files;
}

/// Writes the mended poses. The exit status is that of their audit.
int mend(const AuditVerbOptions& o, const Context& context, const AuditRun& run,
         const reconstruction::AuditOptions& options) {
  const reconstruction::MendedMap map =
      reconstruction::mend(context, run.scene.clouds, run.map, run.audit, run.options, options);
  const std::vector<std::string> files = mended_files(o, run.map.islands.size());
  for (std::size_t k = 0; k < files.size(); ++k) {
    evaluation::Trajectory trajectory;
    for (const std::uint32_t scan : run.map.islands[k].scans)
      if (map.world_from_scan[scan].matrix().allFinite())
        trajectory.push_back(
            {static_cast<double>(run.scene.numbers[scan]), map.world_from_scan[scan].matrix()});
    evaluation::write_trajectory(files[k], trajectory);
  }
  if (const std::vector<io::ScanFile> scans = run.scene.all(); !are_numbered(scans))
    write_scan_table(scan_table_of(o.mended), scans);
  if (!o.quiet)
    std::cout << "mended     " << map.registered << " pairs aligned, " << map.moved.size()
              << " scans moved, " << map.left_out.size() << " left out; "
              << to_string(map.audit.verdict()) << "\n";
  return status_of(map.audit);
}

int audit_and_mend(const AuditVerbOptions& o, const Context& context, AuditRun& run) {
  reconstruction::AuditOptions options;
  options.should_stop = InterruptGuard::requested;
  const auto start = std::chrono::steady_clock::now();
  run.audit = reconstruction::audit(context, run.scene.clouds, run.map, run.options, options);
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (InterruptGuard::requested()) return kInterrupted;
  if (!o.json.empty()) write_document(o.json, audit_document(run, context));
  if (!o.page.empty()) files::write_atomically(o.page, audit_page(run));
  if (!o.quiet) std::cout << summary(run) << inverted(context, run, options) << std::flush;
  return o.mended.empty() ? status_of(run.audit) : mend(o, context, run, options);
}

int run_audit(AuditVerbOptions o) {
  const std::vector<NamedPath> inputs = {{"SCANS", o.input.path}, {"POSES", o.poses}};
  std::vector<NamedPath> outputs = {{"--json", o.json}, {"--page", o.page}, {"--mend", o.mended}};
  check_outputs(outputs, inputs);
  const InterruptGuard guard;
  const Context context = o.method.context();
  AuditRun run;
  run.input = o.input;
  run.poses_file = o.poses;
  // A bad file shall show before the clouds are read.
  run.map = read_map_poses(o.poses, FragmentFolder(o.input, true).scans, o.input.path);
  outputs.pop_back();
  for (const std::string& file : mended_files(o, run.map.islands.size()))
    outputs.push_back({"--mend", file});
  check_outputs(outputs, inputs);
  o.method.choose_voxel_size(o.input);
  run.options = o.method.registration();
  run.scene = prepare_folder(context, o.input, run.options, o.quiet);
  if (!run.scene.unusable.empty()) run.map = read_map_poses(o.poses, run.scene.scans, o.input.path);
  for (std::size_t k = 0; k < run.map.scans.size(); ++k)
    if (!run.map.scans[k].placed) run.missing.push_back(run.scene.numbers[k]);
  int status = kInterrupted;
  try {
    if (!run.scene.interrupted) status = audit_and_mend(o, context, run);
  } catch (const reconstruction::Cancelled&) {
  }
  if (status == kInterrupted) std::cerr << "gpureg: interrupted" << std::endl;
  return status;
}

}  // namespace

void add_audit(CommandLine& line) {
  const auto o = std::make_shared<AuditVerbOptions>();
  Verb verb = line.verb("audit", "Say where a finished map contradicts its own scans");
  verb.option("SCANS", o->input.path, kScansHelp).required();
  verb.flag("--recursive", o->input.recursive, kRecursiveHelp);
  verb.option(
          "POSES", o->poses,
          "Output folder of `gpureg reconstruct`, or poses of the scans: poses.txt, a trajectory "
          "(TUM with numbers or names of scans as times, KITTI), a Redwood log, or g2o")
      .required();
  verb.option("--json", o->json, "Write every verdict");
  verb.option("--page", o->page, "Write a page (HTML) that shows where the map is broken");
  verb.option("--mend", o->mended,
              "Align again across what is contradicted, and write the mended poses (TUM); of "
              "further islands beside it, as NAME_1.txt");
  o->method.add_to(verb);
  verb.flag("--quiet", o->quiet, "No progress, no summary");
  verb.run([o] {
    o->method.registration();  // reports bad options before the clouds are read
    o->method.refuse({"--min-confidence"}, "in an audit: connections have verdicts of their own");
    if (o->mended.empty())
      o->method.refuse({"--seed", "--quality"}, "without --mend: no pair is aligned");
    return run_audit(*o);
  });
}

}  // namespace gpureg::cli
