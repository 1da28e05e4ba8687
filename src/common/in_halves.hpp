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

/// The elements of a batch together exceed a limit.
class BatchTooLarge : public InvalidArgument {
 public:
  using InvalidArgument::InvalidArgument;
};

/// Calls work(begin, end) for all elements at once. Elements that together exceed a limit or the
/// memory of the device are halved and tried again, in order, so that a batch fails only where one
/// of its elements fails alone; that element's error leaves this function. Where one is wrong, they
/// are tried one by one: the others are worked at most twice. work: must give the same results in
/// any split, and leave nothing behind where it throws.
template <typename Work>
void in_halves(std::size_t begin, std::size_t end, const Work& work) {
  if (begin == end) return;
  enum class Outcome { done, too_large, one_is_wrong };
  const auto whole = [&] {
    try {
      work(begin, end);
      return Outcome::done;
    } catch (const BatchTooLarge&) {
      if (end - begin == 1) throw;
    } catch (const OutOfDeviceMemory&) {
      if (end - begin == 1) throw;
    } catch (const InvalidArgument&) {
      if (end - begin == 1) throw;
      return Outcome::one_is_wrong;
    }
    return Outcome::too_large;
  };
  const Outcome outcome = whole();
  if (outcome == Outcome::one_is_wrong)
    for (std::size_t k = begin; k < end; ++k) work(k, k + 1);
  if (outcome != Outcome::too_large) return;
  const std::size_t middle = begin + (end - begin) / 2;
  in_halves(begin, middle, work);
  in_halves(middle, end, work);
}

}  // namespace gpureg
