// SPDX-License-Identifier: BSD-3-Clause
// The same comparisons on real fragments, which have edges, holes, stray points and noise.
#include <gtest/gtest.h>

#include "api/with_settings.hpp"
#include "gpureg/io.hpp"
#include "oracle/oracle.hpp"
#include "support/data_folder.hpp"

namespace gpureg::test {
namespace {

std::vector<PreparedCloud> red_kitchen(const std::string& folder) {
  std::vector<PreparedCloud> clouds;
  for (const int k : {0, 7, 13}) {
    PointCloud cloud = io::read_point_cloud(folder + "/cloud_bin_" + std::to_string(k) + ".ply");
    cloud.normals.clear();
    clouds.push_back(
        prepare(Context::cpu(2), cloud.view(), resolve(RegistrationOptions{0.05f}).prepare));
  }
  return clouds;
}

TEST(RedKitchenOracle, Normals) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redkitchen/fragments");
  Comparison pca, pcl;
  for (const PreparedCloud& cloud : red_kitchen(folder)) {
    pca.append(compare_normals_with_pca(cloud));
    pcl.append(compare_normals_with_pcl(cloud));
  }
  ASSERT_GT(pca.differences.size(), 8000u);
  EXPECT_GT(pca.share_within(0.01), 0.999);  // as on the random surfaces
  EXPECT_GT(pcl.share_within(0.05), 0.999);
}

TEST(RedKitchenOracle, Features) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redkitchen/fragments");
  Comparison folded, whole;
  for (const PreparedCloud& cloud : red_kitchen(folder)) {
    const FeatureComparison comparison = compare_features_with_pcl(cloud);
    folded.append(comparison.folded);
    whole.append(comparison.whole);
  }
  ASSERT_GT(folded.differences.size(), 3000u);
  // Of 300. What differs are the last bits of the arc tangent, and with them, rarely, the bin of an
  // angle on the edge of two: one of some hundred pairs of a neighbour's histogram, weighted.
  EXPECT_GT(folded.share_within(0.001), 0.95);
  EXPECT_EQ(folded.share_within(0.2), 1);
  // Edges of scans have points with but a few, common neighbours, and so with one normal.
  EXPECT_GT(whole.share_within(0.1), 0.95);
}

}  // namespace
}  // namespace gpureg::test
