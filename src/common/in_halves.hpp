// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "gpureg/error.hpp"

namespace gpureg {

/// The memory of a device does not suffice for a call; the context stays usable. Callers of the
/// library see a DeviceError.
class OutOfDeviceMemory : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

/// Calls work(begin, end) for all elements at once. Elements that together exceed a limit or the
/// memory of the device are halved and tried again, in order, so that a batch fails only where one
/// of its elements fails alone; that element's error leaves this function. work: must give the same
/// results in any split, and leave nothing behind where it throws.
template <typename Work>
void in_halves(std::size_t begin, std::size_t end, const Work& work) {
  if (begin == end) return;
  const auto whole = [&] {
    try {
      work(begin, end);
      return true;
    } catch (const InvalidArgument&) {
      if (end - begin == 1) throw;
    } catch (const OutOfDeviceMemory&) {
      if (end - begin == 1) throw;
    }
    return false;
  };
  if (whole()) return;
  const std::size_t middle = begin + (end - begin) / 2;
  in_halves(begin, middle, work);
  in_halves(middle, end, work);
}

}  // namespace gpureg
