// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace gpureg {

/// Base of everything that gpureg throws. "No alignment found" is not an error: it is a
/// RegistrationStatus.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A broken coarse_score of the caller: an option out of range, a view that lies about itself.
/// Names field and value.
class InvalidArgument : public Error {
 public:
  using Error::Error;
};

/// The wanted backend was not built in, or this machine cannot run it (no device, driver too old,
/// CPU without AVX2).
class BackendUnavailable : public Error {
 public:
  using Error::Error;
};

/// The device failed (out of memory, lost). The message says whether the Context stays usable.
class DeviceError : public Error {
 public:
  using Error::Error;
};

/// A file that cannot be read, is malformed, or cannot be written. The message names the file and
/// the reason.
class IoError : public Error {
 public:
  using Error::Error;
};

}  // namespace gpureg
