// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gpureg/registration.hpp"
#include "inputs/scene.hpp"
#include "json/json_fwd.hpp"

namespace gpureg::cli {

/// The pairs of a folder and their results: plain values, which become JSON in files alone.
struct PairStore {
  std::vector<Pair> pairs;                  ///< indices of fragments: i is the target, j the source
  std::vector<RegistrationResult> results;  ///< of each pair; skipped: not aligned yet

  PairStore() = default;
  explicit PairStore(std::vector<Pair> of) : pairs(std::move(of)), results(pairs.size()) {}

  bool done(std::size_t k) const { return results[k].status != RegistrationStatus::skipped; }
  /// Places of the pairs that are done, in order.
  std::vector<std::size_t> all_done() const;
};

/// Writes a document that ends with the pairs that are done. with_information: the pairs keep
/// Redwood's information matrix, which a map needs. Throws IoError.
void write_pairs(const std::string& path, const Json& head, const PairStore& store,
                 const FragmentFolder& folder, bool with_information);

/// The pairs of a result of `gpureg batch` or of an earlier map, without those of unusable
/// fragments.
/// @throws IoError naming the file and the pair: no such result, a damaged or unfinished one,
///   fragments that the folder lacks.
/// @throws InvalidArgument where it was made with another voxel size.
PairStore read_pairs(const std::string& path, const FragmentFolder& folder, float voxel_size);

/// Leaves of the moments what read_pairs() finds in a result, so that both give the same map.
void reduce_moments(RegistrationResult& result);

}  // namespace gpureg::cli
