// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/localization/find.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "algorithm/cell.hpp"
#include "common/for_each_on.hpp"
#include "common/shown.hpp"
#include "common/without_features.hpp"
#include "fields/find.hpp"
#include "fields/validate.hpp"
#include "gpureg/voxel_size.hpp"
#include "localization/find/instances.hpp"
#include "localization/find/part_confidence.hpp"
#include "localization/find/search_part.hpp"
#include "localization/map_state.hpp"

namespace gpureg::localization {
namespace {

/// Voxels of the search along the diameter of a part.
constexpr double kVoxels = 20;
/// Voxels of the evidence along one of the search. A surface that resembles the part's differs from
/// it by less than those: halves lose a twentieth of the recall (bench/find).
constexpr double kFineVoxels = 4;
/// Voxels are not narrower than so many spacings of the scene, those of the evidence than ...
constexpr double kSpacings = 1.5, kFineSpacings = 1.2;
/// ... and so many of a part: its surface must have no holes, and points at random are twice as far
/// apart on average as nearest neighbours are.
constexpr double kPartSpacings = 2.9;
/// Evidence in less than half a voxel of the search needs denser points of the part: holes of its
/// depth image count as outline. Of points at random, as many spacings leave 5 % of the pixels
/// empty, those above 16 %.
constexpr double kFinePartSpacings = 3.7;
/// Radius of the pieces of a scene and the distance of their middles, in diameters of the part.
constexpr double kPieceRadius = 0.6, kPieceDistance = 0.3;
/// A scene of more pieces than this is in another unit, or no scene.
constexpr double kMostPieces = 2e7;
/// Poses whose parts are so close, RMS over the diameter, are one.
constexpr double kSamePose = 0.03, kSameAfterRefinement = 0.02;
/// Poses whose log odds are this far below even odds are neither refined nor rivals.
constexpr double kHopelessPose = -5;
constexpr std::size_t kMostRefined = 400;
/// Searches of what the likely instances leave, and their log odds.
constexpr int kRepetitions = 1;
constexpr double kLikely = 0;
/// Evidence is not coarser than this share of the diameter because of the part: the confidence was
/// fitted to pixels of up to 0.106 of it.
constexpr double kCoarsestOfPart = 0.12;
/// Log odds from which a pose is worth a look.
constexpr double kDoubtful = -3;
/// Fewest prepared points of a part and of a scene.
constexpr std::size_t kFewestPoints = 20;
/// A scene whose box is smaller than this share of the part's has no room for it.
constexpr double kRoom = 0.5;

struct Box {
  Eigen::AlignedBox3f box;
  std::size_t points = 0;
  double diagonal() const {
    return points == 0 ? 0 : static_cast<double>(box.sizes().cast<double>().norm());
  }
};

Box box_of(const PointCloudView& cloud) {
  Box out;
  for (std::size_t k = 0; k < cloud.size; ++k) {
    const Eigen::Map<const Eigen::Vector3f> p(cloud.points + k * cloud.point_stride);
    if (!p.allFinite()) continue;
    out.box.extend(Eigen::Vector3f(p));
    ++out.points;
  }
  return out;
}

/// Normals without features, as evidence needs them.
PreparedCloud prepared_surface(const Context& context, const PointCloudView& cloud, float voxel,
                               bool keep_viewpoints) {
  PrepareSettings options = resolve(PrepareOptions{}, voxel);
  options.surface_side_distance = 0;
  options.wide_feature_radius = 0;
  options.depth_maps = keep_viewpoints ? 1 : 0;
  const WithoutFeatures without(cloud.size);
  return prepare(context, without.of(cloud), options);
}

PartSurface surface_of(const Context& context, const PointCloud& outer, float spacing,
                       unsigned threads) {
  PartSurface out;
  const PreparedCloud prepared = prepared_surface(context, outer.view(), spacing, true);
  out.points = prepared.points();
  out.normals = prepared.normals();
  out.oriented = prepared.statistics().viewpoint != ViewpointSource::none;
  out.spacing = spacing;
  Eigen::AlignedBox3f box;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < out.points.size(); ++k) {
    if (out.normals[k].squaredNorm() == 0) continue;
    out.points[kept] = out.points[k];
    out.normals[kept++] = out.normals[k];
    box.extend(out.points[k]);
  }
  out.points.resize(kept);
  out.normals.resize(kept);
  if (kept == 0) return out;
  out.middle = box.center().cast<double>();
  for (const Eigen::Vector3f& p : out.points)
    out.radius = std::max(out.radius, (p.cast<double>() - out.middle).cast<float>().norm());
  out.diameter = box.sizes().norm();
  out.seen_from = directions_that_see(
      out.points, out.oriented ? out.normals : std::vector<Eigen::Vector3f>{}, spacing, threads);
  return out;
}

/// The first point of each voxel: what a sensor saw, not means, which hang between surfaces.
std::vector<Eigen::Vector3f> thinned(const PointCloudView& scene, float voxel) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  const auto row = [&](std::size_t k) {
    return Eigen::Vector3f(
        Eigen::Map<const Eigen::Vector3f>(scene.points + k * scene.point_stride));
  };
  for (std::uint32_t k = 0; k < scene.size; ++k) {
    const Eigen::Vector3f p = row(k);
    if (p.allFinite())
      order.emplace_back(cell_key(cell_of(Vec3{p.x(), p.y(), p.z()}, 1 / voxel)), k);
  }
  std::sort(order.begin(), order.end());
  std::vector<Eigen::Vector3f> out;
  for (std::size_t k = 0; k < order.size(); ++k)
    if (k == 0 || order[k].first != order[k - 1].first) out.push_back(row(order[k].second));
  return out;
}

/// What belongs to one part and one scene.
struct PartSearch {
  const Context& context;
  const PreparedCloud& part;
  const RegistrationSettings& registration;
  const PartVerifier& verifier;
  const SceneSurface& surface;
  double diameter;
  Eigen::Vector3d part_origin, scene_origin;
  unsigned threads;
};

/// Poses that alignments with the pieces of a scene end in, refined and judged.
std::vector<Hypothesis> hypotheses_in(const PartSearch& s, const SearchedScene& scene,
                                      std::size_t& pieces) {
  std::vector<PartCandidate> found = search_pieces(
      s.context, s.part, scene, {kPieceRadius * s.diameter, kPieceDistance * s.diameter},
      s.registration, pieces);
  std::stable_sort(found.begin(), found.end(), [](const PartCandidate& a, const PartCandidate& b) {
    return a.confidence > b.confidence;
  });
  std::vector<Hypothesis> all;
  for (const PartCandidate& c : found) {
    all.emplace_back();
    all.back().pose = Eigen::Translation3d(-s.scene_origin) * Eigen::Isometry3d(c.scene_from_part) *
                      Eigen::Translation3d(s.part_origin);
  }
  all = distinct(s.verifier, std::move(all), kSamePose * s.diameter);
  judge(s.verifier, s.threads, all);
  while (!all.empty() && (all.size() > kMostRefined || all.back().log_odds < kHopelessPose))
    all.pop_back();
  for_each_on(s.threads, all.size(),
              [&](std::size_t k) { all[k].pose = s.verifier.refined(all[k].pose); });
  all = distinct(s.verifier, std::move(all), kSameAfterRefinement * s.diameter);
  judge(s.verifier, s.threads, all);
  return all;
}

/// The scene without the surfaces of likely instances.
SearchedScene rest_of(const SearchedScene& scene, const SceneSurface& surface,
                      const std::vector<Hypothesis>& instances) {
  std::vector<char> taken(surface.blocks(), 0);
  for (const Hypothesis& h : instances)
    if (h.log_odds >= kLikely)
      for (const std::uint32_t k : h.verdict.claimed) taken[k] = 1;
  SearchedScene out = scene;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < scene.points.size(); ++k) {
    const SceneSurface::Nearest nearest = surface.nearest(scene.points[k], scene.normals[k], -1);
    if (nearest.index != SceneSurface::kNone && taken[surface.block(nearest.index)] != 0) continue;
    out.points[kept] = scene.points[k];
    out.normals[kept++] = scene.normals[k];
  }
  out.points.resize(kept);
  out.normals.resize(kept);
  return out;
}

/// @param voxel 0: none was chosen.
std::string too_few(std::size_t points, float voxel) {
  return std::to_string(points) + " points" +
         (voxel > 0 ? " in voxels of " + shown(voxel, 3) : std::string()) + ", at least " +
         std::to_string(kFewestPoints) + " are needed";
}

}  // namespace

void FindOptions::validate() const { fields::validate(*this); }

const char* to_string(FindStatus status) {
  switch (status) {
    case FindStatus::found:
      return "found";
    case FindStatus::not_found:
      return "not_found";
    case FindStatus::too_few_part_points:
      return "too_few_part_points";
    case FindStatus::too_few_scene_points:
      return "too_few_scene_points";
    case FindStatus::scene_smaller_than_part:
      return "scene_smaller_than_part";
  }
  return "unknown";
}

std::string explain(const FindResult& r) {
  switch (r.status) {
    case FindStatus::found:
      return std::to_string(r.instances.size()) + (r.instances.size() == 1
                                                       ? " instance of the part was found"
                                                       : " instances of the part were found");
    case FindStatus::not_found:
      if (r.doubtful.empty()) return "no pose of the part suits the scene";
      return "no pose of the part is confident; the best one has " +
             shown(r.doubtful.front().confidence, 2);
    case FindStatus::too_few_part_points:
      return "the part has " + too_few(r.part_points, r.voxel_size);
    case FindStatus::too_few_scene_points:
      return "the scene has " + too_few(r.scene_points, r.voxel_size);
    case FindStatus::scene_smaller_than_part:
      return "the scene extends over " + shown(r.scene_extent, 3) + ", the part over " +
             shown(r.diameter, 3) +
             ": is the part the first argument, and are both in one unit, as metres?";
  }
  return "";
}

FindResult find(const Context& context, const PointCloudView& part, const PointCloudView& scene,
                const FindOptions& options) {
  options.validate();
  part.validate();
  scene.validate();
  FindResult out;
  const unsigned threads = host_threads(context);
  const PointCloud outer = outer_surface(part, threads);
  const Box part_box = box_of(outer.view()), scene_box = box_of(scene);
  out.diameter = part_box.diagonal();
  out.scene_extent = scene_box.diagonal();
  out.part_points = part_box.points;
  out.scene_points = scene_box.points;
  out.voxel_size = options.voxel_size;
  const auto ended = [&](FindStatus status) {
    out.status = status;
    return out;
  };
  if (part_box.points < kFewestPoints || !(out.diameter > 0))
    return ended(FindStatus::too_few_part_points);
  if (scene_box.points < kFewestPoints) return ended(FindStatus::too_few_scene_points);
  if (out.scene_extent < kRoom * out.diameter) return ended(FindStatus::scene_smaller_than_part);
  const double pieces_across = out.scene_extent / (kPieceDistance * out.diameter);
  if (pieces_across * pieces_across > kMostPieces)
    throw InvalidArgument("the scene extends over " + shown(out.scene_extent, 3) +
                          ", the part over " + shown(out.diameter, 3) +
                          ": are the units different, as metres and millimetres?");
  const double spacing = suggest_voxel_size({scene}).spacing;
  if (out.voxel_size == 0)
    out.voxel_size = static_cast<float>(std::max(out.diameter / kVoxels, kSpacings * spacing));
  if (static_cast<double>(out.voxel_size) > out.diameter / 4)
    throw InvalidArgument(
        "voxel_size is " + shown(out.voxel_size, 3) + ", but the part extends over " +
        shown(out.diameter, 3) + " only: expected a twentieth of it" +
        (options.voxel_size == 0 ? ", and a scene whose points are as close" : ""));
  const double of_part = suggest_voxel_size({outer.view()}).spacing;
  if (kPartSpacings * of_part > kCoarsestOfPart * out.diameter)
    throw InvalidArgument("the points of the part are " + shown(of_part, 2) +
                          " apart, but it extends over " + shown(out.diameter, 3) +
                          " only: expected a fortieth of it or less, as points of a mesh have");

  // The search.
  RegistrationSettings registration = resolve(RegistrationOptions{out.voxel_size, options.quality});
  registration.seed = options.seed;
  PreparedCloud part_cloud = prepare(context, outer.view(), registration.prepare);
  PrepareSettings of_scene = registration.prepare;
  of_scene.surface_side_distance = 0;
  of_scene.wide_feature_radius = 0;
  of_scene.keep_range_limits = true;
  const WithoutFeatures without(scene.size);
  const PreparedCloud scene_cloud = prepare(context, without.of(scene), of_scene);
  out.part_points = part_cloud.size();
  out.scene_points = scene_cloud.size();
  if (out.part_points < kFewestPoints) return ended(FindStatus::too_few_part_points);
  if (out.scene_points < kFewestPoints) return ended(FindStatus::too_few_scene_points);
  const ViewpointSource source = scene_cloud.statistics().viewpoint;
  SearchedScene searched;
  searched.points = scene_cloud.points();
  searched.normals = scene_cloud.normals();
  searched.origin = scene_cloud.origin();
  searched.oriented = source != ViewpointSource::none;
  if (source == ViewpointSource::given || source == ViewpointSource::origin)
    searched.viewpoints = scene_cloud.viewpoints();
  registration.prepare.surface_side_distance = 0;
  registration.evidence.degeneracy_search_distance = 0;  // the evidence below tells better

  // The evidence. Without a viewpoint its confidence was fitted with half a voxel, and finer
  // evidence only lowers it (bench/notes/sensors.md).
  const double voxel = static_cast<double>(out.voxel_size);
  const double finest = searched.viewpoints.empty() ? voxel / 2 : voxel / kFineVoxels;
  const float fine =
      static_cast<float>(std::max({finest, kFineSpacings * spacing, kPartSpacings * of_part,
                                   std::min(voxel / 2, kFinePartSpacings * of_part)}));
  out.evidence_voxel_size = fine;
  const PartSurface surface = surface_of(context, outer, 0.7f * fine, threads);
  if (surface.points.size() < kFewestPoints) return ended(FindStatus::too_few_part_points);
  const PreparedCloud fine_scene = prepared_surface(context, scene, fine, true);
  const bool oriented = fine_scene.statistics().viewpoint != ViewpointSource::none;
  const SceneSurface scene_surface(fine_scene.points(), fine_scene.normals(),
                                   oriented && surface.oriented, 2 * fine);
  std::vector<SceneView> views;
  const std::vector<Eigen::Vector3f> raw = thinned(scene, fine / 2);
  for (const Eigen::Vector3f& viewpoint : searched.viewpoints) views.emplace_back(raw, viewpoint);
  const PartVerifier verifier(surface, scene_surface, views, fine);
  // Normals of a model are exact at edges, too.
  const bool exact = !outer.normals.empty();
  std::vector<Vec3> points, normals;
  for (const Eigen::Vector3f& p : exact ? outer.points : surface.points)
    points.push_back({p.x(), p.y(), p.z()});
  for (const Eigen::Vector3f& n : exact ? outer.normals : surface.normals)
    normals.push_back({n.x(), n.y(), n.z()});
  CloudSymmetry symmetry(points, normals, 1.5f * fine);
  const PartSearch search{context,      part_cloud,   registration,    verifier, scene_surface,
                          out.diameter, outer.origin, searched.origin, threads};
  std::vector<Hypothesis> all = hypotheses_in(search, searched, out.neighborhoods), instances;
  for (int round = 0;; ++round) {
    instances = instances_of(verifier, symmetry, out.diameter, all);
    if (round == kRepetitions) break;
    // What was found hides nothing of the others any more.
    ++registration.seed;
    for (Hypothesis& h :
         hypotheses_in(search, rest_of(searched, scene_surface, instances), out.neighborhoods))
      all.push_back(std::move(h));
    all = distinct(verifier, std::move(all), kSameAfterRefinement * out.diameter);
    judge(verifier, threads, all);
  }
  for (const Hypothesis& h : instances) {
    FoundPart instance;
    instance.evidence = h.verdict.evidence;
    instance.equivalent_poses = h.equivalent;
    const double log_odds = part_log_odds(instance.evidence);
    instance.confidence = part_confidence(instance.evidence);
    instance.scene_from_part =
        Eigen::Translation3d(searched.origin) * h.pose * Eigen::Translation3d(-outer.origin);
    if (instance.confidence >= options.min_confidence)
      out.instances.push_back(instance);
    else if (log_odds >= kDoubtful)
      out.doubtful.push_back(instance);
  }
  for (std::vector<FoundPart>* list : {&out.instances, &out.doubtful})
    std::stable_sort(list->begin(), list->end(), [](const FoundPart& a, const FoundPart& b) {
      return a.confidence > b.confidence;
    });
  out.status = out.instances.empty() ? FindStatus::not_found : FindStatus::found;
  return out;
}

}  // namespace gpureg::localization
