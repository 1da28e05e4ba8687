// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/context.hpp"

#include <pybind11/stl.h>

#include "bindings.hpp"

namespace gpureg::python {

void bind_context(py::module_& m) {
  // Starting threads or a device takes time; dropping the last handle joins them.
  using release = py::call_guard<py::gil_scoped_release>;
  py::class_<Context>(m, "Context", "Where work runs: owns threads (CPU) or a device (CUDA).")
      .def_static("cpu", &Context::cpu, py::arg("threads") = 0, release(),
                  "CPU backend; 0 threads: one per hardware thread.")
      .def_static(
          "cuda", [](int device) { return Context::cuda(device); }, py::arg("device") = 0,
          release(), "CUDA backend on one device. Raises BackendUnavailable.")
      .def_static(
          "cuda",
          [](const std::vector<int>& devices, std::size_t memory_budget) {
            return Context::cuda(CudaOptions{devices, memory_budget});
          },
          py::arg("devices"), py::arg("memory_budget") = 0, release(),
          "CUDA backend on several devices (none named: all) that share the work of a batch; "
          "memory_budget: bytes of each that prepared clouds may take, 0: no limit.")
      .def_static("best", &Context::best, release(),
                  "CUDA where a device can be used, else the CPU.")
      .def_property_readonly(
          "backend", [](const Context& c) { return to_string(c.backend()); },
          "\"cpu\" or \"cuda\".")
      .def_property_readonly("threads", &Context::threads, "CPU threads that this context uses.")
      .def_property_readonly("description", &Context::description,
                             "For example \"cpu, 8 threads\".")
      .def_property_readonly(
          "device_memory",
          [](const Context& c) {
            py::list out;
            for (const DeviceMemoryUse& use : c.device_memory()) {
              py::dict entry;
              entry["device"] = use.device;
              entry["bytes_in_use"] = use.bytes_in_use;
              entry["bytes_reserved"] = use.bytes_reserved;
              entry["clouds_evicted"] = use.clouds_evicted;
              out.append(entry);
            }
            return out;
          },
          "One dictionary per CUDA device: bytes in use and reserved, clouds evicted.")
      .def("__repr__", [](const Context& c) { return "<gpureg.Context " + c.description() + ">"; });
  m.def("describe_backends", &describe_backends, release(),
        "One line per backend of this build, with its devices or why it cannot be used.");
}

}  // namespace gpureg::python
