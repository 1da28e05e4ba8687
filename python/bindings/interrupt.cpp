// SPDX-License-Identifier: BSD-3-Clause
#include "interrupt.hpp"

#include <stdexcept>

#include "common/stop_scope.hpp"

namespace gpureg::python {

void interruptibly(const std::function<void()>& work) {
  if (StopScope::asking())
    throw std::runtime_error("gpureg was called by the handler of a signal that interrupted it");
  bool raised = false;
  {
    const py::gil_scoped_release release;
    const StopScope scope([&] {
      const py::gil_scoped_acquire acquire;
      return raised = PyErr_CheckSignals() != 0;
    });
    try {
      work();
    } catch (const Stopped&) {
    }
  }
  if (raised) throw py::error_already_set();
}

}  // namespace gpureg::python
