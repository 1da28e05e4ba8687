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
            "Neighbourhood of the normal's PCA, metres. Normals of the wide features use a radius "
            "that is larger by wide_feature_radius / feature_radius."),
      field("feature_radius", &O::feature_radius, "Neighbourhood of FPFH, metres."),
      field("wide_feature_radius", &O::wide_feature_radius,
            "Neighbourhood of a second FPFH, metres; 0: none."),
      field("max_correspondence_distance", &O::max_correspondence_distance,
            "Largest distance of an inlier and of a correspondence of the refinement, metres. An "
            "alignment may use a smaller one than its clouds were prepared with, never a larger "
            "one."),
      field("depth_maps", &O::depth_maps,
            "Number of viewpoints that get a depth map for free-space tests; 0: none, and given "
            "normals are never turned."),
      field("surface_side_distance", &O::surface_side_distance,
            "Range in front of and behind its surfaces within which a cloud tells the two sides "
            "apart, metres; 0: not at all."),
  };
}

std::vector<Field<CompatibilityOptions>> compatibility_fields() {
  using O = CompatibilityOptions;
  return {
      field("max_matches", &O::max_matches, "Matches kept per pair, 4 to 65536."),
      field("seeds", &O::seeds, "Matches whose neighbourhoods become candidates, 1 to 8192."),
      field("max_members", &O::max_members,
            "Compatible matches of a seed that take part, 3 to 1024."),
      field("triangles", &O::triangles, "Triangles tried per seed, 1 to 4096."),
      field("refits", &O::refits,
            "Least-squares fits to the consensus set of the best triangle, 1 to 8."),
      field("tolerance", &O::tolerance,
            "Metres that the distances of compatible matches may differ by."),
      field("max_turn", &O::max_turn,
            "Largest difference of the cosines between their normals, (0, 2]; 2: no test."),
      field("consensus_distance", &O::consensus_distance,
            "Metres within which a pose brings a match together."),
      field("seed_separation", &O::seed_separation,
            "Metres around a seed without a weaker seed; shortest side of a triangle."),
  };
}

std::vector<Field<QuadrupleOptions>> quadruple_fields() {
  using O = QuadrupleOptions;
  return {
      field("count", &O::count, "Quadruples drawn per pair, at most 2**30."),
      field("neighbors", &O::neighbors, "Nearest features kept per source point, 1 to 16."),
      field("mutual", &O::mutual, "Keep only matches that are nearest in both directions."),
      field("edge_similarity", &O::edge_similarity,
            "Smallest ratio between corresponding sides in the polygon test, (0, 1]."),
      field("max_survivors", &O::max_survivors, "Quadruples scored per pair at most, 1 to 2**22."),
      field("max_normal_angle", &O::max_normal_angle,
            "Degrees between the normals of an inlier while hypotheses are compared, (0, 180]; "
            "180: no test."),
      field("max_verification_normal_angle", &O::max_verification_normal_angle,
            "The same while the winner is verified."),
      field("min_inlier_ratio", &O::min_inlier_ratio,
            "Verified inlier ratio below which no alignment is reported, [0, 1]."),
  };
}

std::vector<Field<RefineOptions>> refine_fields() {
  using O = RefineOptions;
  return {
      field("max_iterations", &O::max_iterations, "0 switches the refinement off."),
      field("kernel_width", &O::kernel_width, "Width of the Geman-McClure kernel, metres."),
  };
}

std::vector<Field<EvidenceOptions>> evidence_fields() {
  using O = EvidenceOptions;
  return {
      field("sample", &O::sample,
            "Approximate number of points of each cloud that score a candidate, 64 to 65536."),
      field("modes", &O::modes,
            "Distinct poses that are refined and verified by all points, 1 to 64."),
      field("max_normal_angle", &O::max_normal_angle,
            "Degrees between the normals of an inlier, (0, 180]."),
      field("mode_angle", &O::mode_angle,
            "Two poses are one mode where their rotations differ by less than this, degrees, ..."),
      field("mode_distance", &O::mode_distance,
            "... and the cloud's centre by less than this, metres."),
      field("degeneracy_search_distance", &O::degeneracy_search_distance,
            "Range of the degeneracy search, metres: the most likely mode is perturbed along its "
            "weakest direction by up to this far, both ways; 0: no search."),
      field("free_space_margin", &O::free_space_margin,
            "Metres in front of an observed surface within which a point does not violate free "
            "space."),
      field("min_range", &O::min_range,
            "Metres from a viewpoint below which nothing counts as observed."),
  };
}

std::vector<Field<ConfidenceCalibration>> calibration_fields() {
  using C = ConfidenceCalibration;
  return {
      field("slope", &C::slope, "Factor of the log odds, > 0."),
      field("offset", &C::offset, "Added to the log odds."),
  };
}

std::vector<Field<RegistrationOptions>> registration_fields() {
  using O = RegistrationOptions;
  return {
      field("seed", &O::seed, "Same seed, same bits, on any backend and number of threads."),
      field("min_confidence", &O::min_confidence,
            "Confidence below which no alignment is reported, [0, 1] (method 'compatibility')."),
      field("accept_symmetry", &O::accept_symmetry,
            "Report one of several poses that a symmetry of the larger cloud makes equivalent if "
            "their common confidence reaches min_confidence (method 'compatibility')."),
      field("calibration", &O::calibration,
            "Scales every confidence to a sensor, see gpureg.calibrate (method 'compatibility')."),
      field("method", &O::method,
            "How candidate poses are found: 'compatibility' (SC2-PCR) or 'quadruples' "
            "(LoopSmart)."),
      field("smaller_as_source", &O::smaller_as_source,
            "Move the cloud with fewer points. Results are of the caller's source and target "
            "either way."),
      field("prepare", &O::prepare, "How a raw cloud is prepared."),
      field("compatibility", &O::compatibility, "Candidates of the method 'compatibility'."),
      field("quadruples", &O::quadruples, "Hypotheses of the method 'quadruples'."),
      field("refine", &O::refine, "How poses are refined."),
      field("evidence", &O::evidence,
            "How the method 'compatibility' scores and verifies candidates."),
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
  bind_options_class<CompatibilityOptions>(
      m, "CompatibilityOptions",
      "Candidate poses from matches that keep each other's distances and angles "
      "(method 'compatibility').",
      compatibility_fields());
  bind_options_class<QuadrupleOptions>(
      m, "QuadrupleOptions",
      "The paper's hypotheses (method 'quadruples'): uniform quadruples of feature matches, scored "
      "by their inliers.",
      quadruple_fields());
  bind_options_class<RefineOptions>(m, "RefineOptions",
                                    "Robust point-to-plane ICP that refines the winning "
                                    "hypothesis, or every mode.",
                                    refine_fields());
  bind_options_class<EvidenceOptions>(
      m, "EvidenceOptions",
      "How candidates are scored and verified (method 'compatibility'): support by matches, "
      "overlap of both clouds, free space.",
      evidence_fields());
  bind_options_class<ConfidenceCalibration>(
      m, "ConfidenceCalibration",
      "Confidence of another sensor: log odds = offset + slope * log odds. The default changes "
      "nothing.",
      calibration_fields())
      .def(
          "__call__",
          [](const ConfidenceCalibration& c, double confidence) { return c(confidence); },
          py::arg("confidence"), "The calibrated probability.")
      .def_property_readonly("is_identity", &ConfidenceCalibration::is_identity,
                             "Whether it changes nothing.");
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
