// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <map>

#include "gpureg/evaluation.hpp"
#include "gpureg/registration.hpp"
#include "support/data_folder.hpp"
#include "support/plain_ply.hpp"

namespace gpureg {
namespace {

// Real fragments of the red kitchen, a few pairs with wide overlap each: the paper's preset must find them all.
TEST(RealData, RedKitchenPairs) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redkitchen/fragments");
  const evaluation::GroundTruth truth = evaluation::read_ground_truth(folder);
  const RegistrationOptions options = RegistrationOptions::loopsmart();
  const Context context = Context::cpu();
  std::vector<PointCloud> raw;
  std::vector<PointCloudView> views;
  for (int k = 0; k < 4; ++k) raw.push_back(test::read_plain_ply(folder + "/cloud_bin_" + std::to_string(k) + ".ply"));
  for (const PointCloud& cloud : raw) views.push_back(cloud.view());
  const std::vector<PreparedCloud> clouds = prepare_batch(context, views, options.prepare);
  int tried = 0;
  for (std::size_t k = 0; k < truth.log.size(); ++k) {
    const int i = truth.log[k].i, j = truth.log[k].j;
    if (j > 3) continue;
    const RegistrationResult r = align(context, clouds[static_cast<std::size_t>(j)], clouds[static_cast<std::size_t>(i)], options);
    EXPECT_TRUE(r.aligned()) << i << " " << j;
    EXPECT_LT(evaluation::redwood_error(truth.log[k].transform, r.target_from_source.matrix(), truth.information[k].information), 0.2) << i << " " << j;
    ++tried;
  }
  EXPECT_GE(tried, 3);
}

}  // namespace
}  // namespace gpureg
