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
      field("normal_radius", &O::normal_radius, "Neighbourhood of the normal's PCA, metres."),
      field("feature_radius", &O::feature_radius, "Neighbourhood of FPFH, metres."),
      field("search_distance", &O::search_distance,
            "Farthest neighbour that alignment will ever ask this cloud for, metres."),
  };
}

std::vector<Field<HypothesisOptions>> hypothesis_fields() {
  using O = HypothesisOptions;
  return {
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

std::vector<Field<ScoreOptions>> score_fields() {
  using O = ScoreOptions;
  return {
      field("max_correspondence_distance", &O::max_correspondence_distance,
            "Farthest an inlier may be, metres."),
      field("max_normal_angle", &O::max_normal_angle,
            "Degrees between an inlier's normals while hypotheses compete, (0, 180]."),
      field("max_judged_normal_angle", &O::max_judged_normal_angle,
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
      field("score", &O::score, "What makes a hypothesis a result."),
      field("refine", &O::refine, "How the winner is polished."),
  };
}

}  // namespace

void bind_options(py::module_& m) {
  bind_options_class<PrepareOptions>(m, "PrepareOptions",
                                     "How a raw cloud becomes a PreparedCloud.", prepare_fields());
  bind_options_class<HypothesisOptions>(
      m, "HypothesisOptions", "Where hypotheses come from: quadruples of cached feature matches.",
      hypothesis_fields());
  bind_options_class<ScoreOptions>(
      m, "ScoreOptions", "What makes a point an inlier and a hypothesis a result.", score_fields());
  bind_options_class<RefineOptions>(
      m, "RefineOptions", "Robust point-to-plane ICP that polishes the winner.", refine_fields());
  auto cls = bind_options_class<RegistrationOptions>(
      m, "RegistrationOptions", "All options of one registration.", registration_fields());
  cls.def_static("from_voxel_size", &RegistrationOptions::from_voxel_size, py::arg("voxel_size"),
                 "Every length from the voxel size (metres).");
  cls.def_static(
      "loopsmart", [](float voxel_size) { return RegistrationOptions::loopsmart(voxel_size); },
      py::arg("voxel_size") = shortest(PrepareOptions{}.voxel_size),
      "The paper's algorithm with its lengths scaled to the voxel size (metres).");
}

}  // namespace gpureg::python
