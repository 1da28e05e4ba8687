// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/options.hpp"

#include "fields.hpp"
#include "fields/options.hpp"

namespace gpureg::python {
void bind_options(py::module_& m) {
  bind_options_class<PrepareOptions>(m);
  bind_options_class<ConfidenceCalibration>(m)
      .def(
          "__call__",
          [](const ConfidenceCalibration& c, double confidence) { return c(confidence); },
          py::arg("confidence"), "The calibrated probability.")
      .def_property_readonly("is_identity", &ConfidenceCalibration::is_identity,
                             "Whether it changes nothing.");
  bind_options_class<RegistrationOptions>(m).def_static(
      "loopsmart",
      [](const py::object& voxel_size) {
        return RegistrationOptions::loopsmart(argument<float>(voxel_size, "voxel_size"));
      },
      py::arg("voxel_size") = shortest(RegistrationOptions{}.voxel_size),
      "The paper's algorithm with the paper's numbers.");
}

}  // namespace gpureg::python
