// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "inputs/calibration_file.hpp"
#include "inputs/cloud_file.hpp"
#include "inputs/odometry_file.hpp"
#include "inputs/scene.hpp"
#include "inputs/scene_file.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"
#include "options/method_options.hpp"
#include "options/output_path.hpp"
#include "run/interrupt.hpp"
#include "run/progress.hpp"
#include "run/spacing.hpp"
#include "run/viewpoint_note.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

struct CalibrateOptions {
  ScanInput input;
  std::string output, trajectory;
  MethodOptions method;
  CalibrationOptions calibration;
  std::optional<double> max_risk;
  std::vector<std::string> scenes;
  bool quiet = false;
};

/// The fragments of the folder, with their cameras.
struct Clouds {
  std::vector<int> numbers;
  std::vector<PointCloud> clouds;

  std::vector<PointCloudView> views() const {
    std::vector<PointCloudView> out;
    for (const PointCloud& cloud : clouds) out.push_back(cloud.view());
    return out;
  }
};

Clouds read_clouds(const CalibrateOptions& o) {
  const FragmentFolder folder(o.input, o.quiet);
  Clouds out{folder.numbers, {}};
  ViewpointNote viewpoints;
  for (std::size_t k = 0; k < folder.scans.size(); ++k) {
    out.clouds.push_back(folder.read(k, mesh_spacing(o.method.voxel_size),
                                     o.quiet ? MeshNote::none : MeshNote::print));
    if (!o.quiet) viewpoints.see(out.clouds.back(), folder.scans[k].path);
    check_voxel_size(o.method.voxel_size, extent_of(out.clouds.back().points),
                     folder.scans[k].path);
  }
  viewpoints.print();
  return out;
}

void print_count(const char* name, const CalibrationCount& count) {
  if (count.pairs == 0) return;
  std::cout << name << grouped(count.pairs) << " pairs, " << grouped(count.samples)
            << " of them decided, " << grouped(count.correct) << " correct\n";
}

std::vector<SceneFile> read_scenes(const std::vector<std::string>& paths) {
  std::vector<SceneFile> out;
  for (const std::string& path : paths) {
    SceneFile scene = read_scene(path);
    for (const SceneFile& other : out) check_different(other, scene);
    out.push_back(std::move(scene));
  }
  return out;
}

std::vector<std::uint64_t> fingerprints(const std::vector<PointCloudView>& clouds) {
  std::vector<std::uint64_t> out;
  for (const PointCloudView& cloud : clouds)
    if (cloud.size > 0) out.push_back(cloud_fingerprint(cloud));
  return out;
}

/// scenes: those of --scenes.
std::optional<PromisedRisk> promise(const CalibrateOptions& o, const CalibrationResult& result,
                                    const std::vector<SceneFile>& scenes) {
  if (!o.max_risk) return std::nullopt;
  PromisedRisk out;
  out.control.max_risk = *o.max_risk;
  if (scenes.empty()) {
    out.threshold = control_risk_of_scans(result.of_two_scans(), result.scan_groups, out.control,
                                          result.calibration);
    return out;
  }
  if (result.of_two_scans().empty())
    throw InvalidArgument(o.input.path + " has no decided pair of different scans");
  std::vector<std::vector<CalibrationSample>> pairs{result.of_two_scans()};
  for (const SceneFile& scene : scenes) pairs.push_back(scene.pairs);
  out.threshold = control_risk_of_scenes(pairs, out.control, result.calibration);
  return out;
}

/// The answer to --max-risk. A refusal is no summary: --quiet keeps it.
void print_risk(const CalibrateOptions& o, const PromisedRisk& risk) {
  const RiskThreshold& found = risk.threshold;
  const std::string percent = significant(100 * risk.control.max_risk, 3) + " %";
  if (found.supported && !o.quiet)
    std::cout << "risk         at most " << percent << " of the reports "
              << (found.scenes > 0 ? "of a scene " : "") << "are false from confidence "
              << fixed(found.min_confidence, 4) << " on: " << found.wrong << " of "
              << grouped(found.reported) << " were; " << fixed(100 * found.recall, 1)
              << " % of the correct poses are reported\n";
  if (found.supported) return;
  std::cerr << "gpureg: a risk of " << percent << " cannot be promised by "
            << grouped(found.samples) << " decided pairs of "
            << (found.scenes > 0 ? grouped(found.scenes) + " scenes: "
                                 : grouped(found.scans) + " scans: ");
  if (found.more_scenes)
    std::cerr << grouped(*found.more_scenes) << " more scenes are needed at least";
  else if (found.more_scans)
    std::cerr << "about " << grouped(*found.more_scans)
              << " more scans would do, if no larger share of their pairs is false";
  else
    std::cerr << "more would not help, too few poses are confident or too many of these are false";
  std::cerr << std::endl;
}

int run(CalibrateOptions o) {
  if (o.max_risk && !(*o.max_risk > 0 && *o.max_risk < 1))
    throw InvalidArgument("--max-risk is " + significant(*o.max_risk, 6) +
                          ", expected a share between 0 and 1");
  if (!o.scenes.empty() && !o.max_risk) throw InvalidArgument("--scenes needs --max-risk");
  o.method.registration();  // what is wrong with it shall be said before clouds are read
  o.method.refuse({"--min-confidence"}, "in a calibration: poses of every confidence count");
  if (o.method.preset == "loopsmart")
    throw InvalidArgument("--preset loopsmart has no confidence to calibrate");
  std::vector<NamedPath> inputs = {{"SCANS", o.input.path}, {"--trajectory", o.trajectory}};
  for (const std::string& scene : o.scenes) inputs.push_back({"--scenes", scene});
  check_outputs({{"-o", o.output}}, inputs);
  const std::vector<SceneFile> scenes = read_scenes(o.scenes);
  const FragmentFolder folder(o.input, true);
  std::vector<UnalignedIsometry3d> poses;
  if (!o.trajectory.empty()) poses = read_scan_poses(o.trajectory, folder.scans, o.input.path);
  o.method.choose_voxel_size(o.input);
  const RegistrationOptions options = o.method.registration();
  for (const SceneFile& scene : scenes) check_options(scene, scene_options(options));
  const InterruptGuard guard;
  const Clouds clouds = read_clouds(o);
  const SceneFile here{o.input.path, {}, fingerprints(clouds.views()), {}};
  for (const SceneFile& scene : scenes) check_different(here, scene);
  const Context context = o.method.context();

  std::optional<Progress> progress;
  CalibrationCallbacks callbacks;
  callbacks.on_progress = [&](std::size_t done, std::size_t total) {
    if (!progress) progress.emplace("aligning", "pairs", total, o.quiet);
    progress->update(done);
  };
  callbacks.should_stop = [] { return InterruptGuard::requested(); };
  const CalibrationResult result =
      calibrate(context, clouds.views(), options, o.calibration, poses, callbacks);
  progress.reset();
  if (result.stopped) {
    std::cerr << "gpureg: interrupted, nothing written" << std::endl;
    return kInterrupted;
  }
  const std::optional<PromisedRisk> risk = promise(o, result, scenes);
  write_document(o.output,
                 calibration_document(result, options, o.method.quality, here.clouds, risk));
  if (!result.enough_samples)
    std::cerr << "gpureg: note: too few samples: " << kMinDecidedPairs
              << " decided pairs of different scans are needed, and " << kMinCalibrationSamples
              << " correct and as many false samples in all; the calibration changes nothing"
              << std::endl;
  if (risk) print_risk(o, *risk);
  const int status = risk && !risk->threshold.supported ? kNoAlignment : kOk;
  if (o.quiet) return status;
  std::cout << "voxel size   " << o.method.voxel_size_text() << "\n"
            << "fragments    " << clouds.numbers.size() << "\n";
  print_count("of one scan  ", result.one_scan);
  print_count("by loops     ", result.loop_consistency);
  print_count("by poses     ", result.trajectory);
  std::cout << "slope        " << fixed(result.calibration.slope, 3) << "\n"
            << "offset       " << fixed(result.calibration.offset, 3) << "\n"
            << "error        " << fixed(result.error_before, 3) << " before, "
            << fixed(result.error_after, 3) << " after, of the same samples\n"
            << "written to   " << o.output << "\n";
  return status;
}

}  // namespace

void add_calibrate(CommandLine& line) {
  const auto o = std::make_shared<CalibrateOptions>();
  Verb verb = line.verb("calibrate",
                        "Fit the scale of the confidence to the clouds of a folder, without truth");
  verb.option("SCANS", o->input.path, kScansHelp).required();
  verb.flag("--recursive", o->input.recursive, kRecursiveHelp);
  verb.option("-o,--output", o->output,
              "JSON file for --calibration of register, batch and reconstruct")
      .required();
  verb.option(
      "--trajectory", o->trajectory,
      "Poses of the scans, which decide instead of loops: TUM with numbers or names of scans "
      "as times, or poses.txt");
  verb.option("--self-pairs", o->calibration.self_pairs, "Pairs made of one scan")
      .natural()
      .show_default();
  verb.option("--scan-pairs", o->calibration.scan_pairs,
              "Largest number of pairs of different scans")
      .natural()
      .show_default();
  verb.option(
      "--max-risk", o->max_risk,
      "Also choose the --min-confidence that keeps the share of false reports at or below this, "
      "for runs with this calibration");
  verb.option(
      "--scenes", o->scenes,
      "Calibration files of other scenes: --max-risk then holds for a further scene, with 19 "
      "or more");
  o->method.add_to(verb);
  verb.flag("--quiet", o->quiet, "No progress, no summary");
  verb.run([o] { return run(*o); });
}

}  // namespace gpureg::cli
