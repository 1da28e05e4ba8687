// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/files.hpp"
#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "gpureg/overlay.hpp"
#include "gpureg/registration.hpp"
#include "gpureg/registration/scale.hpp"
#include "gpureg/time_budget.hpp"
#include "gpureg/voxel_size.hpp"
#include "inputs/cloud_file.hpp"
#include "inputs/initial_poses.hpp"
#include "json/fields_json.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"
#include "option_names.hpp"
#include "options/knowledge_options.hpp"
#include "options/method_options.hpp"
#include "options/output_path.hpp"
#include "options/scale_option.hpp"
#include "pictures/before_after.hpp"
#include "pictures/image.hpp"
#include "records/pose_text.hpp"
#include "records/result_json.hpp"
#include "run/sensor_fixed_note.hpp"
#include "run/spacing.hpp"
#include "run/viewpoint_note.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

struct RegisterOptions {
  std::string source, target;
  MethodOptions method;
  std::optional<double> time_budget;  // milliseconds
  std::string json, overlay, image;
  std::string initial;  // file of poses that are verified instead of a search
  bool refine_initial = false, ignore_alternatives = false;
  ViewpointChoice source_viewpoint, target_viewpoint;
  UpChoice up;
  ScaleChoice scale;
  std::optional<ScaledResult> scaled;  // where --scale was given
  // Of a pair that is not aligned: questions, and what is known to be wrong.
  std::string other_units, perhaps_other_units, inverted, not_finite;
};

std::string describe(const PrepareStatistics& s) {
  std::string text = grouped(s.input_points) + " points";
  if (s.invalid_points > 0) text += " (" + grouped(s.invalid_points) + " not finite, dropped)";
  if (s.stray_points > 0) text += " (" + grouped(s.stray_points) + " stray, dropped)";
  if (s.range_limit_points > 0)
    text += " (" + at_range_limits(s.range_limit_points, s.smallest_range, s.largest_range) +
            ", left out)";
  text += ", " + grouped(s.points) + " prepared";
  if (s.flat) text += " in layers (flat: a scan of a 2-D scanner)";
  if (s.points_without_feature > 0)
    text += " (" + grouped(s.points_without_feature) + " without a feature)";
  return text + "; viewpoint " + to_string(s.viewpoint) +
         (s.repaired_normals > 0 ? ", " + grouped(s.repaired_normals) +
                                       " normals contradicted their neighbours and were flipped"
                                 : "");
}

/// "20,000 of the 20,000 points of the source are not finite", of a pair that lacks points.
std::string not_finite(const RegistrationResult& r, const PrepareStatistics& source,
                       const PrepareStatistics& target) {
  if (r.reason != RegistrationReason::too_few_source_points &&
      r.reason != RegistrationReason::too_few_target_points &&
      r.reason != RegistrationReason::too_few_points &&
      r.reason != RegistrationReason::no_usable_features)
    return "";
  std::string text;
  for (const auto& [name, cloud] : {std::pair("source", &source), std::pair("target", &target)})
    if (2 * cloud->invalid_points > cloud->input_points)
      text += (text.empty() ? "" : ", ") + grouped(cloud->invalid_points) + " of the " +
              grouped(cloud->input_points) + " points of the " + name;
  return text.empty() ? "" : text + " are not finite";
}

std::string explained(const RegisterOptions& o, const RegistrationResult& r) {
  return (o.scaled ? explain(*o.scaled) : explain(r)) +
         (o.not_finite.empty() ? "" : ": " + o.not_finite);
}

/// A pose that was given, and brings next to nothing together, may be of another convention.
std::string next_step(const RegisterOptions& o, RegistrationReason reason) {
  if (!o.not_finite.empty())
    return "points with coordinates: NaN stands for no return, or comes of a division by 0";
  if (!o.inverted.empty()) return o.inverted;
  if (!o.initial.empty() && (reason == RegistrationReason::no_candidate ||
                             reason == RegistrationReason::too_little_overlap))
    return "is the pose target_from_source, not its inverse, and in the unit of the clouds?";
  // Whatever else is wrong follows from it.
  if (!o.other_units.empty())
    return o.other_units + "; bring both to one unit, or give --scale free";
  std::string next = in_option_names(advice(reason));
  if (!o.perhaps_other_units.empty()) next += "; " + o.perhaps_other_units;
  const bool nowhere = reason == RegistrationReason::too_little_overlap ||
                       reason == RegistrationReason::no_candidate ||
                       reason == RegistrationReason::contradicts_prior ||
                       reason == RegistrationReason::contradicts_free_space;
  if (!o.up.empty() && nowhere)
    next += "; is up the same direction in both clouds? Else --source-up and --target-up";
  return next;
}

/// After the status: the reason with its numbers, and what to try.
void print_reason(const RegisterOptions& o, const RegistrationResult& r) {
  if (r.aligned()) {
    std::cout << "\n";
    return;
  }
  std::cout << ": " << to_string(r.reason) << ", " << explained(o, r) << "\n";
  if (const std::string next = next_step(o, r.reason); !next.empty())
    std::cout << "try      " << next << "\n";
}

/// On stderr, what may be a mistake of the caller and is none of the clouds alone.
void note_pair(const RegisterOptions& o, const PointCloud& source, const PointCloud& target,
               bool aligned) {
  // Of a pair that is not aligned, it is what to try.
  const std::string units =
      aligned && !o.scaled ? question_units(source.view(), target.view()) : std::string();
  if (!units.empty()) std::cerr << "gpureg: note: " << units << std::endl;
  std::error_code ignored;
  if (std::filesystem::equivalent(o.source, o.target, ignored))
    std::cerr << "gpureg: note: SOURCE and TARGET are the same file" << std::endl;
  if (source.model && target.model)
    std::cerr << "gpureg: note: both clouds are models, seen from everywhere; the confidence was "
                 "fitted to a scan and its model"
              << std::endl;
}

/// Calls action(), and asks in its refusal whether the clouds have different units. stderr stays
/// one line.
template <typename Action>
auto asking(const PointCloud& source, const PointCloud& target, const Action& action) {
  try {
    return action();
  } catch (const InvalidArgument& error) {
    std::string message = error.what();
    const std::string units = question_units(source.view(), target.view(), kLeastUnitRatio);
    if (!units.empty()) message += (message.back() == '?' ? " " : "; ") + units;
    throw InvalidArgument(message);
  }
}

/// On stderr, where an aligned pair overlaps so little that the confidence has to be doubted.
void note_little_overlap(const RegistrationResult& r) {
  constexpr double kLittle = 0.05;
  if (!r.aligned() || r.modes.empty()) return;
  const PoseEvidence& e = r.modes.front().evidence;
  const double overlap = std::max(e.source_overlap, e.target_overlap);
  if (overlap < kLittle)
    std::cerr << "gpureg: note: the clouds overlap by " << percent(overlap)
              << " % only under this pose: look at it (--image) before you rely on it" << std::endl;
}

/// target_from_source as it is printed and written: with the scale in it.
Eigen::Matrix4d pose_matrix(const RegisterOptions& o, const RegistrationResult& r) {
  return o.scaled ? o.scaled->similarity() : Eigen::Matrix4d(r.target_from_source.matrix());
}

void print_scale(const ScaledResult& scaled) {
  std::cout << "scale    " << significant(scaled.scale, 6) << " ("
            << to_string(scaled.scale_status);
  if (scaled.scale_deviation > 0)
    std::cout << ", standard deviation " << significant(100 * scaled.scale_deviation, 2) << " %";
  std::cout << ")";
  for (std::size_t k = 1; k < scaled.candidates.size(); ++k)
    std::cout << (k == 1 ? "; also tried " : ", ") << significant(scaled.candidates[k].scale, 3)
              << " (confidence " << fixed(scaled.candidates[k].confidence, 3) << ")";
  std::cout << "\n";
}

void print_report(const RegisterOptions& o, const Context& context, const PreparedCloud& source,
                  const PreparedCloud& target, const RegistrationResult& r) {
  const RegistrationStatistics& s = r.statistics;
  const StageTimings& t = r.timings;
  const PrepareStatistics &a = source.statistics(), &b = target.statistics();
  std::cout << "source   " << o.source << ": " << describe(a) << "\n"
            << "target   " << o.target << ": " << describe(b) << "\n"
            << "voxels   " << o.method.voxel_size_text() << "\n"
            << "backend  " << context.description() << "\n"
            << "status   " << to_string(r.status);
  print_reason(o, r);
  if (o.scaled && o.scaled->scale_status != ScaleStatus::none) print_scale(*o.scaled);
  if (r.has_pose()) {
    std::cout << (r.aligned() ? "target_from_source\n" : "best candidate, target_from_source\n")
              << pose_text(pose_matrix(o, r)) << "confidence " << fixed(r.confidence, 3)
              << ", inliers " << grouped(s.inliers) << " of " << grouped(s.points_scored) << " ("
              << percent(r.inlier_ratio) << " %), rmse " << significant(r.inlier_rmse, 3) << "\n";
    if (r.equivalent_poses() > 1)
      std::cout << "symmetry " << r.equivalent_poses() << " equivalent poses, confidence "
                << fixed(r.symmetry_confidence(), 3) << " together\n";
  }
  std::cout << "counts   correspondences " << grouped(s.correspondences) << ", hypotheses "
            << grouped(s.hypotheses) << ", survivors " << grouped(s.survivors) << ", scored "
            << grouped(s.scored) << ", consensus " << grouped(s.consensus) << ", refine iterations "
            << s.refine_iterations << "\n"
            << "ms       prepare " << fixed(a.total() + b.total(), 1) << " (downsample "
            << fixed(a.downsample + b.downsample, 1) << ", normals "
            << fixed(a.normals + b.normals, 1) << ", features " << fixed(a.features + b.features, 1)
            << ", grid " << fixed(a.grid + b.grid, 1) << ", depth maps "
            << fixed(a.depth_maps + b.depth_maps, 1) << ", surface sides "
            << fixed(a.surface_sides + b.surface_sides, 1) << ")\n         align "
            << fixed(t.total(), 1) << " (match " << fixed(t.match, 1) << ", propose "
            << fixed(t.propose, 1) << ", rank " << fixed(t.rank, 1) << ", refine "
            << fixed(t.refine, 1) << ", verify " << fixed(t.verify, 1) << ")\n";
}

void print_verified(const RegisterOptions& o, const Context& context, const PreparedCloud& source,
                    const PreparedCloud& target, const RegistrationResult& r) {
  std::cout << "source   " << o.source << ": " << describe(source.statistics()) << "\n"
            << "target   " << o.target << ": " << describe(target.statistics()) << "\n"
            << "voxels   " << o.method.voxel_size_text() << "\n"
            << "backend  " << context.description() << "\n"
            << "status   " << to_string(r.status);
  print_reason(o, r);
  std::cout << "target_from_source" << (o.refine_initial ? ", refined" : "") << "\n"
            << pose_text(r.target_from_source.matrix()) << "confidence " << fixed(r.confidence, 3)
            << ", inliers " << grouped(r.statistics.inliers) << " of "
            << grouped(r.statistics.points_scored) << " (" << percent(r.inlier_ratio)
            << " %), rmse " << significant(r.inlier_rmse, 3) << "\n";
  for (const RegistrationMode& mode : r.modes)
    std::cout << "pose " << mode.rank_before_refinement + 1 << " of " << o.initial
              << ": confidence " << fixed(mode.confidence, 3) << ", overlap "
              << percent(mode.evidence.source_overlap) << " and "
              << percent(mode.evidence.target_overlap) << " %, free-space violation "
              << percent(std::max(mode.evidence.source_free_space_violation,
                                  mode.evidence.target_free_space_violation))
              << " %\n";
}

Json document(const RegisterOptions& o, const RegistrationOptions& options, const Context& context,
              const PreparedCloud& source, const PreparedCloud& target,
              const RegistrationResult& result) {
  Json json;
  json["gpureg"] = "register";
  json["environment"] = environment(context);
  json["options"] = to_json(options);
  json["source"] = {{"file", o.source}, {"prepare", to_json(source.statistics())}};
  json["target"] = {{"file", o.target}, {"prepare", to_json(target.statistics())}};
  json["result"] = to_json(result, "target_from_source");
  if (o.scaled) json["result"].update(scale_to_json(*o.scaled, "target_from_source"));
  json["result"]["explanation"] = explained(o, result);
  json["result"]["advice"] = next_step(o, result.reason);
  json["result"]["information_redwood"] = to_json(result.source_moments.information_redwood());
  json["result"]["information_open3d"] = to_json(result.target_moments.information_open3d());
  json["peak_memory_mib"] = peak_memory_mib();
  return json;
}

/// Verifies the poses of --initial.
RegistrationResult verify(const RegisterOptions& o, const Context& context,
                          const PreparedCloud& source, const PreparedCloud& target,
                          const std::vector<UnalignedIsometry3d>& poses,
                          const RegistrationOptions& options) {
  VerificationOptions verification;
  verification.refine = o.refine_initial;
  verification.search_alternatives = !o.ignore_alternatives;
  return result_of(verify_poses(context, source, target, poses, options, verification),
                   options.min_confidence, static_cast<std::uint32_t>(source.size()),
                   static_cast<std::uint32_t>(target.size()));
}

/// What to say of poses that fit the better inverted. It looks at the inverses alone: little work.
std::string inverted(RegisterOptions o, const Context& context, const PreparedCloud& source,
                     const PreparedCloud& target, std::vector<UnalignedIsometry3d> poses,
                     const RegistrationOptions& options, double confidence) {
  for (UnalignedIsometry3d& pose : poses) pose = pose.inverse();
  o.ignore_alternatives = true;
  const RegistrationResult inverse = verify(o, context, source, target, poses, options);
  if (!inverse.aligned() || inverse.confidence <= confidence) return "";
  return "the pose looks inverted: its inverse has a confidence of " +
         fixed(inverse.confidence, 3) + "; expected target_from_source, which moves points of " +
         o.source + " onto " + o.target;
}

/// Both clouds. A mesh is sampled at the spacing of the other cloud, if they have one unit.
std::pair<PointCloud, PointCloud> read_clouds(const RegisterOptions& o) {
  const bool source = io::is_mesh(o.source), target = io::is_mesh(o.target);
  std::pair<PointCloud, PointCloud> clouds;
  if (!source) clouds.first = read_cloud(o.source, 0, MeshNote::print);
  if (!target) clouds.second = read_cloud(o.target, 0, MeshNote::print);
  const bool one_unit = o.scale.range().is_known() && o.scale.range().least == 1;
  const auto spacing = [&](const PointCloud& other) {
    if (!one_unit) return 0.0;
    return median_spacing(finite_points(other.points), 1);
  };
  if (source)
    clouds.first = read_cloud(o.source, target ? 0 : spacing(clouds.second), MeshNote::print);
  if (target)
    clouds.second = read_cloud(o.target, source ? 0 : spacing(clouds.first), MeshNote::print);
  return clouds;
}

void check_initial(const RegisterOptions& o) {
  if (o.initial.empty()) {
    if (o.refine_initial || o.ignore_alternatives)
      throw InvalidArgument("--refine-initial and --ignore-alternatives need --initial");
    return;
  }
  if (o.ignore_alternatives)
    o.method.refuse({"--seed", "--quality"}, "with --ignore-alternatives: nothing is searched");
  if (!o.up.empty()) throw InvalidArgument("--initial verifies given poses, --up is for a search");
  if (o.time_budget)
    throw InvalidArgument("--initial verifies given poses, --time-budget is for a search");
  if (o.method.registration().method != RegistrationMethod::compatibility)
    throw InvalidArgument("--initial verifies poses by evidence, which preset " + o.method.preset +
                          " does not have");
}

/// What --scale does not go with.
void check_scale(const RegisterOptions& o) {
  if (!o.scale.given()) return;
  o.scale.range();
  for (const auto& [given, name] :
       {std::pair(!o.initial.empty(), "--initial"),
        std::pair(o.time_budget.has_value(), "--time-budget"), std::pair(!o.up.empty(), "--up")})
    if (given) throw InvalidArgument(std::string("--scale and ") + name + " do not go together");
}

int run(RegisterOptions o) {
  check_initial(o);
  check_scale(o);
  o.method.registration();  // what is wrong with it shall be said before clouds are read
  if (o.time_budget && !(*o.time_budget > 0 && std::isfinite(*o.time_budget)))
    throw InvalidArgument("--time-budget is " + significant(*o.time_budget, 6) +
                          ", expected milliseconds > 0");
  if (o.time_budget && o.method.given("--quality"))
    throw InvalidArgument("--time-budget chooses the quality, give it or --quality");
  o.source_viewpoint.check("--source-viewpoint");
  o.target_viewpoint.check("--target-viewpoint");
  RegistrationPrior prior;
  prior.gravity = o.up.prior();
  if (o.time_budget && !prior.empty())
    throw InvalidArgument("--up and --time-budget do not go together");
  check_outputs({{"--json", o.json}, {"--overlay", o.overlay}, {"--image", o.image}},
                {{"SOURCE", o.source},
                 {"TARGET", o.target},
                 {"--initial", o.initial},
                 {"--calibration", o.method.calibration}});
  std::vector<UnalignedIsometry3d> initial;
  if (!o.initial.empty()) initial = read_initial_poses(o.initial);
  const Context context = o.method.context();
  auto [source_cloud, target_cloud] = read_clouds(o);
  o.source_viewpoint.check_cloud("--source-viewpoint", source_cloud, o.source);
  o.target_viewpoint.check_cloud("--target-viewpoint", target_cloud, o.target);
  o.source_viewpoint.apply(source_cloud);
  o.target_viewpoint.apply(target_cloud);
  const ScaleRange scale = o.scale.range();
  PointCloud unscaled;
  if (o.scale.given() && !o.image.empty()) unscaled = source_cloud;
  if (scale.is_known()) {
    if (o.scale.given()) scale_cloud(source_cloud, scale.least);
    o.method.choose_voxel_size({source_cloud.view(), target_cloud.view()},
                               o.source + " and " + o.target);
  } else {
    o.method.choose_voxel_size({target_cloud.view()}, o.target);
  }
  RegistrationOptions options = o.method.registration();
  o.method.note_calibration();
  if (!scale.is_known()) {
    o.scaled = (o.method.automatic_voxel_size ? align_scaled_auto : align_scaled)(
        context, o.source_viewpoint.view(source_cloud), o.target_viewpoint.view(target_cloud),
        scale, options);
    if (o.method.automatic_voxel_size && o.scaled->result.voxel_size > 0) {
      o.method.voxel_size = o.scaled->result.voxel_size;
      options = o.method.registration();
    }
    // Without a scale, the report counts points at that of equal extents.
    const double none = extent_of(target_cloud.points) / extent_of(source_cloud.points);
    scale_cloud(source_cloud, o.scaled->scale_status != ScaleStatus::none ? o.scaled->scale
                              : none > 0 && std::isfinite(none)           ? none
                                                                          : 1.0);
  }
  const auto asking_pair = [&](const auto& action) {
    return asking(source_cloud, target_cloud, action);
  };
  asking_pair([&] {
    check_voxel_size(options.voxel_size, extent_of(source_cloud.points), o.source);
    check_voxel_size(options.voxel_size, extent_of(target_cloud.points), o.target);
  });
  ViewpointNote viewpoints;
  if (options.prepare.depth_maps > 0) {
    viewpoints.see(source_cloud, o.source);
    viewpoints.see(target_cloud, o.target);
  }
  const auto prepared = [&](const PointCloudView& cloud, const std::string& file) {
    return asking_pair([&] { return prepare_batch(context, {cloud}, options, {file}).front(); });
  };
  const PreparedCloud source = prepared(o.source_viewpoint.view(source_cloud), o.source);
  const PreparedCloud target = prepared(o.target_viewpoint.view(target_cloud), o.target);
  viewpoints.print();
  o.source_viewpoint.note_place("--source-viewpoint", source, o.source);
  o.target_viewpoint.note_place("--target-viewpoint", target, o.target);
  if (o.method.automatic_voxel_size)
    note_few_points({{o.source, source.size()}, {o.target, target.size()}});
  TimedResult timed;
  if (o.scaled)
    timed.result = o.scaled->result;
  else if (o.time_budget)
    timed = align_within(context, source, target, *o.time_budget, options);
  else
    timed.result = o.initial.empty() ? align(context, source, target, options, prior)
                                     : verify(o, context, source, target, initial, options);
  const RegistrationResult& result = timed.result;
  if (o.scale.given() && !o.scaled) {
    o.scaled.emplace();
    o.scaled->scale = scale.least;
    o.scaled->scale_status = ScaleStatus::known;
    o.scaled->result = result;
  }
  if (!result.aligned())
    o.not_finite = not_finite(result, source.statistics(), target.statistics());
  if (!result.aligned() && !o.scale.given()) {
    o.other_units = question_units(source_cloud.view(), target_cloud.view());
    // Parts of scenes differ by the ratios of feet, inches and centimetres, too.
    o.perhaps_other_units =
        question_units(source_cloud.view(), target_cloud.view(), kLeastUnitRatio);
    if (!o.initial.empty() && source.size() > 0 && target.size() > 0)
      o.inverted = inverted(o, context, source, target, initial, options, result.confidence);
  }
  if (o.initial.empty())
    print_report(o, context, source, target, result);
  else
    print_verified(o, context, source, target, result);
  note_little_overlap(result);
  note_pair(o, source_cloud, target_cloud, result.aligned());
  if (o.time_budget)
    std::cout << "budget   " << fixed(*o.time_budget, 1) << " ms, " << fixed(timed.milliseconds, 1)
              << " used; " << timed.levels << " levels of quality up to " << timed.highest_quality
              << ", the result is of " << timed.quality << "\n";

  if (!o.json.empty()) {
    RegistrationOptions used = options;
    if (o.time_budget) used.quality = timed.quality;
    Json json = document(o, used, context, source, target, result);
    if (o.time_budget)
      json["time_budget"] = {{"ms", *o.time_budget},
                             {"used_ms", timed.milliseconds},
                             {"quality", timed.quality},
                             {"highest_quality", timed.highest_quality},
                             {"levels", timed.levels}};
    write_document(o.json, json);
  }
  if (!o.overlay.empty()) {
    if (result.has_pose())
      io::write_overlay(o.overlay, source_cloud, target_cloud, result.target_from_source);
    else
      std::cerr << "gpureg: no overlay written, as there is no pose to show" << std::endl;
  }
  if (!o.image.empty()) {
    PosedTitle after = pose_of(result);
    if (o.scale.given()) {
      after.unscaled = &unscaled;
      after.title += ", scale " + significant(o.scaled->scale, 4);
    }
    const Image picture = before_after(source_cloud, target_cloud, after);
    files::write_atomically(o.image, encode_png(picture));
  }
  return result.aligned() ? kOk : kNoAlignment;
}

}  // namespace

void add_register(CommandLine& line) {
  const auto o = std::make_shared<RegisterOptions>();
  Verb verb = line.verb("register",
                        "Align two clouds (PLY, PCD, LAS, E57, PTX, text, KITTI .bin) or meshes "
                        "(STL, OBJ, OFF, PLY)");
  verb.option("SOURCE", o->source, "Cloud that is moved").required();
  verb.option("TARGET", o->target, "Cloud that stays").required();
  o->method.add_to(verb);
  o->method.add_calibration_to(verb);
  verb.option("--time-budget", o->time_budget,
              "Time budget of the alignment in milliseconds, instead of --quality; the quality "
              "then varies between runs");
  verb.option("--initial", o->initial,
              "Verify the poses of this file instead of a search: 4 x 4 matrices of "
              "target_from_source, row by row, or a Redwood log");
  verb.flag("--refine-initial", o->refine_initial, "Refine these poses by ICP first");
  verb.flag("--ignore-alternatives", o->ignore_alternatives,
            "Faster: do not search for other poses that compete with them");
  verb.option(
          "--source-viewpoint", o->source_viewpoint.text,
          "Where SOURCE was seen from: x,y,z in its frame; none: not known; model: from "
          "everywhere, "
          "its normals point outwards; auto: the file, or the origin if the surfaces agree with it")
      .show_default();
  verb.option("--target-viewpoint", o->target_viewpoint.text, "The same of TARGET").show_default();
  o->scale.add_to(verb);
  o->up.add_to(verb, "both clouds", "SOURCE", "TARGET");
  verb.option("--json", o->json, "Write options, result, counts and times");
  verb.option("--overlay", o->overlay, "Write both clouds in colour, aligned, as PLY");
  verb.option("--image", o->image, "Draw both clouds before and after, as PNG");
  verb.run([o] { return run(*o); });
}

}  // namespace gpureg::cli
