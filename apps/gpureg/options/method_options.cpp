// SPDX-License-Identifier: BSD-3-Clause
#include "options/method_options.hpp"

#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "gpureg/error.hpp"
#include "gpureg/voxel_size.hpp"
#include "inputs/calibration_file.hpp"
#include "inputs/cloud_file.hpp"
#include "option_names.hpp"
#include "options/set_option.hpp"
#include "run/spacing.hpp"
#include "text.hpp"

namespace gpureg::cli {

namespace {

/// "prepare" of "prepare.depth_maps=4", "min_confidence" of "min_confidence=0.5".
std::string group_of(const std::string& assignment) {
  return assignment.substr(0, assignment.find_first_of(".="));
}

/// Options of the other method would change nothing.
void refuse_idle(const RegistrationOptions& options, const std::string& assignment) {
  const bool quadruples = options.method == RegistrationMethod::quadruples;
  const std::vector<std::string> idle =
      quadruples ? std::vector<std::string>{"quality", "accept_symmetry", "calibration"}
                 : std::vector<std::string>{"quadruples"};
  if (std::find(idle.begin(), idle.end(), group_of(assignment)) != idle.end())
    throw InvalidArgument("--set " + assignment + " does nothing with the method " +
                          to_string(options.method));
}

}  // namespace

void MethodOptions::add_to(Verb verb) {
  verb_ = verb;
  verb.text(
          "--voxel-size",
          [this](const std::string& text) {
            automatic_voxel_size = text == "auto";
            if (text.empty()) voxel_size = 0;  // refused by name, later
            return text.empty() || automatic_voxel_size || read_number(text, voxel_size);
          },
          "Edge of the downsampling voxel in the unit of the clouds, 0.05 for rooms in metres; "
          "every other length follows from it. auto: suggested by the clouds")
      .show_default("auto")
      .type_name("FLOAT or auto");
  verb.option("--preset", preset,
              "default: poses from compatible matches, verified by evidence; loopsmart: the "
              "paper's method")
      .one_of({"default", "loopsmart"})
      .show_default();
  verb.option("--backend", backend, "auto: CUDA where there is a device, else the CPU")
      .one_of({"auto", "cpu", "cuda"})
      .show_default();
  verb.option("--threads", threads, "Threads of the CPU backend; 0: all")
      .natural("all")
      .show_default();
  verb.option("--quality", quality,
              "From 0, the fastest, to 10, the highest recall; of the preset default")
      .between(0u, kHighestQuality)
      .show_default();
  verb.option("--seed", seed, "Same seed, same result, on any machine").natural().show_default();
  verb.option(
      "--min-confidence", min_confidence,
      "Report a pair from this confidence on (without: 0.5), a place in a map (without: 0.75); "
      "with --preset loopsmart, "
      "from this inlier ratio on (0.3). 0: every best candidate");
  verb.option("--set", set,
              "Any other option under its name in the JSON, for experts: prepare.depth_maps=4, "
              "accept_symmetry=true; may be repeated")
      .type_name("NAME=VALUE")
      .one_at_a_time();
}

void MethodOptions::add_calibration_to(Verb verb) {
  verb.option(
      "--calibration", calibration,
      "File of `gpureg calibrate`: scales the confidence to a sensor, and sets --min-confidence "
      "where it promises a risk");
}

void MethodOptions::refuse(const std::vector<std::string>& options, const std::string& why) const {
  for (const std::string& option : options)
    if (given(option)) throw InvalidArgument(option + " does nothing " + why);
}

void MethodOptions::refuse_set_outside(const std::vector<std::string>& groups,
                                       const std::string& why) const {
  for (const std::string& assignment : set)
    if (std::find(groups.begin(), groups.end(), group_of(assignment)) == groups.end())
      throw InvalidArgument("--set " + assignment + " does nothing " + why);
}

void MethodOptions::note_calibration() const {
  if (calibration.empty()) return;
  const CalibrationFile file = read_calibration(calibration);
  const double of_file = file.voxel_size;
  const double of_run = static_cast<double>(voxel_size);
  constexpr double kSimilar = 1.5;
  if (of_run <= kSimilar * of_file && of_file <= kSimilar * of_run) return;
  std::cerr << "gpureg: note: " << calibration << " was made with a voxel size of "
            << significant(of_file, 3) << ", this run has " << significant(of_run, 3)
            << "; the confidence may be off"
            << (file.min_confidence ? ", and the promised risk does not hold" : "") << std::endl;
}

bool MethodOptions::sets_confidence() const {
  return min_confidence.has_value() ||
         std::any_of(set.begin(), set.end(),
                     [](const std::string& text) { return group_of(text) == "min_confidence"; });
}

RegistrationOptions MethodOptions::registration() const {
  if (preset == "loopsmart" && given("--quality"))
    throw InvalidArgument("--quality does nothing with --preset loopsmart");
  set_voxel_size_origin(automatic_voxel_size ? VoxelSizeOrigin::automatic : VoxelSizeOrigin::given);
  RegistrationOptions options = preset == "loopsmart" ? RegistrationOptions::loopsmart(voxel_size)
                                                      : RegistrationOptions{voxel_size, quality};
  options.seed = seed;
  if (!calibration.empty()) {
    if (options.method == RegistrationMethod::quadruples)
      throw InvalidArgument(
          "--calibration scales the confidence, which preset loopsmart does not have");
    const CalibrationFile file = read_calibration(calibration);
    options.calibration = file.calibration;
    if (file.min_confidence) options.min_confidence = *file.min_confidence;
  }
  if (min_confidence && !(*min_confidence >= 0 && *min_confidence <= 1))
    throw InvalidArgument("--min-confidence is " + significant(*min_confidence, 6) +
                          ", expected a number from 0 to 1");
  if (min_confidence) options.min_confidence = *min_confidence;
  for (const std::string& assignment : set) set_option(options, assignment);
  for (const std::string& assignment : set) refuse_idle(options, assignment);
  options.validate();
  return options;
}

void MethodOptions::choose_voxel_size(const std::vector<PointCloudView>& clouds,
                                      const std::string& what) {
  if (!automatic_voxel_size) return;
  const VoxelSizeSuggestion suggestion = suggest_voxel_size(clouds);
  if (suggestion.valid())
    voxel_size = suggestion.voxel_size;
  else if (given("--voxel-size"))
    throw InvalidArgument("--voxel-size auto: " + what + ": " + explain(suggestion.reason));
}

void MethodOptions::choose_voxel_size(const ScanInput& input, const std::string& journal) {
  if (!automatic_voxel_size) return;
  const std::string of_run = PairJournal::setting(journal, "options.voxel_size");
  if (!of_run.empty()) return take_voxel_size(std::strtof(of_run.c_str(), nullptr));
  const std::vector<io::ScanFile> scans = input.list(true);
  choose_voxel_size(
      scans.size(),
      [&](std::size_t k) { return LoadedCloud(read_cloud(scans[k].path, 0, MeshNote::none)); },
      input.path);
}

void MethodOptions::choose_voxel_size(std::size_t scans,
                                      const std::function<LoadedCloud(std::size_t)>& read,
                                      const std::string& what) {
  if (!automatic_voxel_size) return;
  constexpr std::size_t kMost = 8;
  const std::size_t count = std::min(scans, kMost);
  std::vector<LoadedCloud> clouds;
  std::vector<PointCloudView> views;
  for (std::size_t k = 0; k < count; ++k) try {
      clouds.push_back(read(k * scans / count));
      views.push_back(clouds.back().view);
    } catch (const IoError&) {
      // One that cannot be read is left out of the run, and named there.
      if (k + 1 == count && clouds.empty()) throw;
    }
  choose_voxel_size(views, what);
}

void MethodOptions::check_sizes(float used, const PreparedSizes& sizes, bool quiet) const {
  check_voxel_size(used, sizes.extent, "the largest fragment");
  if (automatic_voxel_size && !quiet) note_few_points(sizes.points);
}

std::string MethodOptions::voxel_size_text() const {
  return significant(static_cast<double>(voxel_size), 3) +
         (automatic_voxel_size ? ", chosen from the clouds" : "");
}

Context MethodOptions::context() const {
  if (backend == "cpu") return Context::cpu(threads);
  if (backend == "cuda") return Context::cuda();
  const Context best = Context::best();
  return best.backend() == Backend::cpu && threads > 0 ? Context::cpu(threads) : best;
}

}  // namespace gpureg::cli
