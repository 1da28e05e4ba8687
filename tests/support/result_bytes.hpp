// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include "fields/evidence.hpp"
#include "fields/statistics.hpp"
#include "gpureg/result.hpp"

namespace gpureg::test {

/// Values one after the other, without the padding between them.
class ByteWriter {
 public:
  template <typename... T>
  void add(const T&... values) {
    (append(&values, sizeof values), ...);
  }
  template <typename Matrix>
  void add_matrix(const Matrix& m) {
    append(m.data(), sizeof *m.data() * static_cast<std::size_t>(m.size()));
  }
  void append(const void* data, std::size_t size) {
    const std::size_t before = all.size();
    all.resize(before + size);
    if (size > 0) std::memcpy(all.data() + before, data, size);
  }
  std::vector<char> all;
};

/// A struct whose fields are described.
template <typename T>
void add_fields(ByteWriter& out, const T& object) {
  fields::each<T>(
      [&](const std::string&, auto member, const fields::Field&) { out.add(object.*member); });
}

inline void add(ByteWriter& out, const CorrespondenceMoments& m) {
  out.add(m.count);
  out.add_matrix(m.sum);
  out.add_matrix(m.outer);
  out.add_matrix(m.information_redwood());
  out.add_matrix(m.information_open3d());
}

inline void add(ByteWriter& out, const RegistrationMode& mode) {
  out.add_matrix(mode.target_from_source.matrix());
  out.add(mode.confidence, mode.overlap_confidence, mode.rank_before_refinement, mode.equivalent);
  add_fields(out, mode.evidence);
}

/// Everything but the timings, as bytes.
inline std::vector<char> bytes(const RegistrationResult& r) {
  ByteWriter out;
  out.add_matrix(r.target_from_source.matrix());
  out.add(r.status, r.reason, r.has_pose(), r.confidence, r.inlier_ratio, r.inlier_rmse,
          r.source_viewpoint, r.target_viewpoint);
  add_fields(out, r.statistics);
  add(out, r.source_moments);
  add(out, r.target_moments);
  for (const RegistrationMode& mode : r.modes) add(out, mode);
  return out.all;
}

}  // namespace gpureg::test
