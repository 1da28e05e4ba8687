// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "api/with_settings.hpp"
#include "cuda/gpu.hpp"
#include "gpureg/registration.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg::test {

using Results = std::vector<std::vector<char>>;

inline Results all_bytes(const std::vector<RegistrationResult>& results) {
  Results out;
  for (const RegistrationResult& r : results) out.push_back(bytes(r));
  return out;
}

/// Six scans of a room and an empty cloud, and every pair of them.
class RoomScans : public ::testing::Test {
 protected:
  RoomScans() {
    given.quadruples = 20000;
    options = resolve(given);
    std::mt19937 random(1);
    for (int k = 0; k < 6; ++k) scans.push_back(moved(random_pose(random), scan_room(random)));
    scans.push_back({});
    for (const auto& s : scans) views.emplace_back(s);
    for (std::uint32_t i = 0; i < scans.size(); ++i)
      for (std::uint32_t j = i + 1; j < scans.size(); ++j) pairs.push_back({j, i});
  }
  void SetUp() override { GPUREG_GPU_OR_SKIP(); }
  Results run(const Context& context, const std::vector<Pair>& list) const {
    return all_bytes(
        align_batch(context, prepare_batch(context, views, options.prepare), list, options));
  }
  RegistrationOptions given{0.08f};
  RegistrationSettings options;  ///< of them
  std::vector<std::vector<Eigen::Vector3f>> scans;
  std::vector<PointCloudView> views;
  std::vector<Pair> pairs;
};

}  // namespace gpureg::test
