// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/options.hpp"

#include "fields.hpp"
#include "fields/options.hpp"

namespace gpureg::python {
namespace {

std::uint32_t quality_of(const py::object& value) {
  return argument<std::uint32_t>(value, "quality",
                                 "a whole number from 0 to " + std::to_string(kHighestQuality));
}

}  // namespace

void bind_options(py::module_& m) {
  bind_options_class<PrepareOptions>(m);
  bind_options_class<CompatibilityOptions>(m);
  bind_options_class<QuadrupleOptions>(m);
  bind_options_class<RefineOptions>(m);
  bind_options_class<EvidenceOptions>(m);
  bind_options_class<ConfidenceCalibration>(m)
      .def(
          "__call__",
          [](const ConfidenceCalibration& c, double confidence) { return c(confidence); },
          py::arg("confidence"), "The calibrated probability.")
      .def_property_readonly("is_identity", &ConfidenceCalibration::is_identity,
                             "Whether it changes nothing.");
  auto cls = bind_options_class<RegistrationOptions>(m);
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
