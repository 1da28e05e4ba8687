// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "gpureg/io.hpp"
#include "gpureg/preparation/sensor_fixed.hpp"
#include "gpureg/registration.hpp"
#include "support/data_folder.hpp"

namespace gpureg {
namespace {

struct Step {
  std::uint32_t source, target;
  Eigen::Vector3d truth;
};

// Real scans along a corridor. The points at the largest range of the scanner held the direction in
// which the walls slide: the identity, 3.4 m off, had a confidence of .957.
TEST(SensorFixedPoints, HoldNoPoseAlongACorridor) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "corridor3");
  std::vector<PointCloud> scans;
  std::vector<PointCloudView> views;
  for (int k = 0; k < 3; ++k)
    scans.push_back(io::read_point_cloud(folder + "/scan" + std::to_string(k) + ".ply"));
  for (const PointCloud& scan : scans) views.push_back(scan.view());
  const Context context = Context::cpu();
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RegistrationOptions options{0.2f};
    options.seed = seed;
    const std::vector<PreparedCloud> clouds = prepare_batch(context, views, options);
    for (const Step& step : {Step{1, 0, {-0.03, -0.08, 1.56}}, Step{2, 1, {-0.02, -0.06, 1.83}},
                             Step{2, 0, {-0.08, -0.04, 3.36}}}) {
      const RegistrationResult r =
          align(context, clouds[step.source], clouds[step.target], options);
      ASSERT_TRUE(r.has_pose());
      // The truth is good to a tenth of a metre; the voxels have two.
      EXPECT_LT((r.target_from_source.translation() - step.truth).norm(), 0.25)
          << step.source << " to " << step.target << ", seed " << seed << ", " << r.confidence;
      for (const RegistrationMode& mode : r.modes)
        if ((mode.target_from_source.translation() - step.truth).norm() > 0.4)
          EXPECT_LT(mode.confidence, 0.5);
    }
  }
}

}  // namespace
}  // namespace gpureg
