// SPDX-License-Identifier: BSD-3-Clause
#include "generate/generate.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "data/generate.hpp"
#include "exit_status.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "run/interrupt.hpp"
#include "run/progress.hpp"

namespace gpureg::cli {
namespace {

struct GenerateOptions {
  std::string folder;
  synthetic::GenerateOptions scene;
  double depth_noise = 1;
  bool quiet = false;
};

constexpr const char* kMark = "generated.txt";  // in every folder that is ours to write

std::string mark_of(const std::string& folder) {
  return (std::filesystem::path(folder) / kMark).string();
}

// The files of the scene may have the name of the mesh.
void check_building(const GenerateOptions& o) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path building = fs::weakly_canonical(o.scene.building, error),
                 folder = fs::weakly_canonical(o.folder, error);
  if (!fs::is_regular_file(building, error)) return;
  const auto [in_folder, in_building] =
      std::mismatch(folder.begin(), folder.end(), building.begin(), building.end());
  if (in_folder == folder.end())
    throw InvalidArgument("--building and OUT must be different places, but " + o.scene.building +
                          " is in " + o.folder);
}

// Scans of another origin may have the same names.
void check_folder(const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code error;  // other errors of the folder appear when it is written
  if (!fs::is_directory(folder, error) || fs::exists(mark_of(folder), error)) return;
  if (!fs::is_empty(folder, error) && !error)
    throw IoError(folder + " is not empty and, without a " + kMark +
                  ", no scene of `gpureg generate`; choose another folder");
}

int run(const GenerateOptions& o) {
  check_building(o);
  check_folder(o.folder);
  const InterruptGuard guard;
  std::string stage;
  std::optional<Progress> progress;
  synthetic::Progress hooks;
  hooks.report = [&](int done, int total, const char* name) {
    // The folder is there by now, and no cloud in it yet.
    if (stage.empty())
      files::write_atomically(mark_of(o.folder),
                              "Made by gpureg generate, which may replace files of this folder.\n");
    if (stage != name) {
      progress.emplace(name, name == std::string("fragments") ? "scanned" : "done",
                       static_cast<std::size_t>(total), o.quiet);
      stage = name;
    }
    progress->update(static_cast<std::size_t>(done));
  };
  hooks.should_stop = [] { return InterruptGuard::requested(); };
  synthetic::GenerateOptions scene = o.scene;
  for (double* error :
       {&scene.sensor.pixel_shift, &scene.sensor.disparity_noise, &scene.sensor.distortion})
    *error *= o.depth_noise;
  synthetic::generate(o.folder, scene, hooks);
  progress.reset();
  if (InterruptGuard::requested()) {
    std::cerr << "gpureg: interrupted, " << o.folder << " holds an unfinished scene" << std::endl;
    return kInterrupted;
  }
  if (!o.quiet)
    std::cout << o.scene.fragments << " fragments of " << o.scene.frames_per_fragment
              << " frames written to " << o.folder << "\n";
  return kOk;
}

}  // namespace

void add_generate(CommandLine& line) {
  const auto o = std::make_shared<GenerateOptions>();
  Verb verb = line.verb("generate", "Make a synthetic scene in Redwood's layout, with its truth");
  verb.option("OUT", o->folder,
              "Folder to write: new, empty, or of an earlier run, whose files are replaced")
      .required();
  verb.option("--fragments", o->scene.fragments, "Number of fragments").show_default();
  verb.option("--frames-per-fragment", o->scene.frames_per_fragment, "Depth frames fused into each")
      .show_default();
  verb.option("--seed", o->scene.seed, "Building, furniture, path and noise follow from it")
      .natural()
      .show_default();
  verb.option("--threads", o->scene.threads, "0: all").show_default();
  verb.option("--building", o->scene.building,
              "Instead of a house: office or warehouse, whose furniture repeats, or a mesh to "
              "scan: metres, "
              "z up, floor at z = 0. Its parts get textures, in the colours of the file");
  verb.option("--clutter", o->scene.clutter,
              "Pieces of furniture per square metre to put into the mesh; copied rooms then differ")
      .show_default();
  verb.option(
          "--rearrange", o->scene.rearrangement,
          "Another number than 0: the house at another time, with furniture moved, taken away and "
          "added, another path and noise")
      .natural()
      .show_default();
  verb.option("--no-return", o->scene.no_return,
              "Metres that the path goes before it comes back to a place")
      .show_default();
  verb.option("--depth-noise", o->depth_noise,
              "Factor of all errors of the depth camera: shift, noise of disparities, distortion")
      .between(0.0, 10.0)
      .show_default();
  verb.option("--scan-step", o->scene.scanner.step,
              "Instead of the depth camera a 2-D scanner, with a reading every so many degrees: "
              "each fragment is one scan");
  verb.option("--scan-field", o->scene.scanner.field, "Field of view of the 2-D scanner, degrees")
      .show_default();
  verb.option("--scan-range", o->scene.scanner.range, "Range of the 2-D scanner, metres")
      .show_default();
  verb.option("--scan-noise", o->scene.scanner.noise, "Sigma of its ranges, metres").show_default();
  verb.flag("--rgbd", o->scene.rgbd,
            "Also write the frames as a sequence in TUM's layout, and the true surfaces");
  verb.flag("--quiet", o->quiet, "No progress, no summary");
  verb.run([o] { return run(*o); });
}

}  // namespace gpureg::cli
