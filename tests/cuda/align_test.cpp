// SPDX-License-Identifier: BSD-3-Clause
// Alignment on both backends, stage by stage: the same bits after each.
#include "algorithm/fpfh.hpp"
#include "api/with_settings.hpp"
#include "cpu/common/stages.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/gpu.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg {
namespace {

using test::host;
using test::same_bytes;

bool same(const Support& a, const Support& b) {
  return a.inliers == b.inliers && a.residual == b.residual && a.hypothesis == b.hypothesis;
}

bool same(const Pose<double>& a, const Pose<double>& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

struct PairOfClouds {
  std::size_t source, target;
  std::vector<std::uint32_t> custom_source, custom_target;
};

/// Prepares the clouds and aligns the pairs on both backends; every output is compared.
void expect_same_alignment(const std::vector<RawCloud>& raw,
                           const std::vector<PairOfClouds>& wanted,
                           const RegistrationSettings& options) {
  cpu::Exec on_cpu(2);
  cuda::Exec on_cuda(0);
  on_cuda.begin();
  const auto cpu_clouds = pipeline::prepare(on_cpu, span_of(raw), options.prepare);
  const auto cuda_clouds = pipeline::prepare(on_cuda, span_of(raw), options.prepare);
  std::vector<PairView> cpu_pairs, cuda_pairs;
  for (const PairOfClouds& w : wanted) {
    const auto custom = static_cast<std::uint32_t>(w.custom_source.size());
    cpu_pairs.push_back({cpu_clouds[w.source]->view(), cpu_clouds[w.target]->view(),
                         w.custom_source.data(), w.custom_target.data(), custom});
    cuda_pairs.push_back({cuda_clouds[w.source]->view_on_device,
                          cuda_clouds[w.target]->view_on_device, w.custom_source.data(),
                          w.custom_target.data(), custom});
  }
  const auto cpu_views = span_of(cpu_pairs), cuda_views = span_of(cuda_pairs);
  const std::size_t count = wanted.size();

  const auto cpu_matches = cpu::match_features(on_cpu, cpu_views, options);
  const auto cuda_matches = cuda::match_features(on_cuda, cuda_views, options);
  const auto match_count = host(on_cuda, cuda_matches.count.data(), count);
  for (std::size_t p = 0; p < count; ++p) {
    SCOPED_TRACE("match, pair " + std::to_string(p));
    ASSERT_EQ(cpu_matches[p].pairs.size(), match_count[p]);
    ASSERT_TRUE(same_bytes(
        cpu_matches[p].pairs,
        host(on_cuda, cuda_matches.pairs.data() + cuda_matches.room.offset[p], match_count[p])));
  }
  const auto cpu_quadruples = cpu::sample_quadruples(on_cpu, cpu_matches, options);
  const auto cuda_samples = cuda::sample_quadruples(on_cuda, cuda_matches, options);
  const auto cuda_quadruples =
      cuda::survivors_of(on_cuda, cuda_samples, {0, cuda_samples.survivors.size()});
  for (std::size_t p = 0; p < count; ++p) {
    SCOPED_TRACE("sample, pair " + std::to_string(p));
    ASSERT_TRUE(
        same_bytes(cpu_quadruples[p],
                   host(on_cuda, cuda_quadruples.id.data() + cuda_quadruples.segments.offset[p],
                        cuda_quadruples.segments.size(p))));
  }
  const auto cpu_hypotheses = cpu::fit_hypotheses(on_cpu, cpu_matches, cpu_quadruples, options);
  const auto cuda_hypotheses =
      cuda::fit_hypotheses(on_cuda, cuda_matches, cuda_quadruples, options);
  const auto valid_count = host(on_cuda, cuda_hypotheses.count.data(), count);
  for (std::size_t p = 0; p < count; ++p) {
    SCOPED_TRACE("fit, pair " + std::to_string(p));
    const std::size_t begin = cuda_quadruples.segments.offset[p],
                      size = cuda_quadruples.segments.size(p);
    const auto poses = host(on_cuda, cuda_hypotheses.pose.data() + begin, size);
    const auto valid = host(on_cuda, cuda_hypotheses.valid.data() + begin, size);
    std::vector<Pose<float>> kept;
    for (std::size_t k = 0; k < size; ++k)
      if (valid[k]) kept.push_back(poses[k]);
    ASSERT_TRUE(same_bytes(cpu_hypotheses[p].pose, kept));
    ASSERT_EQ(kept.size(), valid_count[p]);
  }
  const auto cpu_best = cpu::score_hypotheses(on_cpu, cpu_views, cpu_hypotheses, options);
  const auto cuda_best = cuda::score_hypotheses(on_cuda, cuda_views, cuda_hypotheses, options);
  const auto cpu_refined = cpu::refine_poses(on_cpu, cpu_views, cpu_best, options);
  const auto cuda_refined = cuda::refine_poses(on_cuda, cuda_views, cuda_best, options);
  const auto cpu_verified = cpu::verify_poses(on_cpu, cpu_views, cpu_refined, options);
  const auto cuda_verified = cuda::verify_poses(on_cuda, cuda_views, cuda_refined, options);
  const auto best = host(on_cuda, cuda_best.data(), count),
             refined = host(on_cuda, cuda_refined.data(), count);
  const auto verified = host(on_cuda, cuda_verified.data(), count);
  // Runs of pairs give what the whole batch gives.
  for (const pipeline::Run run : {pipeline::Run{0, count / 3}, pipeline::Run{count / 3, count}}) {
    if (run.size() == 0) continue;
    const auto part = cuda::survivors_of(on_cuda, cuda_samples, run);
    const auto hypotheses = cuda::fit_hypotheses(on_cuda, cuda_matches, part, options);
    const auto part_best =
        host(on_cuda,
             cuda::score_hypotheses(on_cuda, {cuda_pairs.data() + run.begin, run.size()},
                                    hypotheses, options)
                 .data(),
             run.size());
    const auto& whole = cuda_quadruples.segments;
    const std::size_t begin = whole.offset[run.begin], size = part.segments.total();
    ASSERT_EQ(whole.offset[run.end] - begin, size);
    ASSERT_TRUE(same_bytes(host(on_cuda, cuda_quadruples.id.data() + begin, size),
                           host(on_cuda, part.id.data(), size)));
    ASSERT_TRUE(same_bytes(host(on_cuda, cuda_hypotheses.pose.data() + begin, size),
                           host(on_cuda, hypotheses.pose.data(), size)));
    for (std::size_t p = 0; p < run.size(); ++p) {
      const auto& expected = best[run.begin + p];
      ASSERT_EQ(expected.found, part_best[p].found);
      ASSERT_TRUE(same(expected.support, part_best[p].support)) << "pair " << run.begin + p;
      ASSERT_TRUE(same(expected.pose, part_best[p].pose));
    }
  }
  for (std::size_t p = 0; p < count; ++p) {
    SCOPED_TRACE("score to verify, pair " + std::to_string(p));
    ASSERT_EQ(cpu_best[p].found, best[p].found != 0);
    if (!cpu_best[p].found) continue;
    ASSERT_TRUE(same(cpu_best[p].support, best[p].support))
        << cpu_best[p].support.inliers << " and " << best[p].support.inliers << ", hypotheses "
        << cpu_best[p].support.hypothesis << " and " << best[p].support.hypothesis;
    ASSERT_TRUE(same(cpu_best[p].pose, best[p].pose));
    ASSERT_TRUE(same(cpu_refined[p].support, refined[p].support));
    ASSERT_TRUE(same(cpu_refined[p].pose, refined[p].pose));
    ASSERT_EQ(cpu_refined[p].iterations, refined[p].iterations);
    ASSERT_TRUE(same(cpu_verified[p].support, verified[p].support));
    ASSERT_EQ(std::memcmp(&cpu_verified[p].source, &verified[p].source, sizeof(Moments)), 0);
    ASSERT_EQ(std::memcmp(&cpu_verified[p].target, &verified[p].target, sizeof(Moments)), 0);
  }
}

class AlignOnCuda : public ::testing::Test {
 protected:
  void SetUp() override {
    GPUREG_GPU_OR_SKIP();
    // Samplings of one sheet, of another, something else, and what has no alignment.
    for (int k = 0; k < 3; ++k) keep(sheet(5, 30000));
    keep(sheet(6, 20000));
    keep(test::cube(random, 3000, 1.5f));
    keep({});
    keep({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    for (std::size_t a = 0; a < kept.size(); ++a)
      for (std::size_t b = 0; b < kept.size(); ++b)
        if (a != b) pairs.push_back({a, b, {}, {}});
    options.quadruples.count = 100'000;
  }
  std::vector<Vec3> sheet(unsigned shape, std::size_t size) {
    // The shape is drawn first: samplings differ in their points only.
    std::mt19937 same_shape(shape);
    std::vector<Vec3> all = test::bumpy_sheet(same_shape, 90000, 1.7f);
    std::shuffle(all.begin(), all.end(), random);
    all.resize(size);
    return all;
  }
  void keep(std::vector<Vec3> points) { kept.push_back(std::move(points)); }
  std::vector<RawCloud> raw() const {
    std::vector<RawCloud> out;
    for (const auto& points : kept) out.push_back(test::raw_cloud(points));
    return out;
  }
  std::mt19937 random{3};
  std::vector<std::vector<Vec3>> kept;
  std::vector<PairOfClouds> pairs;
  RegistrationSettings options;
};

TEST_F(AlignOnCuda, Default) { expect_same_alignment(raw(), pairs, options); }

TEST_F(AlignOnCuda, Paper) {
  options = resolve(RegistrationOptions::loopsmart());
  options.quadruples.count = 300'000;
  expect_same_alignment(raw(), pairs, options);
}

TEST_F(AlignOnCuda, MutualMatches) {
  options.quadruples.mutual = true;
  expect_same_alignment(raw(), pairs, options);
}

TEST_F(AlignOnCuda, SeveralNeighbors) {
  for (const std::uint32_t k : {2u, 5u, 16u}) {
    options.quadruples.neighbors = k;
    options.seed = 1000 + k;
    expect_same_alignment(raw(), pairs, options);
  }
}

TEST_F(AlignOnCuda, ShorterDistanceWithoutNormals) {
  options.prepare.max_correspondence_distance = 0.05f;
  options.quadruples.max_normal_angle = 180;
  options.prepare.max_correspondence_distance = 0.06f;
  expect_same_alignment(raw(), pairs, options);
}

TEST_F(AlignOnCuda, OddHypothesisCountsAndSurvivorLimit) {
  for (const std::uint32_t count : {1u, 33u, 32768u, 65537u}) {
    options.quadruples.count = count;
    expect_same_alignment(raw(), pairs, options);
  }
  options.quadruples.count = 200'000;
  options.quadruples.max_survivors = 37;
  expect_same_alignment(raw(), pairs, options);
}

TEST_F(AlignOnCuda, GivenCorrespondences) {
  const auto clouds =
      pipeline::prepare(*std::make_unique<cpu::Exec>(2), span_of(raw()), options.prepare);
  std::vector<PairOfClouds> custom;
  for (std::size_t p = 0; p < 12; ++p) {
    custom.push_back(pairs[p]);
    const std::uint32_t n = clouds[pairs[p].source]->size, m = clouds[pairs[p].target]->size;
    if (n == 0 || m == 0) continue;
    for (int k = 0; k < (p % 3 == 0 ? 3 : 5000); ++k) {
      custom.back().custom_source.push_back(static_cast<std::uint32_t>(random() % n));
      custom.back().custom_target.push_back(static_cast<std::uint32_t>(random() % m));
    }
  }
  expect_same_alignment(raw(), custom, options);
}

// The feature search bounds distances before it measures them: dimensions and magnitudes where the
// bounds are loose, tight, or mean nothing.
TEST_F(AlignOnCuda, GivenFeatures) {
  std::normal_distribution<float> normal;
  options.quadruples.count = 5'000;
  for (const std::size_t dimension : {1u, 3u, 16u, 32u, 33u, 40u, 64u, 65u, 130u})
    for (const float scale : {1.0f, 1e-12f, 3e18f}) {
      std::vector<std::vector<float>> features;
      auto clouds = raw();
      for (RawCloud& cloud : clouds) {
        features.emplace_back(cloud.size * dimension);
        // Many equal values, so that distances tie.
        for (float& f : features.back())
          f = scale * (random() % 4 == 0 ? normal(random) : static_cast<float>(random() % 3));
        cloud.features = features.back().data();
        cloud.feature_dimension = dimension;
        cloud.feature_stride = dimension;
      }
      options.prepare.voxel_size = 0.12f;
      SCOPED_TRACE("dimension " + std::to_string(dimension) + ", scale " + std::to_string(scale));
      expect_same_alignment(clouds, {{0, 1, {}, {}}, {4, 0, {}, {}}, {5, 0, {}, {}}}, options);
      options.quadruples.mutual = !options.quadruples.mutual;
    }
}

// Computed and given features have bounds of different kinds, but may have equal dimensions.
TEST_F(AlignOnCuda, GivenFeaturesAgainstComputedOnes) {
  std::normal_distribution<float> normal(20, 15);
  std::vector<std::vector<float>> features;
  auto clouds = raw();
  for (const std::size_t c : {std::size_t(0), std::size_t(4)}) {
    features.emplace_back(clouds[c].size * kFpfhSize);
    for (float& f : features.back()) f = normal(random);
    clouds[c].features = features.back().data();
    clouds[c].feature_dimension = clouds[c].feature_stride = kFpfhSize;
  }
  options.prepare.voxel_size = 0.12f;
  options.quadruples.count = 5'000;
  expect_same_alignment(clouds, {{0, 1, {}, {}}, {1, 4, {}, {}}, {0, 4, {}, {}}, {1, 2, {}, {}}},
                        options);
}

// Thousands of equal features: the first one is the result.
TEST_F(AlignOnCuda, WallsWithoutNoise) {
  std::vector<std::vector<Vec3>> rooms(2);
  std::uniform_real_distribution<float> along(0, 3);
  for (auto& room : rooms)
    for (int k = 0; k < 40'000; ++k) {
      const float a = along(random), b = along(random);
      room.push_back(k % 3 == 0 ? Vec3{a, b, 0} : k % 3 == 1 ? Vec3{a, 0, b} : Vec3{0, a, b});
    }
  kept = rooms;
  pairs = {{0, 1, {}, {}}, {1, 0, {}, {}}, {0, 0, {}, {}}};
  options.quadruples.count = 5'000;
  for (const bool mutual : {false, true}) {
    options.quadruples.mutual = mutual;
    expect_same_alignment(raw(), pairs, options);
  }
}

TEST_F(AlignOnCuda, MoreMatchesThanSharedMemoryHolds) {
  std::vector<std::vector<Vec3>> dense{test::cube(random, 60000, 2.2f),
                                       test::bumpy_sheet(random, 400000, 6.0f)};
  kept = dense;
  pairs = {{0, 1, {}, {}}, {1, 0, {}, {}}};
  expect_same_alignment(raw(), pairs, options);
}

// Lists of hundreds of candidates do not fit the word of their cell.
TEST_F(AlignOnCuda, LongLists) {
  options.prepare.max_correspondence_distance = 0.4f;
  options.quadruples.count = 20'000;
  pairs = {{0, 1, {}, {}}, {3, 0, {}, {}}, {4, 0, {}, {}}};
  expect_same_alignment(raw(), pairs, options);
}

// A map with more candidates than 24 bits number, and a piece of it.
TEST_F(AlignOnCuda, AMapOfManyCandidates) {
  std::vector<Vec3> map = test::bumpy_sheet(random, 300'000, 22.0f), piece;
  for (const Vec3& p : map)
    if (std::fabs(p.x - 3) < 1.2f && std::fabs(p.y + 2) < 1.2f) piece.push_back(p);
  kept = {map, piece};
  options = resolve(RegistrationOptions{0.05f});
  options.prepare.voxel_size = 0;
  options.quadruples.count = 50'000;
  cpu::Exec exec(2);
  ASSERT_GT(test::prepare_one(exec, raw()[0], options.prepare)->closest->candidates.size(),
            std::size_t(1) << 24);
  expect_same_alignment(raw(), {{1, 0, {}, {}}}, options);
}

TEST_F(AlignOnCuda, StrayPointsMakeTheCloudTooWideForATable) {
  for (auto& points : kept)
    if (points.size() > 1000) points.push_back({9000, 9000, 9000});
  options.quadruples.count = 20'000;
  expect_same_alignment(raw(), pairs, options);
}

TEST_F(AlignOnCuda, ACloudWithItself) {
  pairs = {{0, 0, {}, {}}};
  options.quadruples.count = 50'000;
  options.quadruples.max_survivors = 5'000;
  expect_same_alignment(raw(), pairs, options);
}

}  // namespace
}  // namespace gpureg
