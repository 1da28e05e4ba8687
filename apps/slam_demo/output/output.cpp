// SPDX-License-Identifier: BSD-3-Clause
#include "output/output.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <gpureg/error.hpp>
#include <gpureg/files.hpp>
#include <gpureg/io.hpp>

namespace slam_demo {
namespace {

namespace ev = gpureg::evaluation;
using nlohmann::json;

constexpr double kDegrees = 57.29577951308232;  // of a radian

void append(std::string& bytes, float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>((bits >> shift) & 0xFFu);
}

std::string ply_of(const surfel::Cloud& surfels) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                      std::to_string(surfels.size()) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "radius", "confidence"})
    bytes += std::string("property float ") + name + "\n";
  for (const char* name : {"red", "green", "blue"})
    bytes += std::string("property uchar ") + name + "\n";
  bytes += "end_header\n";
  bytes.reserve(bytes.size() + 35 * surfels.size());
  for (const surfel::Surfel& s : surfels) {
    for (const float value : {s.position.x, s.position.y, s.position.z, s.normal.x, s.normal.y,
                              s.normal.z, s.radius, s.confidence})
      append(bytes, value);
    for (int shift = 16; shift >= 0; shift -= 8)
      bytes += static_cast<char>((s.colour >> shift) & 0xFFu);
  }
  return bytes;
}

json error_json(const ev::TrajectoryEvaluation& e) {
  if (e.matched == 0) return nullptr;
  return {{"poses", e.matched},
          {"path_m", e.path_length},
          {"rmse_m", e.absolute_translation.rmse},
          {"mean_m", e.absolute_translation.mean},
          {"median_m", e.absolute_translation.median},
          {"max_m", e.absolute_translation.max}};
}

/// How far a loop is from the truth at its keyframes; null without truth or pose.
json loop_error(double target_time, double source_time, const Eigen::Isometry3d& target_from_source,
                const RunResult& result) {
  Eigen::Isometry3d world_from_camera[2];
  int place = 0;
  for (const double time : {target_time, source_time}) {
    const auto after =
        std::lower_bound(result.truth.begin(), result.truth.end(), time - 1e-3,
                         [](const ev::StampedPose& pose, double t) { return pose.time < t; });
    if (after == result.truth.end() || after->time > time + 0.02) return nullptr;
    world_from_camera[place].matrix() = after->world_from_body;
    if (result.rig.truth_of_depth)
      world_from_camera[place] = world_from_camera[place] * result.rig.colour_from_depth.inverse();
    ++place;
  }
  const Eigen::Isometry3d truth = world_from_camera[0].inverse() * world_from_camera[1],
                          error = truth.inverse() * target_from_source;
  return {{"translation_m", error.translation().norm()},
          {"rotation_degrees", Eigen::AngleAxisd(error.linear()).angle() * kDegrees}};
}

/// How long frames waited for loops.
json waits_json(const std::vector<double>& waits) {
  json bins = json::array();
  double lower = 0;
  for (const double upper : {1., 2., 5., 10., 20., 50., 100., 1e9}) {
    const auto frames = std::count_if(waits.begin(), waits.end(),
                                      [&](double w) { return w >= lower && w < upper; });
    bins.push_back({{"from_ms", lower}, {"frames", frames}});
    lower = upper;
  }
  const auto longest = std::max_element(waits.begin(), waits.end());
  return {{"longest_ms", longest == waits.end() ? 0 : *longest}, {"histogram", bins}};
}

/// How many keyframes see a point of the map.
double keyframes_per_point(const Map& map) {
  double points = 0, observations = 0;
  for (const MapPoint& point : map.points) {
    points += !point.bad;
    if (!point.bad) observations += static_cast<double>(point.observations.size());
  }
  return points > 0 ? observations / points : 0;
}

json loops_json(const Slam& slam, const RunResult& result) {
  json loops = json::array(), image = json::array();
  for (const LoopRecord& r : slam.loops().records()) {
    loops.push_back({{"source_fragment", r.source},
                     {"target_fragment", r.target},
                     {"source_keyframe", r.source_keyframe},
                     {"target_keyframe", r.target_keyframe},
                     {"source_time_s", r.source_time},
                     {"target_time_s", r.target_time},
                     {"state", r.state},
                     {"reason", r.reason},
                     {"confidence", r.confidence},
                     {"error", r.state == "rejected" ? json(nullptr)
                                                     : loop_error(r.target_time, r.source_time,
                                                                  r.target_from_source, result)},
                     {"image_loops", r.image_loops}});
    if (r.state == "accepted") {
      const Misfit misfit =
          misfit_of(slam.map(), r.target_keyframe, r.source_keyframe, r.target_from_source);
      loops.back()["misfit"] = {{"translation_m", misfit.metres},
                                {"rotation_degrees", misfit.radians * kDegrees}};
    }
    loops.back()["drift_ratio"] =
        std::isfinite(r.drift_ratio) ? json(r.drift_ratio) : json(nullptr);
  }
  for (const ImageLoopRecord& r : slam.loops().image_records())
    image.push_back({{"keyframe", r.keyframe},
                     {"target_keyframe", r.target},
                     {"inliers", r.inliers},
                     {"state", r.retracted ? "retracted" : "accepted"},
                     {"error", loop_error(slam.map().keyframes[at(r.target)].time,
                                          slam.map().keyframes[at(r.keyframe)].time,
                                          r.target_from_source, result)}});
  json page = {{"sequence", result.sequence},
               {"frames", result.frames},
               {"frames_done", result.frames_done},
               {"frames_lost", slam.lost()},
               {"frames_damaged", result.problems},
               {"frames_out_of_order", result.out_of_order},
               {"frames_tracked_densely", slam.dense()},
               {"keyframes", slam.map().keyframes.size()},
               {"keyframes_per_point", keyframes_per_point(slam.map())},
               {"fragments", slam.fragments()},
               {"worlds", slam.worlds()},
               {"surfels", slam.all_surfels()},
               {"seconds", result.seconds},
               {"milliseconds", slam.milliseconds()},
               {"waits_for_loops", waits_json(slam.waits())},
               {"ate_odometry", error_json(result.odometry)},
               {"ate", error_json(result.final)},
               {"notes", slam.loops().notes},
               {"loops", loops},
               {"image_loops", image}};
  page["milliseconds"]["reading images"] = result.load_milliseconds;
  const ev::ErrorStatistics& d = result.surface.distance;
  page["surface"] = d.count == 0 ? json(nullptr)
                                 : json{{"points", d.count},
                                        {"mean_m", d.mean},
                                        {"median_m", d.median},
                                        {"points_beyond_20cm", result.surface.beyond}};
  return page;
}

}  // namespace

std::string text_of(const nlohmann::json& document, int indent) {
  return document.dump(indent, ' ', false, json::error_handler_t::replace);
}

void evaluate(const Slam& slam, const std::string& true_surface, RunResult& result) {
  constexpr std::size_t kNeeded = 3;  // poses that hold an alignment
  const Trajectory final = slam.trajectory(), odometry = slam.odometry();
  if (result.truth.empty() || final.size() < kNeeded) return;
  try {
    result.final = ev::evaluate_trajectory(final, result.truth);
    result.odometry = ev::evaluate_trajectory(odometry, result.truth);
  } catch (const gpureg::InvalidArgument&) {
    return;  // times without a true pose
  }
  const surfel::Cloud surfels = slam.surfels();
  if (true_surface.empty() || surfels.empty()) return;
  const gpureg::PointCloud truth = gpureg::io::read_point_cloud(true_surface);
  // The map is in the world of the colour camera; so is the alignment where depth is registered.
  const Eigen::Matrix4f move = result.final.truth_from_estimate.cast<float>();
  std::vector<Eigen::Vector3f> map;
  for (const surfel::Surfel& s : surfels)
    map.push_back((move * Eigen::Vector4f(s.position.x, s.position.y, s.position.z, 1)).head<3>());
  result.surface = ev::evaluate_surface(map, truth.points, truth.normals);
}

void make_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw gpureg::IoError(folder + ": cannot make this folder: " + error.message());
}

void write_results(const std::string& folder, const Slam& slam, const RunResult& result) {
  make_folder(folder);
  ev::write_trajectory(folder + "/trajectory.txt", slam.trajectory());
  ev::write_trajectory(folder + "/odometry.txt", slam.odometry());
  Trajectory keyframes;
  for (const Keyframe& keyframe : slam.map().keyframes)
    keyframes.push_back({keyframe.time, keyframe.world_from_camera.matrix()});
  ev::write_trajectory(folder + "/keyframes.txt", keyframes);
  write_depth_calibration(folder + "/depth_calibration.json", slam.map().calibration);
  const surfel::Cloud surfels = slam.surfels();
  gpureg::files::write_atomically(folder + "/map.ply", ply_of(surfels));
  const json figures = loops_json(slam, result);
  gpureg::files::write_atomically(folder + "/loops.json", text_of(figures, 1) + "\n");
  gpureg::files::write_atomically(folder + "/report.html",
                                  report_page(slam, result, surfels, figures));
}

}  // namespace slam_demo
