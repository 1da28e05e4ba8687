// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <cmath>
#include <iostream>
#include <memory>
#include <string>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "gpureg/evaluation/surface_error.hpp"
#include "gpureg/io.hpp"
#include "inputs/cloud_file.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"
#include "options/output_path.hpp"
#include "records/result_json.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

struct SurfaceRun {
  std::string map, truth, estimate, true_trajectory, json;
  evaluation::SurfaceOptions options;
};

/// Moves the map by the rigid motion that fits the trajectories best; without them not at all.
Eigen::Matrix4d alignment_of(const SurfaceRun& o) {
  if (o.estimate.empty()) return Eigen::Matrix4d::Identity();
  return evaluation::evaluate_trajectory(evaluation::read_trajectory(o.estimate),
                                         evaluation::read_trajectory(o.true_trajectory))
      .truth_from_estimate;
}

Json document_of(const SurfaceRun& o, const Eigen::Matrix4d& truth_from_map,
                 const evaluation::SurfaceEvaluation& e) {
  return {{"gpureg", "evaluate-surface"},
          {"version", GPUREG_VERSION},
          {"map", o.map},
          {"surface", o.truth},
          {"options",
           {{"plane_reach", o.options.plane_reach}, {"max_distance", o.options.max_distance}}},
          {"truth_from_map", to_json(truth_from_map)},
          {"points", e.distance.count},
          {"points_beyond", e.beyond},
          {"points_not_finite", e.skipped},
          {"metres",
           {{"mean", e.distance.mean},
            {"median", e.distance.median},
            {"rmse", e.distance.rmse},
            {"max", e.distance.max}}}};
}

int run(const SurfaceRun& o) {
  if (o.estimate.empty() != o.true_trajectory.empty())
    throw InvalidArgument("--trajectory and --ground-truth align the map together: " +
                          std::string(o.estimate.empty() ? "--trajectory" : "--ground-truth") +
                          " is missing");
  o.options.validate();
  check_outputs({{"--json", o.json}}, {{"MAP", o.map},
                                       {"--surface", o.truth},
                                       {"--trajectory", o.estimate},
                                       {"--ground-truth", o.true_trajectory}});
  const Eigen::Matrix4d truth_from_map = alignment_of(o);
  const PointCloud truth = io::read_point_cloud(o.truth);
  PointCloud map = io::read_point_cloud(o.map);
  note_coarse(truth, o.truth);
  note_coarse(map, o.map);
  const Eigen::Isometry3d move(truth_from_map);
  for (Eigen::Vector3f& p : map.points)
    p = (move * (p.cast<double>() + map.origin) - truth.origin).cast<float>();
  const evaluation::SurfaceEvaluation e =
      evaluation::evaluate_surface(map.points, truth.points, truth.normals, o.options);
  std::cout << "points          " << e.distance.count << ", " << e.beyond << " beyond "
            << fixed(o.options.max_distance, 3) << " m, " << e.skipped << " not finite\n"
            << "distance to     " << (truth.normals.empty() ? "points" : "tangent planes") << "\n"
            << pad_right("", 16);
  for (const char* name : {"mean", "median", "rmse", "max"}) std::cout << pad_left(name, 10);
  std::cout << "\n" << pad_right("metres", 16);
  for (const double value : {e.distance.mean, e.distance.median, e.distance.rmse, e.distance.max})
    std::cout << pad_left(fixed(value, 4), 10);
  std::cout << "\n";
  if (!o.json.empty()) write_document(o.json, document_of(o, truth_from_map, e));
  return kOk;
}

}  // namespace

void add_evaluate_surface(CommandLine& line) {
  const auto o = std::make_shared<SurfaceRun>();
  Verb verb = line.verb("evaluate-surface", "Measure the distance of a map to the true surface");
  verb.option("MAP", o->map, "Points of the map: PLY or PCD").required();
  verb.option("--surface", o->truth,
              "Points of the true surface: PLY or PCD, with normals where distances are those "
              "to tangent planes")
      .required();
  verb.option("--trajectory", o->estimate,
              "Trajectory of the map; with --ground-truth: both are aligned first");
  verb.option("--ground-truth", o->true_trajectory, "True trajectory");
  verb.option("--plane-reach", o->options.plane_reach,
              "Metres from a true point within which its tangent plane counts; 0: points only")
      .show_default()
      .not_negative();
  verb.option("--max-distance", o->options.max_distance,
              "Distances beyond count as this one, metres")
      .show_default()
      .positive();
  verb.option("--json", o->json, "Write the figures");
  verb.run([o] { return run(*o); });
}

}  // namespace gpureg::cli
