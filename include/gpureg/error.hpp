// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace gpureg {

/// Base of all exceptions of gpureg. "No alignment found" is no error but a RegistrationStatus.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A violated precondition: an option out of range, or a view whose pointers, counts and strides
/// contradict each other. The message names field and value.
class InvalidArgument : public Error {
 public:
  using Error::Error;
};

/// The requested backend is not part of the build, or this machine cannot run it (no device, an old
/// driver, a CPU without AVX2).
class BackendUnavailable : public Error {
 public:
  using Error::Error;
};

/// The device failed (out of memory, lost). The message states whether the Context stays usable.
class DeviceError : public Error {
 public:
  using Error::Error;
};

/// A file is missing, malformed or not writable. The message names the file and the reason.
class IoError : public Error {
 public:
  using Error::Error;
};

}  // namespace gpureg
