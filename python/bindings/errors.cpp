// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/error.hpp"

#include "bindings.hpp"
#include "gpureg/sets/pair_journal.hpp"

namespace gpureg::python {
namespace {

// They live as long as the interpreter: the translator below may run at any time.
PyObject* error = nullptr;
PyObject* invalid_argument = nullptr;
PyObject* backend_unavailable = nullptr;
PyObject* device_error = nullptr;
PyObject* io_error = nullptr;
PyObject* damaged_journal = nullptr;

PyObject* make(py::module_& m, const char* name, const char* doc, PyObject* bases) {
  const std::string full = std::string("gpureg.") + name;
  PyObject* made = PyErr_NewExceptionWithDoc(full.c_str(), doc, bases, nullptr);
  if (made == nullptr) throw py::error_already_set();
  m.add_object(name, py::reinterpret_borrow<py::object>(made));
  return made;
}

// Also what Python calls such a mistake, so that `except ValueError` catches it.
PyObject* make_kind(py::module_& m, const char* name, const char* doc, PyObject* builtin) {
  const py::tuple bases =
      py::make_tuple(py::handle(error), py::reinterpret_borrow<py::object>(builtin));
  return make(m, name, doc, bases.ptr());
}

}  // namespace

void bind_errors(py::module_& m) {
  error = make(m, "Error", "Base of everything that gpureg raises by itself.", PyExc_Exception);
  invalid_argument =
      make_kind(m, "InvalidArgument", "An argument or option out of range.", PyExc_ValueError);
  backend_unavailable =
      make_kind(m, "BackendUnavailable",
                "The backend was not built in, or this machine cannot run it.", PyExc_RuntimeError);
  device_error =
      make_kind(m, "DeviceError", "The device failed: out of memory, or lost.", PyExc_RuntimeError);
  io_error =
      make_kind(m, "IoError", "A file that cannot be read, is malformed, or cannot be written.",
                PyExc_OSError);
  damaged_journal = make(m, "DamagedJournal", "A journal of pairs that cannot be read.", io_error);
  py::register_local_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const InvalidArgument& e) {
      PyErr_SetString(invalid_argument, e.what());
    } catch (const BackendUnavailable& e) {
      PyErr_SetString(backend_unavailable, e.what());
    } catch (const DeviceError& e) {
      PyErr_SetString(device_error, e.what());
    } catch (const DamagedJournal& e) {
      PyErr_SetString(damaged_journal, e.what());
    } catch (const IoError& e) {
      PyErr_SetString(io_error, e.what());
    } catch (const Error& e) {
      PyErr_SetString(error, e.what());
    }
  });
}

}  // namespace gpureg::python
