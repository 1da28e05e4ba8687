// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <set>
#include <string>
#include <vector>

#include "gpureg/error.hpp"
#include "gpureg/sets/register_all.hpp"
#include "support/scan.hpp"

namespace gpureg::test {

/// Scans of one room, each moved by a pose of its own.
class SmallSet : public FragmentSet {
 public:
  explicit SmallSet(std::size_t scans) {
    for (std::size_t k = 0; k < scans; ++k) {
      std::mt19937 random(static_cast<unsigned>(k));
      const Eigen::Isometry3f pose = random_pose(random).cast<float>();
      PointCloud cloud;
      for (const Eigen::Vector3f& p : scan_room(random)) cloud.points.push_back(pose * p);
      clouds_.push_back(std::move(cloud));
    }
  }

  std::size_t size() const override { return clouds_.size(); }
  std::string name(std::size_t k) const override { return "scan " + std::to_string(k); }
  LoadedCloud read(std::size_t k, const RegistrationOptions&) const override {
    if (bad.count(k) > 0) throw IoError(name(k) + " is truncated");
    return LoadedCloud(clouds_[k]);
  }

  std::set<std::size_t> bad;  // that cannot be read

 private:
  std::vector<PointCloud> clouds_;
};

inline RegistrationOptions quick_options() { return RegistrationOptions{0.15f, 0}; }

}  // namespace gpureg::test
