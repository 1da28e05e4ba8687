// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "gpureg/preparation/sensor_fixed.hpp"
#include "gpureg/sets/fragment_set.hpp"

namespace gpureg::sets {

/// Prepares fragments of a set without the parts that are fixed to the sensor.
class Preparer {
 public:
  Preparer(const Context& context, const FragmentSet& fragments, const RegistrationOptions& options)
      : context_(context), fragments_(fragments), options_(options) {}

  /// Takes these fragments in their order, in chunks that fill a device and take little memory.
  /// @param go_on called with the number of them that are done; false ends the call.
  /// @return one for each; fewer, if go_on ended the call.
  std::vector<PreparedFragment> prepare(const std::vector<std::size_t>& which,
                                        const std::function<bool(std::size_t)>& go_on = {});

  /// Looks for the parts in the first fragments of the set; else the first that prepare() takes
  /// have them.
  void find_parts();

 private:
  struct Chunk;
  void leave_out_parts(Chunk& chunk);
  bool prepare_chunk(Chunk& chunk, std::vector<PreparedFragment>& out,
                     const std::function<bool(std::size_t)>& go_on);

  Context context_;
  const FragmentSet& fragments_;
  RegistrationOptions options_;
  std::optional<FixedParts> parts_;
};

}  // namespace gpureg::sets
