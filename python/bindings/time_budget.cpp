// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/time_budget.hpp"

#include "cloud.hpp"

namespace gpureg::python {

void bind_time_budget(py::module_& m) {
  using T = TimedResult;
  py::class_<T>(m, "TimedResult", "What was found within a time budget.")
      .def_readonly("result", &T::result, "Of all levels run, the one with the highest confidence.")
      .def_readonly("quality", &T::quality, "The level that it is of.")
      .def_readonly("highest_quality", &T::highest_quality, "The highest level that was run.")
      .def_readonly("levels", &T::levels, "How many were run.")
      .def_readonly("milliseconds", &T::milliseconds, "Wall time of the call.");
  m.def(
      "align_within",
      [](const Context& context, const Cloud& source, const Cloud& target, double milliseconds,
         const RegistrationOptions& options) {
        const py::gil_scoped_release release;
        T out = align_within(context, source.prepared, target.prepared, milliseconds, options);
        move_to_origins(out.result, source, target);
        return out;
      },
      py::arg("context"), py::arg("source"), py::arg("target"), py::arg("milliseconds"),
      py::arg("options"));
}

}  // namespace gpureg::python
