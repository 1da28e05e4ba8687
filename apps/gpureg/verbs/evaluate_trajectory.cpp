// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <map>
#include <memory>
#include <string>

#include "command.hpp"
#include "gpureg/evaluation/trajectory.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"
#include "options/output_path.hpp"
#include "records/result_json.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

using evaluation::DeltaUnit;
using evaluation::ErrorStatistics;
using evaluation::TrajectoryFormat;

struct TrajectoryRun {
  std::string estimate, truth, json;
  TrajectoryFormat format = TrajectoryFormat::automatic;
  evaluation::TrajectoryOptions options;
  bool no_align = false;
};

const std::map<std::string, TrajectoryFormat> kFormats = {{"auto", TrajectoryFormat::automatic},
                                                          {"tum", TrajectoryFormat::tum},
                                                          {"kitti", TrajectoryFormat::kitti},
                                                          {"poses", TrajectoryFormat::blocks}};
const std::map<std::string, DeltaUnit> kDeltaUnits = {{"frames", DeltaUnit::frames},
                                                      {"metres", DeltaUnit::metres}};

Json statistics_json(const ErrorStatistics& s) {
  if (s.count == 0) return nullptr;
  return {{"count", s.count},         {"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median},
          {"deviation", s.deviation}, {"min", s.min},   {"max", s.max}};
}

Json trajectory_document(const TrajectoryRun& o, const evaluation::TrajectoryEvaluation& e) {
  const bool frames = o.options.delta_unit == DeltaUnit::frames;
  return {{"gpureg", "evaluate-trajectory"},
          {"version", GPUREG_VERSION},
          {"estimate", o.estimate},
          {"ground_truth", o.truth},
          {"options",
           {{"max_difference", o.options.max_difference},
            {"align", o.options.align},
            {"delta", o.options.delta},
            {"delta_unit", frames ? "frames" : "metres"}}},
          {"poses", {{"estimated", e.estimated}, {"true", e.true_poses}, {"matched", e.matched}}},
          {"path_length", e.path_length},
          {"truth_from_estimate", to_json(e.truth_from_estimate)},
          {"ate",
           {{"metres", statistics_json(e.absolute_translation)},
            {"degrees", statistics_json(e.absolute_rotation)}}},
          {"rpe",
           {{"metres", statistics_json(e.relative_translation)},
            {"degrees", statistics_json(e.relative_rotation)}}}};
}

void print_row(const std::string& name, const ErrorStatistics& s) {
  std::cout << pad_right(name, 16);
  if (s.count == 0) {
    std::cout << "no step is long enough\n";
    return;
  }
  for (const double value : {s.rmse, s.mean, s.median, s.deviation, s.min, s.max})
    std::cout << pad_left(fixed(value, 4), 10);
  std::cout << "\n";
}

int run(const TrajectoryRun& o) {
  check_outputs({{"--json", o.json}}, {{"ESTIMATE", o.estimate}, {"--ground-truth", o.truth}});
  o.options.validate();
  const evaluation::Trajectory estimate = evaluation::read_trajectory(o.estimate, o.format),
                               truth = evaluation::read_trajectory(o.truth, o.format);
  const evaluation::TrajectoryEvaluation e =
      evaluation::evaluate_trajectory(estimate, truth, o.options);
  std::cout << "poses           " << e.matched << " matched of " << e.estimated << " estimated, "
            << e.true_poses << " true; path of " << fixed(e.path_length, 3) << " m\n"
            << pad_right("", 16);
  for (const char* name : {"rmse", "mean", "median", "deviation", "min", "max"})
    std::cout << pad_left(name, 10);
  std::cout << "\n";
  print_row("ATE metres", e.absolute_translation);
  print_row("ATE degrees", e.absolute_rotation);
  print_row("RPE metres", e.relative_translation);
  print_row("RPE degrees", e.relative_rotation);
  if (!o.json.empty()) write_document(o.json, trajectory_document(o, e));
  return kOk;
}

}  // namespace

void add_evaluate_trajectory(CommandLine& line) {
  const auto o = std::make_shared<TrajectoryRun>();
  Verb verb = line.verb("evaluate-trajectory", "Measure the errors of a trajectory: ATE and RPE");
  verb.option("ESTIMATE", o->estimate,
              "Trajectory: TUM, KITTI, or poses.txt of `gpureg reconstruct`")
      .required();
  verb.option("--ground-truth", o->truth, "True trajectory, in the same format or another")
      .required();
  verb.choice("--format", o->format, kFormats, "Of both files; auto: by the fields of a line")
      .show_default("auto")
      .type_name("auto|tum|kitti|poses");
  verb.option("--max-difference", o->options.max_difference,
              "Largest difference of the times of two poses that belong together")
      .show_default()
      .not_negative();
  verb.flag("--no-align", o->no_align,
            "Compare the poses as they are; without: after the rigid motion, without scale, "
            "that fits the positions best");
  verb.option("--delta", o->options.delta, "Step of the relative error, in --delta-unit")
      .show_default()
      .positive();
  verb.choice("--delta-unit", o->options.delta_unit, kDeltaUnits,
              "frames: every pose and the one so many later; metres: consecutive steps of at "
              "least that length")
      .show_default("frames")
      .type_name("frames|metres");
  verb.option("--json", o->json, "Write the figures");
  verb.run([o] {
    o->options.align = !o->no_align;
    return run(*o);
  });
}

}  // namespace gpureg::cli
