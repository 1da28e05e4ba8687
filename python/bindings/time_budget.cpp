// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/time_budget.hpp"

#include "cloud.hpp"
#include "interrupt.hpp"

namespace gpureg::python {

void bind_time_budget(py::module_& m) {
  using T = TimedResult;
  py::class_<T>(m, "TimedResult", "Result of an alignment within a time budget.")
      .def_readonly("result", &T::result,
                    "The result with the highest confidence of all levels that were run.")
      .def_readonly("quality", &T::quality, "Level of quality of the result.")
      .def_readonly("highest_quality", &T::highest_quality, "The highest level that was run.")
      .def_readonly("levels", &T::levels, "Number of levels that were run.")
      .def_readonly("milliseconds", &T::milliseconds, "Wall time of the call.");
  m.def(
      "align_within",
      [](const Context& context, const Cloud& source, const Cloud& target, double milliseconds,
         const RegistrationOptions options) {
        return interruptible([&] {
          return align_within(context, source.prepared, target.prepared, milliseconds, options);
        });
      },
      py::arg("context"), py::arg("source"), py::arg("target"), py::arg("milliseconds"),
      py::arg("options"));
}

}  // namespace gpureg::python
