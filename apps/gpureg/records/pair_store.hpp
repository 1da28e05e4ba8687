// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "gpureg/registration.hpp"
#include "inputs/scene.hpp"
#include "json/json_fwd.hpp"

namespace gpureg::cli {

/// Writes a document that ends with the pairs.
/// @param result of a pair by its place; those that are skipped are left out.
/// @param with_information the pairs keep Redwood's information matrix, which a map needs.
/// @throws IoError.
void write_pairs(const std::string& path, const Json& head, const std::vector<Pair>& pairs,
                 const std::function<RegistrationResult(std::size_t)>& result,
                 const FragmentFolder& folder, bool with_information);

/// Pairs and their results: indices of fragments, i is the target, j the source.
struct StoredPairs {
  std::vector<Pair> pairs;
  std::vector<RegistrationResult> results;
};

/// The pairs of a result of `gpureg batch`, of an earlier map, or of a journal, as that of
/// `gpureg.register_all` in Python.
/// @throws IoError naming the file and the pair: no such result, a damaged or unfinished one,
///   fragments that the folder lacks.
/// @throws InvalidArgument where it was made with another voxel size.
StoredPairs read_pairs(const std::string& path, const FragmentFolder& folder, float voxel_size);

/// The voxel size that the pairs of such a file were made with; 0: it does not say.
float voxel_size_of_pairs(const std::string& path);

}  // namespace gpureg::cli
