// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "gpureg/result.hpp"
#include "records/json.hpp"

namespace gpureg::cli {

/// One pair of a batch as it stands in RESULT.json and in the journal. The outputs of a resumed run
/// equal those of an uninterrupted one, because both are made of records that went through JSON.
struct PairRecord {
  int i = 0, j = 0;
  bool aligned = false;
  std::string reason;
  double score = 0;
  /// probability of a correct pose and of 30 % overlap, where estimated
  std::optional<double> strict_score;
  std::optional<Eigen::Matrix4d> transform;  ///< T_ij: fragment j into fragment i
  double milliseconds = 0;                   ///< all stages
  Json json;                                 ///< everything, as written to RESULT.json

  static PairRecord from_result(int i, int j, const RegistrationResult& result);

  /// Throws InvalidArgument with the reason.
  static PairRecord from_json(const Json& json);
};

/// The modes of a pair's record: poses, confidences and, of their evidence, the information of the
/// geometry. Throws InvalidArgument.
std::vector<RegistrationMode> modes_from_json(const Json& pair);

/// The result that a record was made of, as far as loop consistency and reconstruction need it.
/// information: of the journal; null: not known. Throws InvalidArgument.
RegistrationResult result_from_record(const PairRecord& record, const Json& information);

/// 6x6, row by row. Throws InvalidArgument.
Eigen::Matrix<double, 6, 6> information_from_json(const Json& json);

}  // namespace gpureg::cli
