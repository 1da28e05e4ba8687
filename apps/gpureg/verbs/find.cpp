// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/localization/find.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <iostream>
#include <memory>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "inputs/cloud_file.hpp"
#include "json/fields_json.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"
#include "option_names.hpp"
#include "options/knowledge_options.hpp"
#include "options/method_options.hpp"
#include "options/output_path.hpp"
#include "pictures/render.hpp"
#include "pictures/view.hpp"
#include "records/pose_text.hpp"
#include "records/result_json.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

using localization::FindOptions;
using localization::FindResult;
using localization::FindStatus;
using localization::FoundPart;

struct FindRun {
  std::string part, scene, json, image;
  MethodOptions machine;  // backend and threads
  FindOptions options;
  ViewpointChoice viewpoint;
};

Json poses_of(const std::vector<FoundPart>& parts) {
  Json json = Json::array();
  for (const FoundPart& part : parts)
    json.push_back({{"scene_from_part", to_json(part.scene_from_part.matrix())},
                    {"confidence", part.confidence},
                    {"equivalent_poses", part.equivalent_poses},
                    {"evidence", to_json(part.evidence)}});
  return json;
}

Json document(const FindRun& o, const Context& context, const FindResult& result, double seconds) {
  return {{"gpureg", "find"},
          {"environment", environment(context)},
          {"part", o.part},
          {"scene", o.scene},
          {"seed", o.options.seed},
          {"quality", o.options.quality},
          {"min_confidence", o.options.min_confidence},
          {"status", localization::to_string(result.status)},
          {"explanation", explain(result)},
          {"voxel_size", result.voxel_size},
          {"evidence_voxel_size", result.evidence_voxel_size},
          {"diameter", result.diameter},
          {"scene_extent", result.scene_extent},
          {"points", {{"part", result.part_points}, {"scene", result.scene_points}}},
          {"neighborhoods", result.neighborhoods},
          {"instances", poses_of(result.instances)},
          {"doubtful", poses_of(result.doubtful)},
          {"seconds", seconds}};
}

/// The scene, and each instance in a colour of its own.
Image picture(const PointCloud& part, const PointCloud& scene, const FindResult& result) {
  constexpr std::array<Color, 6> kColors{{{255, 178, 26},
                                          {214, 69, 65},
                                          {46, 160, 67},
                                          {142, 68, 173},
                                          {22, 160, 150},
                                          {233, 97, 168}}};
  constexpr Color kScene{150, 168, 186}, kInk{60, 60, 60}, kPaper{250, 250, 248};
  constexpr int kWidth = 960, kHeight = 720, kBar = 30, kTextScale = 2;
  std::vector<Layer> layers{{&scene, Eigen::Isometry3d::Identity(), kScene}};
  for (std::size_t k = 0; k < result.instances.size(); ++k)
    layers.push_back({&part, result.instances[k].scene_from_part, kColors[k % kColors.size()]});
  Image image(kWidth, kHeight + kBar, kPaper);
  paste(image, render(layers, choose_view(scene), kWidth, kHeight), 0, kBar);
  draw_text(image, 10, 8, kTextScale, kInk, explain(result));
  return image;
}

void print(const FindRun& o, const Context& context, const FindResult& result) {
  std::cout << "part     " << o.part << ": " << grouped(result.part_points) << " points, diameter "
            << significant(result.diameter, 3) << "\n"
            << "scene    " << o.scene << ": " << grouped(result.scene_points) << " points";
  if (result.neighborhoods > 0)
    std::cout << ", voxels of " << significant(static_cast<double>(result.voxel_size), 3) << ", "
              << grouped(result.neighborhoods) << " neighbourhoods";
  std::cout << "\nbackend  " << context.description() << "\n"
            << "status   " << localization::to_string(result.status) << ": " << explain(result)
            << "\n";
  const auto print_pose = [](const char* what, std::size_t number, const FoundPart& part) {
    std::cout << what << " " << number << "   confidence " << fixed(part.confidence, 3)
              << ", supported " << percent(part.evidence.supported) << " % of the surface in view";
    if (part.evidence.viewpoint_known)
      std::cout << ", occluded " << percent(part.evidence.occluded) << " %";
    if (part.equivalent_poses > 0) std::cout << ", equal by symmetry to other poses";
    std::cout << ", scene_from_part\n" << pose_text(part.scene_from_part.matrix());
  };
  for (std::size_t k = 0; k < result.instances.size(); ++k)
    print_pose("instance", k + 1, result.instances[k]);
  if (result.doubtful.empty()) return;
  if (result.instances.empty())
    print_pose("doubtful", 1, result.doubtful.front());
  else
    std::cout << "doubtful " << result.doubtful.size()
              << (result.doubtful.size() == 1 ? " pose" : " poses") << " more, up to "
              << fixed(result.doubtful.front().confidence, 3) << ": --json has them\n";
}

int run(const FindRun& o) {
  set_voxel_size_origin(o.options.voxel_size > 0 ? VoxelSizeOrigin::given
                                                 : VoxelSizeOrigin::automatic);
  o.options.validate();
  o.viewpoint.check("--viewpoint");
  check_outputs({{"--json", o.json}, {"--image", o.image}}, {{"PART", o.part}, {"SCENE", o.scene}});
  const Context context = o.machine.context();
  const PointCloud part = read_cloud(o.part, 0, MeshNote::print);
  PointCloud scene = read_cloud(o.scene, 0, MeshNote::print);
  o.viewpoint.check_cloud("--viewpoint", scene, o.scene);
  o.viewpoint.apply(scene);
  const auto begin = std::chrono::steady_clock::now();
  const FindResult result =
      localization::find(context, part.view(), o.viewpoint.view(scene), o.options);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  print(o, context, result);
  constexpr double kFineOfPart = 0.04;
  if (result.evidence_voxel_size > kFineOfPart * result.diameter)
    std::cerr << "gpureg: note: poses are judged in voxels of "
              << significant(static_cast<double>(result.evidence_voxel_size), 2)
              << ", which is coarse for this part: a mesh or denser clouds give surer confidences"
              << std::endl;
  const auto unseen = [](const std::vector<FoundPart>& parts) {
    return !parts.empty() && !parts.front().evidence.viewpoint_known;
  };
  if (unseen(result.instances) || unseen(result.doubtful))
    std::cerr << "gpureg: note: " << o.scene
              << ": it is not known from where it was seen, so confidences are low: --viewpoint "
                 "x,y,z, as 0,0,0 where the sensor is at the origin"
              << std::endl;
  if (result.status == FindStatus::not_found)
    std::cout << "try      --quality 10; is the scene in the unit of the part, and its sensor at "
                 "the origin of its frame (else --viewpoint)?\n";
  std::cout << "seconds  " << fixed(seconds, 2) << "\n";
  if (!o.json.empty()) write_document(o.json, document(o, context, result, seconds));
  if (!o.image.empty()) files::write_atomically(o.image, encode_png(picture(part, scene, result)));
  return result.instances.empty() ? kNoAlignment : kOk;
}

}  // namespace

void add_find(CommandLine& line) {
  const auto o = std::make_shared<FindRun>();
  Verb verb =
      line.verb("find", "Find the instances of a part in a scene, or say that there is none");
  verb.option("PART", o->part, "Mesh of the part, or a cloud of its surface").required();
  verb.option("SCENE", o->scene, "Cloud of the scene, in the unit of the part").required();
  verb.text(
          "--voxel-size",
          [o](const std::string& text) {
            return text == "auto" || read_number(text, o->options.voxel_size);
          },
          "Edge of the voxels of the search in the unit of the clouds; auto: a twentieth of the "
          "part, and not below the spacing of the scene")
      .show_default("auto")
      .type_name("FLOAT or auto");
  verb.option("--quality", o->options.quality, "From 0, the fastest, to 10, the highest recall")
      .between(0u, kHighestQuality)
      .show_default();
  verb.option("--seed", o->options.seed, "Same seed, same result, on any machine")
      .natural()
      .show_default();
  verb.option("--min-confidence", o->options.min_confidence,
              "Confidence from which a pose is an instance")
      .show_default();
  verb.option("--viewpoint", o->viewpoint.text,
              "Where SCENE was seen from: x,y,z in its frame; none: not known; auto: the file, or "
              "the origin if the surfaces agree with it")
      .show_default();
  verb.option("--backend", o->machine.backend, "auto: CUDA where there is a device, else the CPU")
      .one_of({"auto", "cpu", "cuda"})
      .show_default();
  verb.option("--threads", o->machine.threads, "Threads of the CPU backend; 0: all")
      .natural("all")
      .show_default();
  verb.option("--json", o->json, "Write poses, evidence and times");
  verb.option("--image", o->image, "Draw the scene and the instances in it, as PNG");
  verb.notes("Exit status 0: an instance was found, 1: none was. ");
  verb.run([o] { return run(*o); });
}

}  // namespace gpureg::cli
