// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/registration/scale.hpp"

#include <pybind11/stl.h>

#include <cstdio>

#include "cloud_input.hpp"
#include "interrupt.hpp"
#include "matrix.hpp"

namespace gpureg::python {

namespace {
/// A cloud in host memory.
Input on_host(const py::handle cloud) {
  Input out(cloud.cast<py::tuple>());
  if (out.on_device) throw py::type_error("clouds on a device: not with a scale that is searched");
  return out;
}
}  // namespace

void bind_scale(py::module_& m) {
  using S = ScaledResult;
  py::class_<S>(m, "ScaledResult", "A similarity: result of an alignment with unknown scale.")
      .def_property_readonly(
          "aligned", [](const S& s) { return s.aligned(); }, "A similarity is reported.")
      .def("__bool__", [](const S& s) { return s.aligned(); })
      .def_property_readonly(
          "target_from_source", [](const S& s) { return array_of(s.similarity()); },
          "(4, 4): p_target = M p_source; the upper left 3 x 3 is the rotation times scale.")
      .def_readonly("scale", &S::scale, "Lengths of the target's unit per unit of the source.")
      .def_property_readonly(
          "scale_status", [](const S& s) { return to_string(s.scale_status); },
          "'known', 'found', 'ambiguous', 'not_observable' or 'none'.")
      .def_readonly("scale_deviation", &S::scale_deviation,
                    "Standard deviation of scale as a fraction of it; 0: known.")
      .def_property_readonly(
          "information", [](const S& s) { return array_of(s.information); },
          "(7, 7), of rotation (radians), translation and logarithm of the scale, about the centre "
          "of the points in common.")
      .def_property_readonly(
          "confidence", [](const S& s) { return s.result.symmetry_confidence(); },
          "Probability that scale and pose are correct.")
      .def_property_readonly(
          "candidates",
          [](const S& s) {
            std::vector<std::pair<double, double>> out;
            for (const ScaleCandidate& c : s.candidates) out.emplace_back(c.scale, c.confidence);
            return out;
          },
          "(scale, confidence) of each distinct scale, the most confident first.")
      .def_property_readonly(
          "explanation", [](const S& s) { return explain(s); }, "One sentence.")
      .def_readonly("result", &S::result,
                    "RegistrationResult of the source multiplied by scale: its pose is rigid.")
      .def("__repr__", [](const S& s) {
        return "<gpureg.ScaledResult, " + std::string(to_string(s.result.status)) + ", scale " +
               py::repr(py::float_(s.scale)).cast<std::string>() + " (" +
               to_string(s.scale_status) + ")>";
      });
  using V = ScaledVerification;
  py::class_<V>(m, "ScaledVerification", "Evidence and confidence of one similarity.")
      .def_property_readonly(
          "target_from_source", [](const V& v) { return array_of(v.similarity()); },
          "(4, 4): as given, or refined; the upper left 3 x 3 is the rotation times scale.")
      .def_readonly("scale", &V::scale, "As given, or refined.")
      .def_property_readonly(
          "scale_status", [](const V& v) { return to_string(v.scale_status); },
          "'known', 'found' (refined), 'not_observable' or 'none' (no surface in common).")
      .def_readonly("scale_deviation", &V::scale_deviation, "As of ScaledResult.")
      .def_property_readonly(
          "information", [](const V& v) { return array_of(v.information); },
          "(7, 7), as of ScaledResult.")
      .def_property_readonly(
          "confidence", [](const V& v) { return v.verification.confidence; },
          "Probability that the similarity is correct.")
      .def_readonly("verification", &V::verification,
                    "PoseVerification of the source multiplied by scale: its pose is rigid.")
      .def("__repr__", [](const V& v) {
        char text[128];
        std::snprintf(text, sizeof(text),
                      "<gpureg.ScaledVerification, scale %g (%s), confidence %.3f>", v.scale,
                      to_string(v.scale_status), v.verification.confidence);
        return std::string(text);
      });
  m.def(
      "verify_scaled",
      [](const Context& context, const py::handle source, const py::handle target,
         const py::array_t<double, py::array::c_style>& similarities,
         const RegistrationOptions options, bool refine, bool search_alternatives) {
        const Input a = on_host(source), b = on_host(target);
        std::vector<UnalignedMatrix4d> given;
        if (similarities.ndim() != 3 || similarities.shape(1) != 4 || similarities.shape(2) != 4)
          throw py::type_error("similarities: not an array of 4 x 4 matrices");
        for (py::ssize_t k = 0; k < similarities.shape(0); ++k)
          given.emplace_back(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(
              similarities.data() + 16 * k));
        VerificationOptions verification;
        verification.refine = refine;
        verification.search_alternatives = search_alternatives;
        return interruptible([&] {
          return verify_scaled_poses(context, a.view, b.view, given, options, verification);
        });
      },
      py::arg("context"), py::arg("source"), py::arg("target"), py::arg("similarities"),
      py::arg("options"), py::arg("refine"), py::arg("search_alternatives"));
  m.def(
      "align_scaled_batch",
      [](const Context& context, const py::sequence& clouds,
         const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs, double least,
         double most, const RegistrationOptions options, const std::vector<std::string>& names) {
        std::vector<Input> inputs;
        std::vector<PointCloudView> views;
        for (const py::handle cloud : clouds) {
          inputs.push_back(on_host(cloud));
          views.push_back(inputs.back().view);
        }
        std::vector<Pair> entries;
        for (const auto& [source, target] : pairs) entries.push_back({source, target});
        return interruptible([&] {
          return align_scaled_batch(context, views, entries, {least, most}, options, {}, names);
        });
      },
      py::arg("context"), py::arg("clouds"), py::arg("pairs"), py::arg("least"), py::arg("most"),
      py::arg("options"), py::arg("names") = std::vector<std::string>());
  m.def(
      "align_scaled_auto",
      [](const Context& context, const py::handle source, const py::handle target, double least,
         double most, const RegistrationOptions options) {
        const Input a = on_host(source), b = on_host(target);
        return interruptible(
            [&] { return align_scaled_auto(context, a.view, b.view, {least, most}, options); });
      },
      py::arg("context"), py::arg("source"), py::arg("target"), py::arg("least"), py::arg("most"),
      py::arg("options"));
}

}  // namespace gpureg::python
