// SPDX-License-Identifier: BSD-3-Clause
#include "output.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <gpureg/error.hpp>
#include <gpureg/files.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/flann.hpp>

namespace slam_demo {
namespace {

using nlohmann::json;

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

json error_json(const AteResult& ate) {
  if (ate.poses < 3) return nullptr;
  return {{"poses", ate.poses},
          {"rmse_m", ate.rmse},
          {"mean_m", ate.mean},
          {"median_m", ate.median},
          {"max_m", ate.max}};
}

/// How far a loop is from the truth at its keyframes; null without truth or pose.
json loop_error(const LoopRecord& loop, const RunResult& result) {
  if (loop.state == "rejected") return nullptr;
  Eigen::Isometry3d world_from_camera[2];
  int place = 0;
  for (const double time : {loop.target_time, loop.source_time}) {
    const auto after =
        std::lower_bound(result.truth.begin(), result.truth.end(), time - 1e-3,
                         [](const StampedPose& pose, double t) { return pose.time < t; });
    if (after == result.truth.end() || after->time > time + 0.02) return nullptr;
    world_from_camera[place] = after->world_from_camera;
    if (result.rig.truth_of_depth)
      world_from_camera[place] = world_from_camera[place] * result.rig.colour_from_depth.inverse();
    ++place;
  }
  const Eigen::Isometry3d truth = world_from_camera[0].inverse() * world_from_camera[1],
                          error = truth.inverse() * loop.target_from_source;
  return {{"translation_m", error.translation().norm()},
          {"rotation_degrees", Eigen::AngleAxisd(error.linear()).angle() * 57.29577951308232}};
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
                     {"error", loop_error(r, result)},
                     {"image_loops", r.image_loops}});
    loops.back()["drift_ratio"] =
        std::isfinite(r.drift_ratio) ? json(r.drift_ratio) : json(nullptr);
  }
  for (const ImageLoopRecord& r : slam.loops().image_records())
    image.push_back(
        {{"keyframe", r.keyframe}, {"target_keyframe", r.target}, {"inliers", r.inliers}});
  json page = {{"sequence", result.sequence},
               {"command", result.command},
               {"frames", result.frames},
               {"frames_done", result.frames_done},
               {"frames_lost", slam.lost()},
               {"frames_damaged", result.problems},
               {"frames_out_of_order", result.out_of_order},
               {"frames_tracked_densely", slam.dense()},
               {"keyframes", slam.map().keyframes.size()},
               {"fragments", slam.fragments()},
               {"worlds", slam.worlds()},
               {"surfels", slam.all_surfels()},
               {"seconds", result.seconds},
               {"milliseconds", slam.milliseconds()},
               {"ate_odometry", error_json(result.odometry)},
               {"ate", error_json(result.final)},
               {"notes", slam.loops().notes},
               {"loops", loops},
               {"session_loops", image}};
  page["milliseconds"]["reading images"] = result.load_milliseconds;
  page["surface"] = result.surface.points == 0 ? json(nullptr)
                                               : json{{"points", result.surface.points},
                                                      {"mean_m", result.surface.mean},
                                                      {"median_m", result.surface.median},
                                                      {"share_within_20cm", result.surface.within}};
  return page;
}

}  // namespace

SurfaceError surface_error(const gpureg::PointCloud& truth, const std::vector<Eigen::Vector3f>& map,
                           const Eigen::Isometry3d& truth_from_map) {
  SurfaceError result;
  if (truth.points.empty() || map.empty()) return result;
  if (truth.normals.size() != truth.points.size())
    throw gpureg::InvalidArgument("the true surface has no normals");
  const cv::Mat1f points(static_cast<int>(truth.points.size()), 3,
                         const_cast<float*>(truth.points.front().data()));
  cv::flann::GenericIndex<cvflann::L2_Simple<float>> tree(points,
                                                          cvflann::KDTreeSingleIndexParams(16));
  const cvflann::SearchParams exact(-1, 0.0f);
  const Eigen::Isometry3f move = truth_from_map.cast<float>();
  std::vector<double> distances;
  std::size_t within = 0;
  for (const Eigen::Vector3f& q : map) {
    const Eigen::Vector3f p = move * q;
    const std::vector<float> query{p.x(), p.y(), p.z()};
    std::vector<int> index(1);
    std::vector<float> squared(1);
    tree.knnSearch(query, index, squared, 1, exact);
    const auto nearest = static_cast<std::size_t>(index[0]);
    double distance = std::sqrt(squared[0]);
    if (distance < kSurfaceReach) {
      ++within;
      // Beside the samples the surface goes on in their tangent planes.
      if (distance < 0.03)
        distance = std::abs(truth.normals[nearest].dot(p - truth.points[nearest]));
    }
    distances.push_back(std::min(distance, kSurfaceReach));
    result.mean += distances.back();
  }
  result.points = map.size();
  result.mean /= static_cast<double>(map.size());
  result.within = static_cast<double>(within) / static_cast<double>(map.size());
  std::nth_element(distances.begin(), distances.begin() + static_cast<long>(map.size() / 2),
                   distances.end());
  result.median = distances[map.size() / 2];
  return result;
}

void write_results(const std::string& folder, const Slam& slam, const RunResult& result) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw gpureg::IoError(folder + ": cannot make this folder: " + error.message());
  write_tum(folder + "/trajectory.txt", slam.trajectory());
  write_tum(folder + "/odometry.txt", slam.odometry());
  Trajectory keyframes;
  for (const Keyframe& keyframe : slam.map().keyframes)
    keyframes.push_back({keyframe.time, keyframe.world_from_camera});
  write_tum(folder + "/keyframes.txt", keyframes);
  const surfel::Cloud surfels = slam.surfels();
  gpureg::files::write_atomically(folder + "/map.ply", ply_of(surfels));
  gpureg::files::write_atomically(folder + "/loops.json", loops_json(slam, result).dump(1) + "\n");
  gpureg::files::write_atomically(folder + "/report.html", report_page(slam, result, surfels));
}

}  // namespace slam_demo
