// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/result.hpp"

#include <pybind11/stl.h>

#include <cstdio>
#include <limits>

#include "fields.hpp"
#include "fields/evidence.hpp"
#include "fields/statistics.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

py::dict state_of(const CorrespondenceMoments& m) {
  py::dict state;
  state["count"] = m.count;
  state["sum"] = array_of(m.sum);
  state["outer"] = array_of(m.outer);
  return state;
}

CorrespondenceMoments moments_from(const py::dict& state) {
  CorrespondenceMoments m;
  m.count = state["count"].cast<std::uint64_t>();
  m.sum = matrix_of<Eigen::Vector3d>(state["sum"].cast<py::array_t<double>>(), "sum");
  m.outer = matrix_of<Eigen::Matrix3d>(state["outer"].cast<py::array_t<double>>(), "outer");
  return m;
}

void bind_moments(py::module_& m) {
  using M = CorrespondenceMoments;
  py::class_<M>(m, "CorrespondenceMoments",
                "Moments of the points that take part in correspondences.")
      .def_readonly("count", &M::count, "Number of points.")
      .def_property_readonly(
          "sum", [](const M& o) { return array_of(o.sum); }, "(3,): sum of p.")
      .def_property_readonly(
          "outer", [](const M& o) { return array_of(o.outer); }, "(3, 3): sum of p p'.")
      .def(
          "information_redwood", [](const M& o) { return array_of(o.information_redwood()); },
          "(6, 6): translation first, rotation as quaternion vector.")
      .def(
          "information_open3d", [](const M& o) { return array_of(o.information_open3d()); },
          "(6, 6): rotation (angles) first.")
      .def(py::pickle(&state_of, &moments_from))
      .def("__repr__", [](const M& o) {
        return "<gpureg.CorrespondenceMoments of " + std::to_string(o.count) + " points>";
      });
}

py::dict state_of(const RegistrationMode& mode) {
  py::dict state;
  state["target_from_source"] = array_of(mode.target_from_source.matrix());
  state["confidence"] = mode.confidence;
  state["overlap_confidence"] = mode.overlap_confidence;
  state["equivalent"] = mode.equivalent;
  state["evidence"] = to_dict(mode.evidence, fields_of<PoseEvidence>());
  state["rank_before_refinement"] = mode.rank_before_refinement;
  return state;
}

RegistrationMode mode_from(const py::dict& state) {
  RegistrationMode mode;
  mode.target_from_source.matrix() = matrix_of<Eigen::Matrix4d>(
      state["target_from_source"].cast<py::array_t<double>>(), "target_from_source");
  mode.confidence = state["confidence"].cast<double>();
  mode.overlap_confidence = state["overlap_confidence"].cast<double>();
  mode.equivalent = state["equivalent"].cast<bool>();
  assign(mode.evidence, fields_of<PoseEvidence>(), state["evidence"], "PoseEvidence");
  mode.rank_before_refinement = state["rank_before_refinement"].cast<std::uint32_t>();
  return mode;
}

void bind_mode(py::module_& m) {
  using M = RegistrationMode;
  py::class_<M>(m, "RegistrationMode", "One of the distinct poses of a pair.")
      .def_property_readonly(
          "target_from_source", [](const M& o) { return array_of(o.target_from_source.matrix()); },
          "(4, 4) float64: maps points of the source into the target's frame.")
      .def_readonly("confidence", &M::confidence, "Probability that the pose is correct.")
      .def_readonly("overlap_confidence", &M::overlap_confidence,
                    "Probability that the pose is correct and the clouds overlap by 30 % or more.")
      .def_readonly("equivalent", &M::equivalent,
                    "The clouds cannot tell this pose from the first one: a symmetry of the larger "
                    "cloud lies between them.")
      .def_readonly("evidence", &M::evidence, "Evidence for and against the pose.")
      .def_readonly("rank_before_refinement", &M::rank_before_refinement,
                    "Rank by the coarse score among the modes after the first refinement, from 0.")
      .def(
          "to_dict", [](const M& o) { return state_of(o); },
          "All values as plain Python and numpy objects.")
      .def(py::pickle([](const M& o) { return state_of(o); }, &mode_from))
      .def("__repr__", [](const M& o) {
        char text[96];
        std::snprintf(text, sizeof(text), "<gpureg.RegistrationMode, confidence %.3f>",
                      o.confidence);
        return std::string(text);
      });
}

std::string text_of(const RegistrationResult& r) {
  char numbers[160];
  std::snprintf(numbers, sizeof(numbers), "confidence %.3f, rmse %.4g, %u of %u inliers, %.1f ms",
                r.confidence, r.inlier_rmse, r.statistics.inliers, r.statistics.points_scored,
                r.timings.total());
  std::string text = std::string("<gpureg.RegistrationResult ") + to_string(r.status);
  if (!r.aligned()) text += std::string(": ") + to_string(r.reason);
  if (r.has_pose()) text += std::string(", ") + numbers;
  return text + ">";
}

RegistrationStatus status_from(const std::string& name) {
  for (const auto s : {RegistrationStatus::aligned, RegistrationStatus::not_aligned,
                       RegistrationStatus::skipped, RegistrationStatus::aligned_up_to_symmetry})
    if (name == to_string(s)) return s;
  throw py::value_error("status: '" + name + "' is none");
}

RegistrationReason reason_from(const std::string& name) {
  for (int k = 0; k <= static_cast<int>(kLastRegistrationReason); ++k)
    if (const auto r = static_cast<RegistrationReason>(k); name == to_string(r)) return r;
  throw py::value_error("reason: '" + name + "' is none");
}

py::dict result_state(const RegistrationResult& r) {
  py::dict state;
  state["status"] = to_string(r.status);
  state["reason"] = to_string(r.reason);
  state["target_from_source"] = array_of(r.target_from_source.matrix());
  state["confidence"] = r.confidence;
  state["inlier_ratio"] = r.inlier_ratio;
  state["inlier_rmse"] = r.inlier_rmse;
  state["voxel_size"] = shortest(r.voxel_size);
  state["source_moments"] = state_of(r.source_moments);
  state["target_moments"] = state_of(r.target_moments);
  py::list modes;
  for (const RegistrationMode& mode : r.modes) modes.append(state_of(mode));
  state["modes"] = modes;
  state["flat"] = r.flat;
  state["source_viewpoint"] = to_string(r.source_viewpoint);
  state["target_viewpoint"] = to_string(r.target_viewpoint);
  state["statistics"] = to_dict(r.statistics, fields_of<RegistrationStatistics>());
  state["timings"] = to_dict(r.timings, fields_of<StageTimings>());
  return state;
}

RegistrationResult result_from(const py::dict& state) {
  RegistrationResult r;
  r.status = status_from(state["status"].cast<std::string>());
  r.reason = reason_from(state["reason"].cast<std::string>());
  r.target_from_source.matrix() = matrix_of<Eigen::Matrix4d>(
      state["target_from_source"].cast<py::array_t<double>>(), "target_from_source");
  r.confidence = state["confidence"].cast<double>();
  r.inlier_ratio = state["inlier_ratio"].cast<double>();
  r.inlier_rmse = state["inlier_rmse"].cast<double>();
  r.voxel_size = state["voxel_size"].cast<float>();
  r.source_moments = moments_from(state["source_moments"]);
  r.target_moments = moments_from(state["target_moments"]);
  for (const auto mode : state["modes"].cast<py::list>())
    r.modes.push_back(mode_from(mode.cast<py::dict>()));
  r.flat = state["flat"].cast<bool>();
  r.source_viewpoint = convert<ViewpointSource>(state["source_viewpoint"]);
  r.target_viewpoint = convert<ViewpointSource>(state["target_viewpoint"]);
  assign(r.statistics, fields_of<RegistrationStatistics>(), state["statistics"],
         "RegistrationStatistics");
  assign(r.timings, fields_of<StageTimings>(), state["timings"], "StageTimings");
  return r;
}

void bind_registration_result(py::module_& m) {
  using R = RegistrationResult;
  py::class_<R>(m, "RegistrationResult", "Result of one pair.")
      .def_property_readonly(
          "status", [](const R& r) { return to_string(r.status); },
          "\"aligned\", \"aligned_up_to_symmetry\" (with accept_symmetry), \"not_aligned\", or "
          "\"skipped\" (never tried).")
      .def_property_readonly(
          "reason", [](const R& r) { return to_string(r.reason); },
          "Why the pair is not aligned; \"none\" where it is. Of a pose without confidence, as "
          "diagnosed from its evidence: \"too_few_points\", \"no_candidate\", "
          "\"too_little_overlap\", \"underconstrained\", \"ambiguous\", "
          "\"contradicts_free_space\", \"clutter\", \"outside_fitted_range\", \"symmetric\", or "
          "\"confidence_too_low\" where nothing stands out.")
      .def_property_readonly(
          "explanation", [](const R& r) { return explain(r); },
          "The reason as a sentence, with its numbers.")
      .def_property_readonly(
          "advice", [](const R& r) { return advice(r.reason); },
          "What to try next; empty where there is nothing.")
      .def_property_readonly(
          "aligned", &R::aligned,
          "A pose is reported: status \"aligned\" or \"aligned_up_to_symmetry\".")
      .def_property_readonly("has_pose", &R::has_pose,
                             "target_from_source holds a pose, reported or not.")
      .def_property_readonly(
          "target_from_source", [](const R& r) { return array_of(r.target_from_source.matrix()); },
          "(4, 4) float64: maps points of the source into the target's frame; "
          "NaN where there is none.")
      .def_readonly("confidence", &R::confidence,
                    "Probability that target_from_source is correct; with the method 'quadruples' "
                    "the inlier ratio. What reaches min_confidence is reported.")
      .def_property_readonly("symmetry_confidence", &R::symmetry_confidence,
                             "Probability that the pose or one of its equivalent modes is correct: "
                             "the sum of their confidences.")
      .def_property_readonly("equivalent_poses", &R::equivalent_poses,
                             "Number of modes that the clouds cannot tell from the first one, with "
                             "that one; 0 without modes.")
      .def_property_readonly(
          "modes", [](const R& r) { return r.modes; },
          "Distinct poses, the most confident first; the first is target_from_source. Empty "
          "with the method 'quadruples'.")
      .def_readonly("inlier_ratio", &R::inlier_ratio, "Inliers over points scored, [0, 1].")
      .def_readonly("inlier_rmse", &R::inlier_rmse, "Metres, over the inliers.")
      .def_property_readonly(
          "voxel_size", [](const R& r) { return shortest(r.voxel_size); },
          "Of the target's preparation, in the unit of the points; 0: the pair was not tried.")
      .def_readonly("source_moments", &R::source_moments,
                    "Of all correspondences: points of the source, in its frame.")
      .def_readonly("target_moments", &R::target_moments,
                    "Of all correspondences: points of the target, in its frame.")
      .def_readonly("flat", &R::flat,
                    "Both clouds are scans of a 2-D scanner: all poses move the plane of the "
                    "source onto that of the target, exactly, and the moments are of points in "
                    "the planes.")
      .def_property_readonly(
          "source_viewpoint", [](const R& r) { return to_string(r.source_viewpoint); },
          "What was known of the place that the source was seen from; see PrepareStatistics.")
      .def_property_readonly(
          "target_viewpoint", [](const R& r) { return to_string(r.target_viewpoint); },
          "The same of the target.")
      .def_readonly("statistics", &R::statistics, "What was left after each stage.")
      .def_readonly("timings", &R::timings, "Milliseconds per stage.")
      .def("to_dict", &result_state, "All values as plain Python and numpy objects.")
      .def(py::pickle(&result_state, &result_from))
      // Else a result without a pose would be true, as any object is.
      .def("__bool__", &R::aligned, "aligned.")
      .def("__repr__", &text_of);
}

}  // namespace

void bind_result(py::module_& m) {
  bind_record_class<RegistrationStatistics>(m);
  bind_record_class<StageTimings>(m).def_property_readonly("total", &StageTimings::total,
                                                           "Milliseconds of all stages.");
  bind_record_class<PrepareStatistics>(m).def_property_readonly("total", &PrepareStatistics::total,
                                                                "Milliseconds of all stages.");
  bind_moments(m);
  bind_record_class<PoseEvidence>(m);
  bind_mode(m);
  bind_registration_result(m);
}

}  // namespace gpureg::python
