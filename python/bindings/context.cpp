// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/context.hpp"

#include <pybind11/stl.h>

#include "fields.hpp"

namespace gpureg::python {
namespace {

Context cpu(const py::object& threads) {
  const auto count = argument<unsigned>(threads, "threads", "a whole number, 0 or more");
  const py::gil_scoped_release release;
  return Context::cpu(count);
}

/// What no signature of Context.cuda takes.
Context refuse_cuda(const py::args& positional, const py::kwargs& keywords) {
  const char* const bytes = "bytes, 0 or more";
  if (!positional.empty() && !PyLong_Check(positional[0].ptr()))
    argument<std::vector<int>>(positional[0], "device", "a whole number, or a list of them");
  if (positional.size() > 1) argument<std::size_t>(positional[1], "memory_budget", bytes);
  for (const auto& [key, value] : keywords) {
    const std::string name = py::str(key);
    if (name == "device")
      argument<int>(value, name, "a whole number");
    else if (name == "devices")
      argument<std::vector<int>>(value, name, "a list of whole numbers");
    else if (name == "memory_budget")
      argument<std::size_t>(value, name, bytes);
    else
      throw py::type_error("Context.cuda has no argument '" + name +
                           "'; it has device, or devices and memory_budget");
  }
  throw py::type_error("Context.cuda: expected device, or devices and memory_budget");
}

}  // namespace

void bind_context(py::module_& m) {
  // Starting threads or a device takes time; dropping the last handle joins them.
  using release = py::call_guard<py::gil_scoped_release>;
  py::class_<Context>(m, "Context", "Where work runs: owns threads (CPU) or a device (CUDA).")
      .def_static("cpu", &cpu, py::arg("threads") = 0,
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
      .def_static("cuda", &refuse_cuda)
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
      .def("trim", &Context::trim, release(),
           "Returns memory that the context keeps for later calls to the driver; prepared clouds "
           "stay. Nothing on the CPU.")
      .def("__repr__", [](const Context& c) { return "<gpureg.Context " + c.description() + ">"; });
  m.def("describe_backends", &describe_backends, release(),
        "One line per backend of this build, with its devices or why it cannot be used.");
}

}  // namespace gpureg::python
