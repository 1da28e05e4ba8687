// SPDX-License-Identifier: BSD-3-Clause
#include "records/options_json.hpp"

#include <charconv>
#include <cstdlib>

namespace gpureg::cli {
namespace {

double shortest(float value) {
  char text[64] = {};
  std::to_chars(text, text + sizeof(text) - 1, value);
  return std::strtod(text, nullptr);
}

}  // namespace

Json to_json(const RegistrationOptions& options) {
  const PrepareOptions& p = options.prepare;
  const QuadrupleOptions& q = options.quadruples;
  const RefineOptions& r = options.refine;
  Json json;
  json["seed"] = options.seed;
  json["min_confidence"] = options.min_confidence;
  json["accept_symmetry"] = options.accept_symmetry;
  json["calibration"] = {{"slope", options.calibration.slope},
                         {"offset", options.calibration.offset}};
  json["method"] = to_string(options.method);
  json["smaller_as_source"] = options.smaller_as_source;
  json["prepare"] = {{"voxel_size", shortest(p.voxel_size)},
                     {"normal_radius", shortest(p.normal_radius)},
                     {"feature_radius", shortest(p.feature_radius)},
                     {"wide_feature_radius", shortest(p.wide_feature_radius)},
                     {"max_correspondence_distance", shortest(p.max_correspondence_distance)},
                     {"depth_maps", p.depth_maps},
                     {"surface_side_distance", shortest(p.surface_side_distance)}};
  json["quadruples"] = {
      {"count", q.count},
      {"neighbors", q.neighbors},
      {"mutual", q.mutual},
      {"edge_similarity", shortest(q.edge_similarity)},
      {"max_survivors", q.max_survivors},
      {"max_normal_angle", shortest(q.max_normal_angle)},
      {"max_verification_normal_angle", shortest(q.max_verification_normal_angle)},
      {"min_inlier_ratio", shortest(q.min_inlier_ratio)}};
  json["refine"] = {{"max_iterations", r.max_iterations},
                    {"kernel_width", shortest(r.kernel_width)}};
  const CompatibilityOptions& c = options.compatibility;
  json["compatibility"] = {{"max_matches", c.max_matches},
                           {"seeds", c.seeds},
                           {"max_members", c.max_members},
                           {"triangles", c.triangles},
                           {"refits", c.refits},
                           {"tolerance", shortest(c.tolerance)},
                           {"max_turn", shortest(c.max_turn)},
                           {"consensus_distance", shortest(c.consensus_distance)},
                           {"seed_separation", shortest(c.seed_separation)}};
  const EvidenceOptions& e = options.evidence;
  json["evidence"] = {{"sample", e.sample},
                      {"modes", e.modes},
                      {"max_normal_angle", shortest(e.max_normal_angle)},
                      {"mode_angle", shortest(e.mode_angle)},
                      {"mode_distance", shortest(e.mode_distance)},
                      {"degeneracy_search_distance", shortest(e.degeneracy_search_distance)},
                      {"free_space_margin", shortest(e.free_space_margin)},
                      {"min_range", shortest(e.min_range)}};
  return json;
}

}  // namespace gpureg::cli
