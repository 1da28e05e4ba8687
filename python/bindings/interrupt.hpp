// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>
#include <functional>

#include "bindings.hpp"

namespace gpureg::python {

/// Runs work without Python's lock. Options that it uses have to be copies, as another thread may
/// write those of Python. A signal whose handler raises, such as Ctrl-C, ends work of the
/// CPU within a fraction of a second; what it raised is thrown as error_already_set.
/// Raises RuntimeError in a signal handler that interrupted such work: it would wait for itself.
void interruptibly(const std::function<void()>& work);

/// interruptibly(), with the value of work.
template <typename Work>
auto interruptible(const Work& work) {
  decltype(work()) out{};
  interruptibly([&] { out = work(); });
  return out;
}

}  // namespace gpureg::python
