// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/localization/find.hpp"

#include <pybind11/stl.h>

#include <array>
#include <cstdio>
#include <type_traits>

#include "cloud_input.hpp"
#include "fields.hpp"
#include "fields/find.hpp"
#include "interrupt.hpp"
#include "localization/find/part_confidence.hpp"
#include "matrix.hpp"

namespace gpureg::python {

using namespace localization;

namespace {

/// @param evidence by names, as a record has it.
std::array<double, kPartFeatures> part_features_of(const py::dict& evidence) {
  PartEvidence out;
  fields::Fields<PartEvidence>::visit([&](auto member, const fields::Field& field) {
    auto& value = out.*member;
    value = py::cast<std::decay_t<decltype(value)>>(evidence[field.name]);
  });
  return part_features(out);
}

}  // namespace

void bind_find(py::module_& m) {
  bind_options_class<FindOptions>(m);
  bind_record_class<PartEvidence>(m);

  using P = FoundPart;
  py::class_<P>(m, "FoundPart", "An instance of a part in a scene.")
      .def_property_readonly(
          "scene_from_part", [](const P& p) { return array_of(p.scene_from_part.matrix()); },
          "(4, 4) float64: maps points of the part into the scene's frame.")
      .def_readonly("confidence", &P::confidence,
                    "Probability that the pose is correct, up to symmetry.")
      .def_readonly("evidence", &P::evidence, "What speaks for and against the pose.")
      .def_readonly("equivalent_poses", &P::equivalent_poses,
                    "Other poses that a symmetry of the part makes equal to this one.")
      .def("__repr__", [](const P& p) {
        char text[80];
        std::snprintf(text, sizeof(text), "<gpureg.FoundPart, confidence %.3f>", p.confidence);
        return std::string(text);
      });

  using R = FindResult;
  py::class_<R>(m, "FindResult", "Where the instances of a part are in a scene.")
      .def_property_readonly(
          "status", [](const R& r) { return localization::to_string(r.status); },
          "'found', 'not_found', 'too_few_part_points', 'too_few_scene_points' or "
          "'scene_smaller_than_part'.")
      .def_property_readonly(
          "explanation", [](const R& r) { return explain(r); }, "The status in one sentence.")
      .def_readonly("instances", &R::instances, "Distinct instances, the most confident first.")
      .def_readonly("doubtful", &R::doubtful,
                    "Poses below min_confidence, as far as they deserve a look.")
      .def_property_readonly(
          "voxel_size", [](const R& r) { return shortest(r.voxel_size); },
          "Of the search, that was used.")
      .def_property_readonly(
          "evidence_voxel_size", [](const R& r) { return shortest(r.evidence_voxel_size); },
          "Of the evidence: a quarter of it, or more where points are far apart, and half of it "
          "where the viewpoint of the scene is not known.")
      .def_readonly("diameter", &R::diameter, "Of the part: diagonal of its box.")
      .def_readonly("scene_extent", &R::scene_extent, "Diagonal of the box of the scene.")
      .def_readonly("part_points", &R::part_points, "Prepared points of the part.")
      .def_readonly("scene_points", &R::scene_points, "Prepared points of the scene.")
      .def_readonly("neighborhoods", &R::neighborhoods,
                    "Pieces of the scene that the part was aligned with.")
      .def("__repr__", [](const R& r) {
        char text[96];
        std::snprintf(text, sizeof(text), "<gpureg.FindResult %s, %zu instances>",
                      localization::to_string(r.status), r.instances.size());
        return std::string(text);
      });

  m.def(
      "find",
      [](const Context& context, const py::tuple& part, const py::tuple& scene,
         const FindOptions options) {
        const Input of_part(part), of_scene(scene);
        return interruptible([&] { return find(context, of_part.view, of_scene.view, options); });
      },
      py::arg("context"), py::arg("part"), py::arg("scene"), py::arg("options"));
  m.def("_part_features", &part_features_of, py::arg("evidence"),
        "Features of the confidence of a part, in the order of PartFeature.");
}

}  // namespace gpureg::python
