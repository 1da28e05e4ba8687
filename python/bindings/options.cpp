// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/options.hpp"

#include "fields.hpp"

namespace gpureg::python {
namespace {

std::vector<Field<PrepareOptions>> prepare_fields() {
  using O = PrepareOptions;
  return {
      field("voxel_size", &O::voxel_size,
            "Edge of the downsampling voxel, metres; 0 keeps the points as they are."),
      field("normal_radius", &O::normal_radius,
            "Neighbourhood of the normal's PCA, metres; of the wide features wider by as much as "
            "they are."),
      field("feature_radius", &O::feature_radius, "Neighbourhood of FPFH, metres."),
      field("search_distance", &O::search_distance,
            "Farthest neighbour that alignment will ever ask this cloud for, metres."),
      field("wide_feature_radius", &O::wide_feature_radius,
            "Neighbourhood of a second FPFH, metres; 0: none."),
      field(
          "depth_maps", &O::depth_maps,
          "Viewpoints that depth maps are made of for free-space tests; 0: none, and given normals "
          "are never turned."),
      field("surface_side_distance", &O::surface_side_distance,
            "How far from its surfaces a cloud tells their front from their back, metres; 0: not "
            "at all."),
  };
}

std::vector<Field<HypothesisOptions>> hypothesis_fields() {
  using O = HypothesisOptions;
  return {
      field("proposal", &O::proposal, "How candidate poses are found."),
      field("count", &O::count, "Quadruples drawn per pair, at most 2**30."),
      field("neighbors", &O::neighbors, "Nearest features kept per source point, 1 to 16."),
      field("mutual", &O::mutual, "Keep only matches that are nearest in both directions."),
      field("edge_similarity", &O::edge_similarity,
            "Ratio by which sides may differ in the polygon test, (0, 1]."),
      field("max_survivors", &O::max_survivors, "Quadruples scored per pair at most, 1 to 2**22."),
      field("smaller_as_source", &O::smaller_as_source,
            "Sample and score the cloud with fewer points."),
      field("seed", &O::seed, "Same seed, same bits, on any backend and number of threads."),
  };
}

std::vector<Field<CompatibilityOptions>> compatibility_fields() {
  using O = CompatibilityOptions;
  return {
      field("max_matches", &O::max_matches, "Matches kept per pair, 4 to 65536."),
      field("seeds", &O::seeds, "Matches whose neighbourhoods become candidates, 1 to 8192."),
      field("max_members", &O::max_members, "Compatible matches looked at per seed, 3 to 1024."),
      field("triangles", &O::triangles, "Triangles tried per seed, 1 to 4096."),
      field("refits", &O::refits, "Least-squares fits of each seed's best triangle, 1 to 8."),
      field("tolerance", &O::tolerance,
            "Metres that the distances of compatible matches may differ by."),
      field("max_turn", &O::max_turn,
            "That the cosines of their normals' angles may differ by, (0, 2]."),
      field("consensus_distance", &O::consensus_distance,
            "Metres within which a pose brings a match together."),
      field("seed_separation", &O::seed_separation, "Metres around a seed without a lesser one."),
  };
}

std::vector<Field<EvidenceOptions>> evidence_fields() {
  using O = EvidenceOptions;
  return {
      field("sample", &O::sample, "Points of each cloud that judge a candidate at first."),
      field("modes", &O::modes, "Distinct poses refined and judged by all points, 1 to 64."),
      field("max_normal_angle", &O::max_normal_angle,
            "Degrees between the normals of an inlier, (0, 180]."),
      field("mode_angle", &O::mode_angle, "Degrees within which two poses are one, and ..."),
      field("mode_distance", &O::mode_distance, "... metres between the clouds' centres."),
      field("degeneracy_search_distance", &O::degeneracy_search_distance,
            "Metres that the likeliest pose is slid, both ways, along the direction that its "
            "surfaces determine least, and by quarters of it where it is open whether the pose is "
            "right; 0: not at all."),
      field("free_space_margin", &O::free_space_margin,
            "Metres before a seen surface that a point may lie."),
      field("min_range", &O::min_range,
            "Metres from a viewpoint nearer than which nothing is judged."),
  };
}

std::vector<Field<ScoreOptions>> score_fields() {
  using O = ScoreOptions;
  return {
      field("max_correspondence_distance", &O::max_correspondence_distance,
            "Farthest an inlier may be, metres."),
      field("max_normal_angle", &O::max_normal_angle,
            "Degrees between an inlier's normals while hypotheses compete, (0, 180]."),
      field("max_verification_normal_angle", &O::max_verification_normal_angle,
            "The same while the winner is judged."),
      field("min_inlier_ratio", &O::min_inlier_ratio,
            "Judged inlier ratio below which no alignment is reported, [0, 1]."),
  };
}

std::vector<Field<RefineOptions>> refine_fields() {
  using O = RefineOptions;
  return {
      field("max_iterations", &O::max_iterations, "0 switches the refinement off."),
      field("max_correspondence_distance", &O::max_correspondence_distance,
            "Metres, at most PrepareOptions.search_distance."),
      field("kernel_width", &O::kernel_width, "Width of the Geman-McClure kernel, metres."),
  };
}

std::vector<Field<RegistrationOptions>> registration_fields() {
  using O = RegistrationOptions;
  return {
      field("prepare", &O::prepare, "How a raw cloud is prepared."),
      field("hypothesis", &O::hypothesis, "Where hypotheses come from."),
      field("compatibility", &O::compatibility, "Candidates from compatible matches."),
      field("evidence", &O::evidence, "How candidates are judged."),
      field("score", &O::score, "What makes a hypothesis a result."),
      field("refine", &O::refine, "How the winner is polished."),
      field("min_confidence", &O::min_confidence,
            "Confidence below which no alignment is reported, [0, 1]."),
  };
}

std::uint32_t quality_of(const py::object& value) {
  return argument<std::uint32_t>(value, "quality",
                                 "a whole number from 0 to " + std::to_string(kHighestQuality));
}

}  // namespace

void bind_options(py::module_& m) {
  bind_options_class<PrepareOptions>(m, "PrepareOptions",
                                     "How a raw cloud becomes a PreparedCloud.", prepare_fields());
  bind_options_class<HypothesisOptions>(
      m, "HypothesisOptions", "Where hypotheses come from: quadruples of cached feature matches.",
      hypothesis_fields());
  bind_options_class<CompatibilityOptions>(
      m, "CompatibilityOptions", "Candidate poses from matches that keep each other's distances.",
      compatibility_fields());
  bind_options_class<EvidenceOptions>(m, "EvidenceOptions", "How candidates are judged.",
                                      evidence_fields());
  bind_options_class<ScoreOptions>(
      m, "ScoreOptions", "What makes a point an inlier and a hypothesis a result.", score_fields());
  bind_options_class<RefineOptions>(
      m, "RefineOptions", "Robust point-to-plane ICP that polishes the winner.", refine_fields());
  auto cls = bind_options_class<RegistrationOptions>(
      m, "RegistrationOptions", "All options of one registration.", registration_fields());
  cls.def_static(
      "from_voxel_size",
      [](const py::object& voxel_size, const py::object& quality) {
        return RegistrationOptions::from_voxel_size(argument<float>(voxel_size, "voxel_size"),
                                                    quality_of(quality));
      },
      py::arg("voxel_size"), py::arg("quality") = kDefaultQuality,
      "Every length from the voxel size (metres); quality, 0 to 10, trades time for recall.");
  cls.def(
      "with_quality",
      [](const RegistrationOptions& o, const py::object& quality) {
        return o.with_quality(quality_of(quality));
      },
      py::arg("quality"), "A copy with quality's number of candidates, everything else as it is.");
  cls.def_static(
      "loopsmart",
      [](const py::object& voxel_size) {
        return RegistrationOptions::loopsmart(argument<float>(voxel_size, "voxel_size"));
      },
      py::arg("voxel_size") = shortest(PrepareOptions{}.voxel_size),
      "The paper's algorithm with its lengths scaled to the voxel size (metres).");
}

}  // namespace gpureg::python
