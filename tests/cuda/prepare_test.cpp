// SPDX-License-Identifier: BSD-3-Clause
// The contract of the CUDA backend: the output of every stage of preparation has the CPU's bits.
#include <filesystem>
#include <limits>

#include "api/with_settings.hpp"
#include "cpu/common/stages.hpp"
#include "cuda/common/nearest_feature.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/gpu.hpp"
#include "support/data_folder.hpp"
#include "support/plain_ply.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg {
namespace {

using test::host;
using test::same_bytes;

/// Given features may hold NaNs, whose payload after averaging IEEE leaves open.
std::vector<float> one_nan(std::vector<float> values) {
  for (float& v : values)
    if (v != v) v = std::numeric_limits<float>::quiet_NaN();
  return values;
}

/// Runs both backends over one batch and compares after every stage.
void expect_same_preparation(const std::vector<RawCloud>& raw, const PrepareSettings& options) {
  cpu::Exec on_cpu(2);
  cuda::Exec on_cuda(0);
  on_cuda.begin();
  const Span<const RawCloud> clouds = span_of(raw);

  auto cpu_points = cpu::downsample(on_cpu, clouds, options);
  auto cuda_points = cuda::downsample(on_cuda, clouds, options);
  const auto points = host(on_cuda, cuda_points.points.data(), cuda_points.segments.total());
  for (std::size_t c = 0; c < raw.size(); ++c) {
    SCOPED_TRACE("downsample, cloud " + std::to_string(c));
    const auto& expected = cpu_points[c];
    const auto begin = points.begin() + cuda_points.segments.offset[c];
    ASSERT_TRUE(same_bytes(expected.points,
                           std::vector<Vec3>(begin, begin + cuda_points.segments.size(c))));
    for (int k = 0; k < 3; ++k) ASSERT_EQ(expected.origin[k], cuda_points.facts[c].origin[k]);
    ASSERT_EQ(expected.radius, cuda_points.facts[c].radius);
    ASSERT_EQ(expected.invalid_points, cuda_points.facts[c].invalid_points);
    ASSERT_TRUE(same_bytes(expected.viewpoints, cuda_points.facts[c].viewpoints));
    if (!expected.guides.empty())
      ASSERT_TRUE(same_bytes(
          expected.guides, host(on_cuda, cuda_points.guides.data() + cuda_points.segments.offset[c],
                                expected.guides.size())));
    if (!expected.features.empty())
      ASSERT_TRUE(same_bytes(
          one_nan(expected.features),
          one_nan(host(on_cuda, cuda_points.features.data() + cuda_points.facts[c].feature_offset,
                       expected.features.size()))));
  }

  const auto cpu_grids = cpu::build_grids(on_cpu, cpu_points, options);
  const auto cuda_grids = cuda::build_grids(on_cuda, cuda_points, options);
  for (std::size_t c = 0; c < raw.size(); ++c) {
    SCOPED_TRACE("grid, cloud " + std::to_string(c));
    const auto& expected = cpu_grids[c];
    const std::size_t begin = cuda_points.segments.offset[c];
    ASSERT_TRUE(same_bytes(expected.index,
                           host(on_cuda, cuda_grids.index.data() + begin, expected.index.size())));
    ASSERT_TRUE(same_bytes(
        expected.points, host(on_cuda, cuda_grids.points.data() + begin, expected.points.size())));
    ASSERT_TRUE(same_bytes(
        expected.cell_start,
        host(on_cuda, cuda_grids.cell_start.data() + begin + c, expected.cell_start.size())));
  }

  const auto cpu_normals =
      cpu::estimate_normals(on_cpu, cpu_points, cpu_grids, options.normal_radius);
  const auto cuda_normals =
      cuda::estimate_normals(on_cuda, cuda_points, cuda_grids, options.normal_radius);
  for (std::size_t c = 0; c < raw.size(); ++c) {
    SCOPED_TRACE("normals, cloud " + std::to_string(c));
    ASSERT_TRUE(same_bytes(cpu_normals[c],
                           host(on_cuda, cuda_normals.data() + cuda_points.segments.offset[c],
                                cpu_normals[c].size())));
  }

  const auto cpu_features =
      cpu::compute_features(on_cpu, cpu_points, cpu_normals, cpu_grids, options);
  const auto cuda_features =
      cuda::compute_features(on_cuda, cuda_points, cuda_normals, cuda_grids, options);
  for (std::size_t c = 0; c < raw.size(); ++c) {
    SCOPED_TRACE("features, cloud " + std::to_string(c));
    ASSERT_EQ(cpu_features[c].dimension, cuda_features.dimension[c]);
    ASSERT_TRUE(
        same_bytes(cpu_features[c].valid,
                   host(on_cuda, cuda_features.valid.data() + cuda_points.segments.offset[c],
                        cpu_features[c].valid.size())));
    ASSERT_TRUE(
        same_bytes(one_nan(cpu_features[c].values),
                   one_nan(host(on_cuda, cuda_features.values.data() + cuda_features.offset[c],
                                cpu_features[c].values.size()))));
  }

  auto cpu_wide = cpu::compute_wide_features(on_cpu, cpu_points, cpu_grids, options);
  const auto cuda_wide = cuda::compute_wide_features(on_cuda, cuda_points, cuda_grids, options);
  for (std::size_t c = 0; c < raw.size(); ++c) {
    SCOPED_TRACE("wide features, cloud " + std::to_string(c));
    ASSERT_EQ(cpu_wide[c].values.size(), cuda_wide.offset[c + 1] - cuda_wide.offset[c]);
    ASSERT_TRUE(same_bytes(
        cpu_wide[c].values,
        host(on_cuda, cuda_wide.values.data() + cuda_wide.offset[c], cpu_wide[c].values.size())));
    ASSERT_TRUE(
        same_bytes(cpu_wide[c].valid,
                   host(on_cuda,
                        cuda_wide.valid.data() +
                            (cpu_wide[c].valid.empty() ? 0 : cuda_points.segments.offset[c]),
                        cpu_wide[c].valid.size())));
  }

  auto cpu_maps = cpu::build_depth_maps(on_cpu, clouds, cpu_points, options);
  const auto cuda_maps = cuda::build_depth_maps(on_cuda, clouds, cuda_points, options);
  for (std::size_t c = 0; c < raw.size(); ++c) {
    SCOPED_TRACE("depth maps, cloud " + std::to_string(c));
    ASSERT_EQ(cpu_maps[c].step, cuda_maps.step);
    ASSERT_TRUE(same_bytes(cpu_maps[c].viewpoints,
                           host(on_cuda, cuda_maps.viewpoints.data() + cuda_maps.offset[c],
                                cuda_maps.offset[c + 1] - cuda_maps.offset[c])));
    ASSERT_TRUE(same_bytes(
        cpu_maps[c].depth,
        host(on_cuda, cuda_maps.depth.data() + std::size_t(cuda_maps.offset[c]) * kMapCells,
             cpu_maps[c].depth.size())));
  }

  auto cpu_surface_sides = cpu::build_surface_sides(on_cpu, cpu_points, cpu_normals, options);
  const auto cuda_surface_sides =
      cuda::build_surface_sides(on_cuda, cuda_points, cuda_normals, options);
  for (std::size_t c = 0; c < raw.size(); ++c) {
    SCOPED_TRACE("surface_sides, cloud " + std::to_string(c));
    ASSERT_EQ(cpu_surface_sides[c].words.size(), cuda_surface_sides.boxes[c].words());
    ASSERT_TRUE(
        same_bytes(cpu_surface_sides[c].words,
                   host(on_cuda, cuda_surface_sides.words.data() + cuda_surface_sides.offset[c],
                        cpu_surface_sides[c].words.size())));
  }

  const auto cpu_closest = cpu::build_closest_grids(on_cpu, cpu_points, cpu_grids, options);
  const auto cuda_closest = cuda::build_closest_grids(on_cuda, cuda_points, cuda_grids, options);
  for (std::size_t c = 0; c < raw.size(); ++c) {
    SCOPED_TRACE("closest grid, cloud " + std::to_string(c));
    const auto& expected = *cpu_closest[c];
    const std::size_t first = cuda_closest.blocks.offset[c];
    ASSERT_EQ(expected.blocks.size(), cuda_closest.blocks.size(c));
    ASSERT_TRUE(same_bytes(
        expected.blocks, host(on_cuda, cuda_closest.block.data() + first, expected.blocks.size())));
    ASSERT_TRUE(same_bytes(
        expected.cell_start,
        host(on_cuda, cuda_closest.cell_start.data() + first * 513, expected.cell_start.size())));
    ASSERT_TRUE(
        same_bytes(expected.candidates,
                   host(on_cuda, cuda_closest.candidates.data() + cuda_closest.candidate_offset[c],
                        expected.candidates.size())));
  }

  const auto assembled =
      cuda::assemble(on_cuda, cuda_points, cuda_normals, cuda_features, cuda_wide, cuda_closest,
                     cuda_maps, cuda_surface_sides, options);
  auto expected_points = cpu_points;
  auto expected_normals = cpu_normals;
  auto expected_features = cpu_features;
  auto expected_closest = cpu_closest;
  const auto expected =
      cpu::assemble(on_cpu, expected_points, expected_normals, expected_features, cpu_wide,
                    expected_closest, cpu_maps, cpu_surface_sides, options);
  for (std::size_t c = 0; c < raw.size(); ++c) {
    SCOPED_TRACE("assembled, cloud " + std::to_string(c));
    ASSERT_EQ(cpu_closest[c]->candidates.size(), cuda_closest.size[c].candidates);
    // A cloud with a table of bricks keeps no other arrays of the grid.
    if (assembled[c]->summaries.nx > 0) {
      const cuda::CellSummaries& cells = assembled[c]->summaries;
      ASSERT_EQ(assembled[c]->view_on_device.closest.candidates.size, 0u);
      ASSERT_EQ(host(on_cuda, cells.run + cells.brick_runs(), 1)[0].y, cuda_closest.size[c].bricks);
    }
    ASSERT_TRUE(same_bytes(cpu_points[c].points, assembled[c]->copy_points()));
    ASSERT_TRUE(same_bytes(cpu_normals[c], assembled[c]->copy_normals()));
    ASSERT_TRUE(
        same_bytes(one_nan(cpu_features[c].values), one_nan(assembled[c]->copy_features())));
    const CloudView on_host = expected[c]->view(), &on_gpu = assembled[c]->view_on_device;
    ASSERT_EQ(on_host.wide_features == nullptr, on_gpu.wide_features == nullptr);
    if (on_host.wide_features) {
      const std::size_t rows = std::size_t(on_host.size) * cuda::row_stride(kFpfhSize);
      ASSERT_TRUE(
          same_bytes(expected[c]->wide_features.values,
                     cuda::tight_rows(host(on_cuda, on_gpu.wide_features, rows), kFpfhSize)));
      ASSERT_TRUE(same_bytes(expected[c]->wide_features.valid,
                             host(on_cuda, on_gpu.has_wide_feature, on_host.size)));
    }
    ASSERT_TRUE(
        same_bytes(expected[c]->normal_weight, host(on_cuda, on_gpu.normal_weight, on_gpu.size)));
    ASSERT_EQ(on_host.normal_weight_total, on_gpu.normal_weight_total);
    ASSERT_EQ(on_host.normal_weight_total, assembled[c]->normal_weight_total);
    ASSERT_EQ(on_host.visibility.count, on_gpu.visibility.count);
    ASSERT_EQ(on_host.visibility.step, on_gpu.visibility.step);
    ASSERT_TRUE(same_bytes(
        expected[c]->visibility.depth,
        host(on_cuda, on_gpu.visibility.depth, std::size_t(on_host.visibility.count) * kMapCells)));
    ASSERT_TRUE(same_bytes(expected[c]->visibility.viewpoints,
                           host(on_cuda, on_gpu.visibility.viewpoints, on_host.visibility.count)));
    ASSERT_EQ(expected[c]->statistics.points_without_normal,
              assembled[c]->statistics.points_without_normal);
    ASSERT_EQ(expected[c]->statistics.points_without_feature,
              assembled[c]->statistics.points_without_feature);
    // Look-ups in both hash tables agree, whatever the slots of their entries.
    const auto table = host(on_cuda, cuda_closest.table.data() + cuda_closest.table_offset[c],
                            cuda_closest.table_offset[c + 1] - cuda_closest.table_offset[c]);
    for (std::size_t b = 0; b < cpu_closest[c]->blocks.size(); b += 7) {
      ASSERT_EQ(find_cell(span_of(table), cell_key(cpu_closest[c]->blocks[b])), b);
      if (b > 70) break;
    }
  }
}

class PrepareOnCuda : public ::testing::Test {
 protected:
  void SetUp() override { GPUREG_GPU_OR_SKIP(); }
  const RawCloud& keep(std::vector<Vec3> points) {
    kept.push_back(std::make_unique<std::vector<Vec3>>(std::move(points)));
    raw.push_back(test::raw_cloud(*kept.back()));
    return raw.back();
  }
  std::mt19937 random{7};
  std::vector<std::unique_ptr<std::vector<Vec3>>> kept;
  std::vector<RawCloud> raw;
  PrepareSettings options;
};

TEST_F(PrepareOnCuda, RandomSheetsOfManySizes) {
  for (const std::size_t size : {20000u, 1u, 0u, 3u, 150000u, 33u, 4000u})
    keep(test::bumpy_sheet(random, size, 2.0f));
  expect_same_preparation(raw, options);
}

TEST_F(PrepareOnCuda, CubesFarFromTheOriginWithBadPoints) {
  for (const float shift : {0.0f, 10.0f, -10000.0f}) {
    auto points = test::cube(random, 5000, 1.5f);
    for (std::size_t k = 0; k < points.size(); ++k) {
      points[k].x += shift;
      if (k % 97 == 0) points[k].y = std::numeric_limits<float>::quiet_NaN();
      if (k % 89 == 0) points[k].z = std::numeric_limits<float>::infinity();
    }
    keep(std::move(points));
  }
  keep(std::vector<Vec3>(100, Vec3{1, 2, 3}));
  std::vector<Vec3> line;
  for (int k = 0; k < 500; ++k) line.push_back({0.01f * static_cast<float>(k), 0, 0});
  keep(std::move(line));
  keep(std::vector<Vec3>(10, Vec3{std::numeric_limits<float>::quiet_NaN(), 0, 0}));
  expect_same_preparation(raw, options);
}

TEST_F(PrepareOnCuda, PointsAsTheyAre) {
  keep(test::bumpy_sheet(random, 3000, 1.5f));
  keep(test::bumpy_sheet(random, 1, 1.5f));
  keep(test::cube(random, 2000, 2.0f));
  options.voxel_size = 0;
  expect_same_preparation(raw, options);
}

TEST_F(PrepareOnCuda, OtherRadii) {
  keep(test::bumpy_sheet(random, 60000, 3.0f));
  keep(test::cube(random, 5000, 1.5f));
  for (const float v : {0.03f, 0.1f, 0.7f}) {
    const auto scaled = resolve(RegistrationOptions{v}).prepare;
    expect_same_preparation(raw, scaled);
  }
  // lists of hundreds of candidates, blocks with thousands of points
  options.max_correspondence_distance = 0.4f;
  expect_same_preparation(raw, options);
}

TEST_F(PrepareOnCuda, GivenNormalsViewpointsAndFeatures) {
  const std::size_t size = 8000, dimension = 5;
  const auto points = test::bumpy_sheet(random, size, 2.0f);
  std::vector<Vec3> normals(size), viewpoints;
  std::vector<float> features(size * (dimension + 2));
  std::normal_distribution<float> normal;
  for (std::size_t k = 0; k < size; ++k)
    normals[k] = k % 50 == 0 ? Vec3{0, 0, 0} : test::random_unit(random);
  for (float& f : features) f = normal(random);
  features[3] = std::numeric_limits<float>::quiet_NaN();
  for (int k = 0; k < 20; ++k) viewpoints.push_back(test::random_unit(random) * 2.0f);
  RawCloud plain = test::raw_cloud(points), with_normals = plain, with_views = plain,
           with_features = plain;
  with_normals.normals = &normals[0].x;
  with_views.viewpoints = &viewpoints[0].x;
  with_views.viewpoint_count = viewpoints.size();
  with_features.features = features.data();
  with_features.feature_dimension = dimension;
  with_features.feature_stride = dimension + 2;
  expect_same_preparation({plain, with_normals, with_views, with_features}, options);
  // Normals and viewpoints: few that face away are flipped, many are not.
  RawCloud few = with_normals, many = with_normals;
  std::vector<Vec3> up(size);
  for (std::size_t k = 0; k < size; ++k)
    up[k] = {0, 0, k % 100 < 70 || points[k].x > -0.6f ? 1.0f : -1.0f};
  const Vec3 eye{0, 0, 5};
  few.normals = &up[0].x;
  few.viewpoints = many.viewpoints = &eye.x;
  few.viewpoint_count = many.viewpoint_count = 1;
  expect_same_preparation({few, with_normals, many, with_views}, options);
  options = resolve(RegistrationOptions{0.05f}).prepare;
  expect_same_preparation({plain, with_normals, with_views, with_features}, options);
  options.depth_maps = 64;
  options.wide_feature_radius = options.feature_radius;
  expect_same_preparation({with_views, with_features, with_features}, options);
}

TEST_F(PrepareOnCuda, WideFeaturesAndDepthMaps) {
  for (const std::size_t size : {20000u, 1u, 0u, 3u, 90000u})
    keep(test::bumpy_sheet(random, size, 2.0f));
  auto broken = test::cube(random, 5000, 1.5f);
  for (std::size_t k = 0; k < broken.size(); k += 7)
    broken[k].y = std::numeric_limits<float>::quiet_NaN();
  keep(std::move(broken));
  keep(std::vector<Vec3>(10, Vec3{std::numeric_limits<float>::quiet_NaN(), 0, 0}));
  std::vector<Vec3> viewpoints;
  for (int k = 0; k < 7; ++k) viewpoints.push_back(test::random_unit(random) * 3.0f);
  viewpoints.push_back((*kept[0])[5]);  // in the midst of the points, and on one of them
  for (std::size_t c = 0; c < raw.size(); c += 2) {
    raw[c].viewpoints = &viewpoints[0].x;
    raw[c].viewpoint_count = viewpoints.size() - c;
  }
  options = resolve(RegistrationOptions{0.05f}).prepare;
  for (const std::uint32_t maps : {1u, 3u, 10u}) {
    options.depth_maps = maps;
    expect_same_preparation(raw, options);
  }
  options.wide_feature_radius = 0;
  expect_same_preparation(raw, options);
  options.depth_maps = 0;
  options.wide_feature_radius = 0.4f;
  expect_same_preparation(raw, options);
}

// Thousands of points in one voxel, at and around the number from which on a thread block adds them
// up; their normals and features too, of more dimensions than the block has threads.
TEST_F(PrepareOnCuda, CrowdedVoxels) {
  const auto crowded = [&](std::size_t in_a_voxel, std::size_t others) {
    std::vector<Vec3> points = test::cube(random, others, 1.5f);
    for (std::size_t k = 0; k < in_a_voxel; ++k) {
      const Vec3 p = test::cube(random, 1, 0.02f)[0];
      points.push_back({p.x + 0.525f, p.y + 0.325f, p.z + 0.125f});
    }
    std::shuffle(points.begin(), points.end(), random);
    return points;
  };
  for (const std::size_t in_a_voxel : {511u, 512u, 513u, 768u, 50000u})
    keep(crowded(in_a_voxel, 3000));
  keep(std::vector<Vec3>(70000, Vec3{1, 2, 3}));
  options = resolve(RegistrationOptions{0.05f}).prepare;
  expect_same_preparation(raw, options);
  const std::size_t dimension = 300;
  std::vector<std::vector<Vec3>> normals;
  std::vector<std::vector<float>> features;
  std::normal_distribution<float> normal;
  for (RawCloud& cloud : raw) {
    normals.emplace_back(cloud.size);
    for (Vec3& n : normals.back())
      n = random() % 50 == 0 ? Vec3{0, 0, 0} : test::random_unit(random);
    features.emplace_back(cloud.size * dimension);
    for (float& f : features.back()) f = normal(random);
    cloud.normals = &normals.back()[0].x;
    cloud.features = features.back().data();
    cloud.feature_dimension = cloud.feature_stride = dimension;
  }
  expect_same_preparation(raw, options);
}

TEST_F(PrepareOnCuda, ErrorsAreTheCpus) {
  keep({{0, 0, 0}, {3e6f, 0, 0}});
  const auto message = [&](auto&& prepare) {
    try {
      prepare();
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  cpu::Exec on_cpu(1);
  cuda::Exec on_cuda(0);
  const auto expect_same = [&] {
    const auto expected = message([&] { pipeline::prepare(on_cpu, span_of(raw), options); });
    EXPECT_NE(expected, "no error");
    EXPECT_EQ(message([&] {
                on_cuda.begin();
                pipeline::prepare(on_cuda, span_of(raw), options);
              }),
              expected);
  };
  expect_same();
  raw.clear();
  keep(test::cube(random, 200000, 0.3f));
  options.voxel_size = 0;
  expect_same();
}

TEST_F(PrepareOnCuda, RedKitchenFragments) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "redkitchen/fragments");
  std::vector<PointCloud> clouds;
  for (int k = 0; std::filesystem::exists(folder + "/cloud_bin_" + std::to_string(k) + ".ply"); ++k)
    clouds.push_back(test::read_plain_ply(folder + "/cloud_bin_" + std::to_string(k) + ".ply"));
  ASSERT_EQ(clouds.size(), 20u);
  for (const PointCloud& cloud : clouds) {
    RawCloud one{};
    one.points = cloud.points[0].data();
    one.size = cloud.points.size();
    one.point_stride = 3;
    if (!cloud.normals.empty()) {
      one.normals = cloud.normals[0].data();
      one.normal_stride = 3;
    }
    raw.push_back(one);
  }
  expect_same_preparation(raw, options);
  expect_same_preparation(raw, resolve(RegistrationOptions{0.05f}).prepare);
}

TEST_F(PrepareOnCuda, FgrRangePairs) {
  GPUREG_DATA_FOLDER_OR_SKIP(folder, "fgr");
  std::vector<PointCloud> clouds;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".ply")
      clouds.push_back(test::read_plain_ply(entry.path().string()));
  ASSERT_GT(clouds.size(), 40u);
  for (const PointCloud& cloud : clouds) {
    RawCloud one{};
    one.points = cloud.points[0].data();
    one.size = cloud.points.size();
    one.point_stride = 3;
    raw.push_back(one);
  }
  expect_same_preparation(raw, options);
}

}  // namespace
}  // namespace gpureg
