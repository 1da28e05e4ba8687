// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "localization/building.hpp"
#include "support/expect_error.hpp"
#include "support/limited_file_size.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::test {
namespace {

class SavedMap : public testing::Test {
 protected:
  SavedMap() : map(building({1, 2}, map_options(4))), path(folder / "map.gpureg") {}

  TemporaryFolder folder;
  PreparedMap map;
  std::string path;
};

TEST_F(SavedMap, LoadedIsEqual) {
  map.save(path);
  EXPECT_TRUE(PreparedMap::is_saved(path));
  const PreparedMap loaded = PreparedMap::load(path);
  EXPECT_EQ(loaded.size(), map.size());
  EXPECT_EQ(loaded.tiles(), map.tiles());
  EXPECT_EQ(loaded.options().tile_size, map.options().tile_size);
  EXPECT_EQ(loaded.options().voxel_size, map.options().voxel_size);
  const PointCloud before = map.cloud(), after = loaded.cloud();
  EXPECT_EQ(before.points, after.points);
  EXPECT_EQ(before.normals, after.normals);
  EXPECT_EQ(before.viewpoints, after.viewpoints);
  EXPECT_EQ(before.viewpoints.size(), 2u);
  const std::string again = folder / "again.gpureg";
  loaded.save(again);
  EXPECT_EQ(content_of(again), content_of(path));
  const Query query(2, 1, 8);
  const Context context = Context::cpu(2);
  EXPECT_EQ(numbers_of(locate(context, query.scan.view(), loaded)),
            numbers_of(locate(context, query.scan.view(), map)));
}

TEST_F(SavedMap, SidesThatAreInferredAreSavedButAreNoNormals) {
  PointCloud cloud;
  for (const unsigned room : {1u, 2u, 3u})
    for (const Eigen::Vector3f& p : moved(map_from_room(room - 1), furnished_room(room, room)))
      cloud.points.push_back(p);
  const PreparedMap bare = localization::prepare_map(cloud.view(), map_options(5));
  EXPECT_TRUE(bare.cloud().normals.empty());
  bare.save(path);
  const PreparedMap loaded = PreparedMap::load(path);
  EXPECT_TRUE(loaded.cloud().normals.empty());
  EXPECT_GT(content_of(path).size(), (sizeof(Eigen::Vector3f) + 3) * bare.size());
  const Query query(2, 1, 8);
  const LocateResult result = locate(Context::cpu(2), query.scan.view(), loaded);
  EXPECT_EQ(result.status, LocateStatus::found);
  ASSERT_FALSE(result.poses.empty());
  EXPECT_LT(query.error(result.poses.front()), 0.05);  // half a voxel
  EXPECT_EQ(numbers_of(result), numbers_of(locate(Context::cpu(1), query.scan.view(), bare)));
}

TEST_F(SavedMap, OtherFilesAreNamed) {
  map.save(path);
  const std::string good = content_of(path);
  const auto refused = [&](const std::string& content, const char* why) {
    folder.write("map.gpureg", content);
    expect_error<IoError>([&] { PreparedMap::load(path); }, {path, why});
  };
  refused("", "no saved map");
  refused("ply\nformat ascii 1.0\n", "no saved map");
  for (const std::size_t size :
       {std::size_t(12), std::size_t(28), good.size() / 2, good.size() - 1})
    refused(good.substr(0, size), "truncated");
  refused(good + "x", "longer");
  std::string later = good;
  later[8] = 5;
  refused(later, "version 5");
  for (std::size_t at = 28; at < good.size(); at += good.size() / 20) {
    std::string flipped = good;
    flipped[at] = static_cast<char>(flipped[at] ^ 0x10);
    refused(flipped, "checksum");
  }
  expect_error<IoError>([&] { PreparedMap::load(folder / "missing"); }, {"missing"});
  folder.write("cloud.ply", "ply\n");
  EXPECT_FALSE(PreparedMap::is_saved(folder / "cloud.ply"));
}

TEST_F(SavedMap, AFullDiskLosesNothing) {
  map.save(path);
  const std::string good = content_of(path);
  {
    const LimitedFileSize full(1000);
    expect_error<IoError>([&] { map.save(path); }, {path});
  }
  EXPECT_EQ(content_of(path), good);
  EXPECT_EQ(folder.count(), 1u);
}

TEST(Map, TheOrderOfPiecesDoesNotMatter) {
  const auto pieces = [](std::initializer_list<unsigned> order) {
    MapBuilder builder(map_options());
    for (const unsigned room : order) {
      PointCloud cloud;
      cloud.points = moved(map_from_room(room), furnished_room(room, room));
      builder.add_cloud(cloud.view());
    }
    return builder.build().cloud().points;
  };
  EXPECT_EQ(pieces({0, 1, 2}), pieces({2, 0, 1}));
}

TEST(Map, EveryPointIsInOneTile) {
  const PreparedMap small = building({1, 2, 3}, map_options(2)),
                    whole = building({1, 2, 3}, map_options());
  EXPECT_EQ(small.size(), whole.size());
  EXPECT_GT(small.tiles(), whole.tiles());
}

}  // namespace
}  // namespace gpureg::test
