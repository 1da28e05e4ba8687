// SPDX-License-Identifier: BSD-3-Clause
#include "options_json.hpp"

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
  const HypothesisOptions& h = options.hypothesis;
  const ScoreOptions& s = options.score;
  const RefineOptions& r = options.refine;
  Json json;
  json["prepare"] = {{"voxel_size", shortest(p.voxel_size)},
                     {"normal_radius", shortest(p.normal_radius)},
                     {"feature_radius", shortest(p.feature_radius)},
                     {"search_distance", shortest(p.search_distance)},
                     {"wide_feature_radius", shortest(p.wide_feature_radius)},
                     {"depth_maps", p.depth_maps},
                     {"front_reach", shortest(p.front_reach)}};
  json["hypothesis"] = {{"proposal", to_string(h.proposal)},
                        {"count", h.count},
                        {"neighbors", h.neighbors},
                        {"max_survivors", h.max_survivors},
                        {"mutual", h.mutual},
                        {"edge_similarity", shortest(h.edge_similarity)},
                        {"smaller_as_source", h.smaller_as_source},
                        {"seed", h.seed}};
  json["score"] = {{"max_correspondence_distance", shortest(s.max_correspondence_distance)},
                   {"max_normal_angle", shortest(s.max_normal_angle)},
                   {"max_judged_normal_angle", shortest(s.max_judged_normal_angle)},
                   {"min_inlier_ratio", shortest(s.min_inlier_ratio)}};
  json["refine"] = {{"max_iterations", r.max_iterations},
                    {"max_correspondence_distance", shortest(r.max_correspondence_distance)},
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
                      {"slide_distance", shortest(e.slide_distance)},
                      {"free_space_margin", shortest(e.free_space_margin)},
                      {"min_range", shortest(e.min_range)}};
  json["min_confidence"] = options.min_confidence;
  return json;
}

}  // namespace gpureg::cli
