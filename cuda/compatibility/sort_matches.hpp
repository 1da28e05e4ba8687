// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/device/segments.hpp"

namespace gpureg::cuda {

/// Moves the results of each pair that are kept to the front, by the order of their matches, equal
/// ones by their place. False, and nothing is done, where a pair has too many results for the
/// shared memory of the device.
/// @param found per pair: results that are kept.
/// @param key pair << 33 | (1 << 32 where the result is dropped) | order of the match, per result.
/// @param place of each result in its pair, ascending.
bool sort_matches(Exec& exec, const Segments& segments, const std::uint32_t* found,
                  std::uint64_t* key, std::uint32_t* place);

}  // namespace gpureg::cuda
