// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>
#include <utility>

#include "bindings.hpp"

namespace gpureg::python {

/// Calls Python between pieces of work that runs without its lock. What Python raises, by Ctrl-C
/// too, ends the work, and comes out of it.
class Teller {
 public:
  explicit Teller(py::object tell) : tell_(std::move(tell)) {}

  /// False: something was raised.
  template <typename... T>
  bool operator()(const T&... values) {
    const py::gil_scoped_acquire acquire;
    if (raised_) return false;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (!tell_.is_none()) tell_(values...);
    } catch (...) {
      raised_ = std::current_exception();
    }
    return raised_ == nullptr;
  }

  /// Looks for signals alone.
  bool check() {
    const py::gil_scoped_acquire acquire;
    if (!raised_ && PyErr_CheckSignals() != 0)
      raised_ = std::make_exception_ptr(py::error_already_set());
    return raised_ == nullptr;
  }

  /// Runs work without the lock, and throws what was raised meanwhile, if anything.
  template <typename Work>
  void run(const Work& work) {
    std::exception_ptr failed;
    {
      const py::gil_scoped_release release;
      try {
        work();
      } catch (...) {
        failed = std::current_exception();
      }
    }
    rethrow();
    if (failed) std::rethrow_exception(failed);
  }

  void rethrow() const {
    if (raised_) std::rethrow_exception(raised_);
  }

 private:
  py::object tell_;
  std::exception_ptr raised_;
};

}  // namespace gpureg::python
