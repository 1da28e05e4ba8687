// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/field.hpp"
#include "gpureg/reconstruction/audit.hpp"

namespace gpureg::fields {

template <>
struct Fields<reconstruction::AuditOptions> {
  static constexpr const char* kName = "AuditOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence = "Options of the audit of a map.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = reconstruction::AuditOptions;
    v(&O::max_shift, {"max_shift", kPositive.in_voxels(), "ICP may move a pair by so much before it contradicts its pose: what is left of the errors of a good map."});
    v(&O::max_shift_per_metre, {"max_shift_per_metre", from(0, kMost, "a finite number >= 0"), "The same for each metre between the scans: how far a map may bend."});
    v(&O::max_contradicted, {"max_contradicted", kPositiveUpToOne, "Probability up to which a connection is contradicted."});
    v(&O::min_confirmed, {"min_confirmed", kPositiveUpToOne, "Probability from which a connection is confirmed."});
    v(&O::most_pairs, {"most_pairs", from(2, 10000), "Pairs of one scan that are looked at: the nearest half, others evenly chosen."});
  }
  // clang-format on
};

}  // namespace gpureg::fields
