// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <future>
#include <gpureg/error.hpp>
#include <iostream>

#include "camera_file.hpp"
#include "output/output.hpp"
#include "output/progress.hpp"
#include "output/rerun.hpp"
#include "stopwatch.hpp"
#include "tracking/tracking_file.hpp"

namespace slam_demo {
namespace {

std::atomic<bool> interrupted{false};
void interrupt(int) { interrupted = true; }

struct Arguments {
  std::string sequence, backend = "auto", truth, surface, tracking, rerun, calibration,
                        output = "slam_demo_output";
  std::vector<std::string> colour;
  std::vector<double> depth;
  double depth_units = 0, baseline = 0;
  int first = 0, frames = 0;
  bool sequential = false, no_calibration = false, no_dense_loops = false, no_bundle = false,
       no_map = false, quiet = false, view = false;
  SlamOptions slam;
};

gpureg::Context context_of(const Arguments& a) {
  if (a.backend == "cpu") return gpureg::Context::cpu();
  if (a.backend == "cuda") return gpureg::Context::cuda();
  return gpureg::Context::best();
}

Pinhole pinhole_of(const std::vector<double>& k) { return {k[0], k[1], k[2], k[3]}; }

Pinhole numbers_of(const std::vector<std::string>& words) {
  std::vector<double> k;
  for (const std::string& word : words) {
    double value = 0;
    if (!CLI::detail::lexical_cast(word, value))
      throw gpureg::InvalidArgument("--camera: '" + word + "' is no number");
    k.push_back(value);
  }
  if (k.size() != 4) throw gpureg::InvalidArgument("--camera needs a file, or fx fy cx cy");
  return pinhole_of(k);
}

void set_rig(const Arguments& a, Rig& rig) {
  if (a.colour.size() == 1) read_camera(a.colour[0], rig);
  if (a.colour.size() > 1) set_camera(numbers_of(a.colour), {}, {640, 480}, rig);
  if (!rig.known)
    throw gpureg::InvalidArgument(
        a.sequence +
        ": its cameras are unknown; put a camera.yaml there, or name one, or fx fy cx cy, by "
        "--camera");
  if (!a.depth.empty()) {
    rig.depth = pinhole_of(a.depth);
    rig.registered = false;
  }
  if (a.depth_units > 0) rig.depth_units = a.depth_units;
  if (a.baseline != 0) {
    rig.colour_from_depth.translation().x() = a.baseline;
    rig.registered = false;
  }
}

int run(const Arguments& a) {
  if (!a.rerun.empty() || a.view) require_rerun();  // not after an hour of frames
  Sequence sequence = open_sequence(a.sequence);
  set_rig(a, sequence.rig);
  RunResult result;
  result.sequence = a.sequence;
  result.rig = sequence.rig;
  result.truth = a.truth.empty() ? sequence.truth : gpureg::evaluation::read_trajectory(a.truth);
  result.out_of_order = sequence.out_of_order;
  SlamOptions options = a.slam;
  options.tracker.sequential = a.sequential;
  options.loops.parallel = !a.sequential;
  options.loops.dense = !a.no_dense_loops;
  options.loops.bundle = !a.no_bundle;
  options.loops.calibrate = !a.no_calibration;
  options.map = !a.no_map;
  if (!a.calibration.empty()) options.calibration = read_depth_calibration(a.calibration);
  // Without the file this run only tracks, and writes it; with it, this run closes the loops.
  const bool replays = !a.tracking.empty() && std::filesystem::exists(a.tracking),
             only_tracks = !a.tracking.empty() && !replays;
  if (replays && !a.calibration.empty())
    throw gpureg::InvalidArgument("a file of --tracking has its depth calibration already");
  if (only_tracks) {
    options.keep_fragments = true;
    options.loops.dense = options.loops.bundle = options.loops.images = options.loops.sessions =
        false;
  }
  Slam slam(context_of(a), sequence.rig, options);
  Progress progress(a.output, sequence.rig.colour);
  if (a.view) start_view(a.output);
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);

  const auto first = std::min(static_cast<std::size_t>(a.first), sequence.frames.size());
  const std::size_t last =
      a.frames > 0 ? std::min(sequence.frames.size(), first + static_cast<std::size_t>(a.frames))
                   : sequence.frames.size();
  result.frames = last - first;
  const auto note_progress = [&] {
    progress.update(static_cast<int>(first + result.frames_done) - 1, slam.map(),
                    slam.loops().records(), slam.loops().image_records());
  };
  double total = 0;
  {
    const Stopwatch watch(total);
    double since = 0;
    if (replays) {
      const Tracking tracking = read_tracking(a.tracking);
      result.frames_done = tracking.frames.size() + static_cast<std::size_t>(tracking.lost);
      slam.replay(tracking, [&] {
        note_progress();
        if (!a.quiet && slam.fragments() > 0)
          std::fprintf(stderr, "fragment %d of %zu, %zu loops\n", slam.fragments(),
                       tracking.fragments.size(), slam.loops().graph().loops().size());
        return interrupted.load();
      });
    }
    std::future<Images> ahead;  // the next frame is read while this one is tracked
    const auto read_ahead = [&](std::size_t k) {
      if (k < last)
        ahead = std::async(std::launch::async,
                           [&sequence, k] { return load(sequence.frames[k], sequence.rig); });
    };
    if (!replays) read_ahead(first);
    for (std::size_t k = first; k < last && !interrupted && !replays; ++k) {
      Images images;
      {
        const Stopwatch reading(result.load_milliseconds);
        images = ahead.get();
      }
      read_ahead(k + 1);
      if (!images.problem.empty()) {
        if (++result.problems <= 5) std::cerr << "slam_demo: " << images.problem << "\n";
      }
      Tracker::Outcome outcome;
      {
        const Stopwatch working(since);
        outcome = slam.frame(static_cast<int>(k), sequence.frames[k].time, images);
      }
      ++result.frames_done;
      note_progress();
      if (!a.quiet && result.frames_done % 25 == 0) {
        std::fprintf(stderr,
                     "frame %zu of %zu, %.1f frames/s, %d points, %zu keyframes, %zu loops\n",
                     result.frames_done, result.frames, 25e3 / since, outcome.inliers,
                     slam.map().keyframes.size(), slam.loops().graph().loops().size());
        since = 0;
      }
    }
    slam.finish();
    note_progress();
  }
  if (only_tracks && !interrupted) {
    Tracking tracking = slam.tracking();
    write_tracking(a.tracking, tracking);
  }
  result.seconds = total / 1000;
  std::string surface = a.surface;
  if (surface.empty() && std::filesystem::exists(a.sequence + "/surface.ply"))
    surface = a.sequence + "/surface.ply";
  evaluate(slam, surface, result);
  write_results(a.output, slam, result);
  progress.end(interrupted ? "interrupted" : "finished");
  if (!progress.complete())
    std::cerr << "slam_demo: " << a.output << "/progress.jsonl is incomplete: disk full?\n";
  if (!a.rerun.empty()) write_rerun(a.output, a.rerun);
  std::printf(
      "%zu frames, %d lost, %zu keyframes, %d fragments, %zu loops, %zu worlds, %.1f s, %.1f "
      "frames/s\n",
      result.frames_done, slam.lost(), slam.map().keyframes.size(), slam.fragments(),
      slam.loops().graph().loops().size(), slam.worlds(), result.seconds,
      static_cast<double>(result.frames_done) / std::max(1e-9, result.seconds));
  if (result.final.matched > 0)
    std::printf("ATE RMSE: tracking alone %.4f m, final %.4f m (%zu poses)\n",
                result.odometry.absolute_translation.rmse, result.final.absolute_translation.rmse,
                result.final.matched);
  if (result.surface.distance.count > 0)
    std::printf("surface error: mean %.4f m, median %.4f m (%zu surfels)\n",
                result.surface.distance.mean, result.surface.distance.median,
                result.surface.distance.count);
  std::printf("written to %s\n", a.output.c_str());
  return interrupted ? 130 : 0;
}

}  // namespace
}  // namespace slam_demo

int main(int count, char** values) {
  slam_demo::Arguments a;
  CLI::App app("RGB-D SLAM with dense loop closure by gpureg", "slam_demo");
  app.add_option("SEQUENCE", a.sequence,
                 "Folder in the layout of TUM, ICL-NUIM, Redwood or 7-Scenes")
      ->required();
  app.add_option("--output", a.output, "Folder to write")->capture_default_str();
  app.add_option("--groundtruth", a.truth,
                 "True trajectory in TUM's format; otherwise the sequence's");
  app.add_option("--surface", a.surface,
                 "True surface, a PLY with normals; otherwise the sequence's surface.ply");
  app.add_option("--backend", a.backend, "Where fragments are registered and surfels fused")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->capture_default_str();
  app.add_flag("--no-dense-loops", a.no_dense_loops, "Tracking alone; sessions are still merged");
  app.add_flag("--no-bundle", a.no_bundle, "Loops end with the pose graph");
  app.add_flag("--image-loops", a.slam.loops.images, "Also look for loops by images alone");
  app.add_flag("--loopsmart", a.slam.loops.loopsmart,
               "Register by quadruples and verify by the line process, as the paper does");
  app.add_option(
      "--tracking", a.tracking,
      "File with what tracking found. Where there is none the run only tracks, and writes "
      "it; runs with it close the loops only");
  app.add_flag("--view", a.view,
               "Show the run in the viewer of rerun.io (needs python3 with rerun-sdk)");
  app.add_option(
      "--rerun", a.rerun,
      "Also write a recording for the viewer of rerun.io (needs python3 with rerun-sdk)");
  app.add_option("--seed", a.slam.loops.seed, "Of the registration")->capture_default_str();
  app.add_flag("--no-map", a.no_map, "Do not fuse surfels");
  app.add_flag("--sequential", a.sequential,
               "No result depends on threads: the same bits every time");
  app.add_option("--first", a.first, "Frame to begin with")->check(CLI::NonNegativeNumber);
  app.add_option("--frames", a.frames, "Frames to process; 0: all")->check(CLI::NonNegativeNumber);
  app.add_option("--max-fragments", a.slam.loops.max_fragments,
                 "Fragments kept for loops, about 8 MB each")
      ->check(CLI::Range(2, 1000000))
      ->capture_default_str();
  app.add_option("--max-surfels", a.slam.max_surfels, "Of the map; beyond, it is thinned to half")
      ->check(CLI::Range(1000, 1000000000))
      ->capture_default_str();
  app.add_option("--features", a.slam.features, "ORB features of a frame")
      ->check(CLI::Range(100, 10000))
      ->capture_default_str();
  app.add_option("--voxel-size", a.slam.loops.voxel_size, "Of the registration, metres")
      ->check(CLI::Range(0.005, 1.0))
      ->capture_default_str();
  app.add_option("--camera", a.colour,
                 "A camera.yaml of OpenCV's format; or the colour camera, pixels: fx fy cx cy")
      ->expected(1, 4);
  app.add_option("--depth-camera", a.depth, "Depth camera, where depth is not registered")
      ->expected(4);
  app.add_option("--depth-baseline", a.baseline,
                 "x of the depth camera in the colour camera, metres");
  app.add_option("--depth-units", a.depth_units, "Values of a depth image per metre");
  app.add_option("--depth-calibration", a.calibration,
                 "Offsets of inverse depth to begin with: depth_calibration.json of another run");
  app.add_flag("--no-calibration", a.no_calibration, "Adjustments leave these offsets as they are");
  app.add_flag("--calibrate-lens", a.slam.loops.calibrate_lens,
               "Adjustments also estimate fx fy cx cy k1 k2 of the colour camera: where nobody has "
               "calibrated it");
  app.add_flag("--quiet", a.quiet, "No progress");
  CLI11_PARSE(app, count, values);
  try {
    return slam_demo::run(a);
  } catch (const std::exception& error) {
    std::cerr << "slam_demo: " << error.what() << std::endl;
    return 1;
  }
}
