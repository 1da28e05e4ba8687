// SPDX-License-Identifier: BSD-3-Clause
// Closest points by the packed lists of the device: the point, its distance and its normal are
// those of the CPU's closest-point grid, whatever the size of the positions in the near lists.
#include "api/with_settings.hpp"
#include "cuda/common/candidate_lists.hpp"
#include "cuda/common/prepared_cloud.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/find_points.hpp"
#include "cuda/gpu.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg {
namespace {

using test::ListCounts;

class ClosestCells : public ::testing::Test {
 protected:
  void SetUp() override { GPUREG_GPU_OR_SKIP(); }

  /// Near the points, between two of them, and anywhere around.
  std::vector<Vec3> locations(const std::vector<Vec3>& points, float reach) {
    std::vector<Vec3> out;
    std::uniform_int_distribution<std::size_t> any(0, points.size() - 1);
    std::uniform_real_distribution<float> length(0, 1.2f * reach);
    for (int k = 0; k < 20'000; ++k) {
      const Vec3 p = points[any(random)], q = points[any(random)];
      out.push_back(p + test::random_unit(random) * length(random));
      out.push_back((p + q) * 0.5f);
      out.push_back(p);
    }
    return out;
  }

  void expect_same(cuda::Exec& exec, const cpu::CpuCloud& expected, const cuda::CudaCloud& cloud,
                   const std::vector<Vec3>& queries, float distance) {
    const auto found = test::find_points(exec, cloud, queries, distance * distance);
    std::size_t hits = 0;
    for (std::size_t k = 0; k < queries.size() && !HasFailure(); ++k) {
      const Closest c = find_closest(expected.view().closest, expected.points.data(), queries[k],
                                     distance * distance);
      EXPECT_EQ(found[k].index, c.index) << k;
      EXPECT_EQ(found[k].squared_distance, c.squared_distance) << k;
      EXPECT_TRUE(found[k].normal_is_packed) << k;
      if (c.index == kNoValue) continue;
      ++hits;
      EXPECT_EQ(std::memcmp(&found[k].point, &expected.points[c.index], sizeof(Vec3)), 0) << k;
    }
    EXPECT_GT(hits, queries.size() / 4);
  }

  /// Compares a cloud of both backends, also after an eviction; returns the kinds of its lists.
  ListCounts expect_same_points(const std::vector<Vec3>& points) {
    cpu::Exec on_cpu(2);
    cuda::Exec on_cuda(0);
    on_cuda.begin();
    const RawCloud raw = test::raw_cloud(points);
    const auto expected = test::prepare_one(on_cpu, raw, options);
    std::shared_ptr<const cuda::CudaCloud> cloud =
        pipeline::prepare(on_cuda, Span<const RawCloud>{&raw, 1}, options).front();
    bytes_per_point = cloud->data.size() / cloud->size;
    const float reach = options.max_correspondence_distance;
    const auto queries = locations(expected->points, reach);
    for (const float distance : {reach, 0.3f * reach})
      expect_same(on_cuda, *expected, *cloud, queries, distance);
    const ListCounts counts = test::count_lists(on_cuda, *cloud);
    const cuda::PreparedCloud prepared(std::move(cloud));
    EXPECT_TRUE(prepared.evict(*on_cuda.memory()));
    const auto returned = prepared.start_copy(on_cuda);
    on_cuda.synchronize();
    expect_same(on_cuda, *expected, *returned, queries, reach);
    return counts;
  }

  std::mt19937 random{11};
  std::size_t bytes_per_point = 0;
  PrepareSettings options = resolve(RegistrationOptions{0.05f}).prepare;
};

TEST_F(ClosestCells, PositionsOfOneByte) {
  const ListCounts counts = expect_same_points(test::bumpy_sheet(random, 40'000, 3.0f));
  EXPECT_GT(counts.bricks[0], 100u);
  EXPECT_EQ(counts.bricks[1] + counts.bricks[2], 0u);
  // 1.13 KB by the sizes of the arrays, of which the features take 440.
  EXPECT_LT(bytes_per_point, 1250u);
}

// Equal distances everywhere: the lower index wins.
TEST_F(ClosestCells, ALatticeOfPoints) {
  std::vector<Vec3> lattice;
  for (int x = 0; x < 30; ++x)
    for (int y = 0; y < 30; ++y)
      for (int z = 0; z < 3; ++z)
        lattice.push_back(
            Vec3{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)} * 0.0625f);
  std::shuffle(lattice.begin(), lattice.end(), random);
  options.voxel_size = 0;
  EXPECT_GT(expect_same_points(lattice).bricks[0], 0u);
}

// All points of a sphere are candidates of the cells around its centre.
TEST_F(ClosestCells, LongListsOfOneByte) {
  std::vector<Vec3> sphere;
  for (int k = 0; k < 128; ++k) {
    const Vec3 p = test::random_unit(random) * 0.12f;
    sphere.push_back(p);
    sphere.push_back(p * -1.0f);
  }
  options.voxel_size = 0;
  options.max_correspondence_distance = 0.16f;
  const ListCounts counts = expect_same_points(sphere);
  EXPECT_EQ(counts.bricks[1] + counts.bricks[2], 0u);
  EXPECT_GT(counts.long_lists, 0u);
}

TEST_F(ClosestCells, PositionsOfTwoBytesAndLongLists) {
  options = resolve(RegistrationOptions{0.03f}).prepare;
  options.max_correspondence_distance = 0.4f;
  const ListCounts counts = expect_same_points(test::bumpy_sheet(random, 100'000, 3.0f));
  EXPECT_GT(counts.bricks[0], 10u);
  EXPECT_GT(counts.bricks[1], 10u);
  EXPECT_GT(counts.long_lists, 10u);
}

// Two dense cubes, each in the middle of a block.
TEST_F(ClosestCells, PositionsOfFourBytes) {
  constexpr std::size_t kPoints = 100'000;
  options.voxel_size = 0;
  options.normal_radius = options.feature_radius = 0.02f;
  options.wide_feature_radius = 0;
  options.max_correspondence_distance = 0.2f;
  const float middle = 4.0f * options.max_correspondence_distance / 3.0f;
  std::vector<Vec3> points = test::cube(random, kPoints, 0.4f);
  for (Vec3& p : points) p = p + Vec3{middle, middle, middle};
  for (std::size_t k = 0; k < kPoints; ++k) points.push_back(points[k] * -1.0f);
  const ListCounts counts = expect_same_points(points);
  EXPECT_GT(counts.bricks[2], 0u);
  EXPECT_GT(counts.bricks[0] + counts.bricks[1], 0u) << "blocks at the border have fewer points";
  EXPECT_GT(counts.long_lists, 10u);
}

// The hash table serves it, with the arrays of the closest-point grid.
TEST_F(ClosestCells, ACloudTooWideForATable) {
  auto points = test::bumpy_sheet(random, 20'000, 2.0f);
  points.push_back({9000, 9000, 9000});
  const ListCounts counts = expect_same_points(points);
  EXPECT_EQ(counts.bricks[0] + counts.bricks[1] + counts.bricks[2], 0u);
}

// Room for the lists without a device: what the packing writes is what the search reads.
TEST(CandidateLists, RoomAndWords) {
  for (std::uint32_t size = 0; size < 3; ++size)
    for (std::uint32_t count = 0; count < 600; ++count) {
      const std::uint32_t room = cuda::list_room(count, size);
      if (cuda::fits_word(count, size)) {
        EXPECT_EQ(room, 0u);
        EXPECT_LE(count * (8u << size), 24u);
        continue;
      }
      if (count < cuda::kLongList) {
        EXPECT_EQ(room, count);
        continue;
      }
      for (std::uint32_t first = 0; first < 9; ++first)
        EXPECT_LE(cuda::aligned_position(first, size) + cuda::positions_per_word(size) + count,
                  first + room);
    }
  EXPECT_EQ(cuda::position_size(256), 0u);
  EXPECT_EQ(cuda::position_size(257), 1u);
  EXPECT_EQ(cuda::position_size(65536), 1u);
  EXPECT_EQ(cuda::position_size(65537), 2u);
}

}  // namespace
}  // namespace gpureg
