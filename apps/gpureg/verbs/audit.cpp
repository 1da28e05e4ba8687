// SPDX-License-Identifier: BSD-3-Clause
#include "verbs/audit.hpp"

#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>
#include <sstream>

#include "exit_status.hpp"
#include "gpureg/error.hpp"
#include "gpureg/evaluation/trajectory.hpp"
#include "gpureg/files.hpp"
#include "gpureg/reconstruction/mend.hpp"
#include "inputs/map_poses.hpp"
#include "inputs/scene.hpp"
#include "json/json_file.hpp"
#include "options/method_options.hpp"
#include "options/output_path.hpp"
#include "pages/audit_page.hpp"
#include "records/audit_document.hpp"
#include "run/interrupt.hpp"
#include "run/pair_run.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

struct AuditVerbOptions {
  std::string folder, poses, json, page, mended;
  MethodOptions method;
  bool quiet = false;
};

/// Poses of other scans, or in other units, may keep most scans out of each other's sight. Of right
/// maps at most one connection of six was undecided.
bool says_nothing(const reconstruction::Audit& audit) {
  return audit.sound() && audit.count(reconstruction::ConnectionVerdict::confirmed) <=
                              audit.count(reconstruction::ConnectionVerdict::undecided);
}

int status_of(const reconstruction::Audit& audit) {
  return audit.sound() && !says_nothing(audit) ? kOk : kNoAlignment;
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
  for (const reconstruction::AuditedConnection& connection : run.audit.connections)
    if (connection.verdict == reconstruction::ConnectionVerdict::contradicted)
      out << "broken     " << describe(run, connection) << "\n";
  out << "undecided  " << run.audit.count(reconstruction::ConnectionVerdict::undecided) << " of "
      << run.audit.connections.size() << " connections\n"
      << (says_nothing(run.audit)
              ? "verdict    undecided: most scans do not see each other; are they poses of these "
                "scans, in the unit of their points?\n"
          : run.audit.sound() ? "verdict    sound: no connection is contradicted\n"
                              : "verdict    contradicted\n");
  return out.str();
}

/// Writes the mended poses. The exit status is that of their audit.
int mend(const AuditVerbOptions& o, const Context& context, const AuditRun& run) {
  const reconstruction::MendedMap map = reconstruction::mend(
      context, run.scene.clouds, run.poses, run.audit, run.options,
      reconstruction::AuditOptions::from_voxel_size(run.options.prepare.voxel_size));
  evaluation::Trajectory trajectory;
  for (std::size_t k = 0; k < map.world_from_scan.size(); ++k)
    if (map.world_from_scan[k].matrix().allFinite())
      trajectory.push_back(
          {static_cast<double>(run.scene.numbers[k]), map.world_from_scan[k].matrix()});
  evaluation::write_trajectory(o.mended, trajectory);
  if (!o.quiet)
    std::cout << "mended     " << map.registered << " pairs aligned, " << map.moved.size()
              << " scans moved, " << map.left_out.size() << " left out; "
              << (map.audit.sound() ? "sound" : "still contradicted") << "\n";
  return status_of(map.audit);
}

int run_audit(const AuditVerbOptions& o) {
  check_outputs({{"--json", o.json}, {"--page", o.page}, {"--mend", o.mended}},
                {{"SCANS", o.folder}, {"POSES", o.poses}});
  const InterruptGuard guard;
  const Context context = o.method.context();
  AuditRun run;
  run.folder = o.folder;
  run.poses_file = o.poses;
  run.options = o.method.registration();
  // A bad file shall show before the clouds are read.
  run.poses = read_map_poses(o.poses, FragmentFolder(o.folder, true).numbers, o.folder);
  run.scene = prepare_folder(context, o.folder, run.options.prepare, o.quiet);
  if (run.scene.interrupted) return kInterrupted;
  if (!run.scene.unusable.empty()) run.poses = read_map_poses(o.poses, run.scene.numbers, o.folder);
  for (std::size_t k = 0; k < run.poses.size(); ++k)
    if (!run.poses[k].matrix().allFinite()) run.missing.push_back(run.scene.numbers[k]);
  const auto start = std::chrono::steady_clock::now();
  run.audit = reconstruction::audit(
      context, run.scene.clouds, run.poses, run.options,
      reconstruction::AuditOptions::from_voxel_size(run.options.prepare.voxel_size));
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!o.json.empty()) write_document(o.json, audit_document(run, context));
  if (!o.page.empty()) files::write_atomically(o.page, audit_page(run));
  if (!o.quiet) std::cout << summary(run);
  if (!o.mended.empty()) return mend(o, context, run);
  return status_of(run.audit);
}

}  // namespace

void add_audit(CommandLine& line) {
  const auto o = std::make_shared<AuditVerbOptions>();
  Verb verb = line.verb("audit", "Say where a finished map contradicts its own scans");
  verb.option("SCANS", o->folder, "Folder with cloud_bin_<i>, and perhaps cameras.txt").required();
  verb.option("POSES", o->poses,
              "Poses of the scans: poses.txt, a trajectory (TUM with fragment numbers as times, "
              "KITTI), a Redwood log, or g2o")
      .required();
  verb.option("--json", o->json, "Write every verdict");
  verb.option("--page", o->page, "Write a page (HTML) that shows where the map is broken");
  verb.option("--mend", o->mended,
              "Align again across what is contradicted, and write the mended poses (TUM)");
  o->method.add_to(verb);
  verb.flag("--quiet", o->quiet, "No progress, no summary");
  verb.run([o] {
    o->method.registration();  // reports bad options before the clouds are read
    o->method.refuse({"--min-score"}, "in an audit: connections have verdicts of their own");
    if (o->mended.empty())
      o->method.refuse({"--seed", "--quality"}, "without --mend: no pair is aligned");
    choose_voxel_size(o->method, o->folder);
    return run_audit(*o);
  });
}

}  // namespace gpureg::cli
