// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "gpureg/result.hpp"
#include "json/json_fwd.hpp"

/// A pair as an object of RESULT.json and of the journal. Readers throw InvalidArgument.
namespace gpureg::cli {

/// The pair of fragments i (target) and j (source).
Json pair_to_json(int i, int j, const RegistrationResult& result);

/// What `evaluate` and `report` need of a pair, whatever program wrote it.
struct PairRecord {
  int i = 0, j = 0;
  bool aligned = false;
  std::string reason;
  std::string explanation;  ///< empty where the file has none
  double confidence = 0;    ///< of another program any number that ranks
  /// probability of a correct pose and of 30 % overlap, where estimated
  std::optional<double> overlap_confidence;
  std::optional<Eigen::Matrix4d> transform;  ///< T_ij: fragment j into fragment i
  double milliseconds = 0;                   ///< all stages
};
PairRecord record_from_json(const Json& pair);

/// The modes of a pair.
std::vector<RegistrationMode> modes_from_json(const Json& pair);

/// The result of a pair without its moments. Members that are absent keep their defaults.
RegistrationResult result_from_json(const Json& pair);

}  // namespace gpureg::cli
