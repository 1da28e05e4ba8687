// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "gpureg/registration.hpp"
#include "support/result_bytes.hpp"

/// Bytes of results as lines of text. No test library, so that it builds for any processor.
namespace gpureg::test {

inline std::string hex(std::uint64_t bits, int digits = 16) {
  char text[20];
  std::snprintf(text, sizeof text, "%0*llx", digits, static_cast<unsigned long long>(bits));
  return text;
}

inline std::string hex(double value) {
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  return hex(bits);
}

/// FNV-1a.
class Hash {
 public:
  void add(const void* data, std::size_t size) {
    for (std::size_t k = 0; k < size; ++k)
      value_ = (value_ ^ static_cast<const unsigned char*>(data)[k]) * 0x100000001B3u;
  }
  std::string text() const { return hex(value_); }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325u;
};

template <typename Rows>
std::string hash_of(const Rows& rows) {
  Hash hash;
  for (const auto& row : rows) hash.add(&row, sizeof row);
  return hash.text();
}

inline std::string pose_text(const UnalignedIsometry3d& pose) {
  std::string out;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) out += " " + hex(pose.matrix()(row, column));
  return out;
}

inline std::string evidence_text(const PoseEvidence& e) {
  std::string out = " " + std::to_string(e.match_inliers);
  for (const double v : {e.match_support,
                         e.source_overlap,
                         e.target_overlap,
                         e.source_residual,
                         e.target_residual,
                         e.source_normal_weighted_overlap,
                         e.target_normal_weighted_overlap,
                         e.source_observed,
                         e.target_observed,
                         e.source_free_space_violation,
                         e.target_free_space_violation,
                         e.source_occluded,
                         e.target_occluded,
                         e.source_near_surface,
                         e.target_near_surface,
                         e.source_front_violation_near,
                         e.target_front_violation_near,
                         e.source_front_violation_far,
                         e.target_front_violation_far,
                         e.source_behind_surface,
                         e.target_behind_surface})
    out += " " + hex(v);
  for (const double v : e.information_eigenvalues) out += " " + hex(v);
  for (const double v : e.weakest_direction) out += " " + hex(v);
  return out;
}

class Report {
 public:
  void line(const std::string& text) { lines_.push_back(text); }

  void clouds(const std::vector<PreparedCloud>& clouds) {
    for (std::size_t k = 0; k < clouds.size(); ++k) {
      const PreparedCloud& c = clouds[k];
      line("cloud " + std::to_string(k) + " points " + hash_of(c.points()) + " normals " +
           hash_of(c.normals()) + " features " + hash_of(c.features()));
    }
  }

  void pairs(const std::string& name, const std::vector<Pair>& pairs,
             const std::vector<RegistrationResult>& results) {
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const RegistrationResult& r = results[k];
      const std::string pair =
          name + " " + std::to_string(pairs[k].source) + " " + std::to_string(pairs[k].target);
      line(pair + " status " + to_string(r.status) + " " + to_string(r.reason) + " score " +
           hex(r.confidence));
      if (r.has_pose()) line(pair + " pose" + pose_text(r.target_from_source));
      for (std::size_t m = 0; m < r.modes.size() && m < 3; ++m)
        line(pair + " mode " + std::to_string(m) + " confidence " + hex(r.modes[m].confidence) +
             " " + hex(r.modes[m].overlap_confidence) + " evidence" +
             evidence_text(r.modes[m].evidence));
      const std::vector<char> all = bytes(r);
      Hash hash;
      hash.add(all.data(), all.size());
      line(pair + " all " + hash.text());
    }
  }

  const std::vector<std::string>& lines() const { return lines_; }

 private:
  std::vector<std::string> lines_;
};

}  // namespace gpureg::test
