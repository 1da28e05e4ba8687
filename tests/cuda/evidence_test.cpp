// SPDX-License-Identifier: BSD-3-Clause
// Registration by evidence on both backends, stage by stage: the same bits after each.
#include <thread>

#include "api/with_settings.hpp"
#include "cpu/common/stages.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/gpu.hpp"
#include "pipeline/align_by_compatibility.hpp"
#include "support/outcome_bytes.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using test::ByteWriter;
using test::host;
using test::same_bytes;

struct PairWithPrior {
  std::size_t source, target;
  std::vector<std::uint32_t> custom_source, custom_target;
  PriorTest prior{};
};

template <typename Mode>
std::vector<char> mode_bytes(const std::vector<Mode>& modes) {
  ByteWriter out;
  for (const Mode& m : modes) out.add(m.pose, m.seed, m.iterations);
  return out.all;
}

std::vector<char> evidence_bytes(const std::vector<MatchEvidence>& all) {
  ByteWriter out;
  for (const MatchEvidence& e : all) add(out, e);
  return out.all;
}

class EvidenceOnCuda : public ::testing::Test {
 protected:
  void SetUp() override { GPUREG_GPU_OR_SKIP(); }

  void keep(std::vector<Vec3> points) { kept.push_back(std::move(points)); }
  /// Three scans of a room from two sides, a sheet, clutter, and clouds without an alignment; the
  /// odd ones have viewpoints.
  void keep_scene() {
    for (int k = 0; k < 3; ++k) {
      std::vector<Vec3> points;
      for (const auto& p : test::scan_room(random))
        if (p.x() < 2.2f + 0.4f * static_cast<float>(k)) points.push_back({p.x(), p.y(), p.z()});
      keep(std::move(points));
    }
    keep(test::bumpy_sheet(random, 20000, 1.7f));
    keep(test::cube(random, 3000, 1.5f));
    keep({});
    keep({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    viewpoints = {{2.0f, 1.6f, 1.8f}, {1.0f, 1.9f, 1.0f}, {2.9f, 0.5f, 1.9f}};
  }
  void all_pairs() {
    for (std::size_t a = 0; a < kept.size(); ++a)
      for (std::size_t b = 0; b < kept.size(); ++b)
        if (a != b) pairs.push_back({a, b, {}, {}});
  }
  std::vector<RawCloud> raw() const {
    std::vector<RawCloud> out;
    for (const auto& points : kept) {
      out.push_back(test::raw_cloud(points));
      if (!viewpoints.empty() && out.size() % 2 == 1) {
        out.back().viewpoints = &viewpoints[0].x;
        out.back().viewpoint_count = viewpoints.size();
      }
    }
    return out;
  }
  void expect_same() { expect_same(raw()); }
  void expect_same(const std::vector<RawCloud>& clouds);

  std::mt19937 random{11};
  std::vector<std::vector<Vec3>> kept;
  std::vector<Vec3> viewpoints;
  std::vector<PairWithPrior> pairs;
  RegistrationSettings options = resolve(RegistrationOptions{0.05f});
};

/// Prepares the clouds and aligns the pairs on both backends; every output is compared.
void EvidenceOnCuda::expect_same(const std::vector<RawCloud>& clouds) {
  cpu::Exec on_cpu(std::max(2u, std::thread::hardware_concurrency()));
  cuda::Exec on_cuda(0);
  on_cuda.begin();
  const auto cpu_clouds = pipeline::prepare(on_cpu, span_of(clouds), options.prepare);
  const auto cuda_clouds = pipeline::prepare(on_cuda, span_of(clouds), options.prepare);
  std::vector<PairView> cpu_pairs, cuda_pairs;
  for (const PairWithPrior& w : pairs) {
    const auto custom = static_cast<std::uint32_t>(w.custom_source.size());
    cpu_pairs.push_back({cpu_clouds[w.source]->view(), cpu_clouds[w.target]->view(),
                         w.custom_source.data(), w.custom_target.data(), custom, w.prior});
    cuda_pairs.push_back({cuda_clouds[w.source]->view_on_device,
                          cuda_clouds[w.target]->view_on_device, w.custom_source.data(),
                          w.custom_target.data(), custom, w.prior});
  }
  const auto cpu_views = span_of(cpu_pairs), cuda_views = span_of(cuda_pairs);
  const std::size_t count = pairs.size();

  const auto matches = cpu::merge_matches(on_cpu, cpu_views, options);
  const auto cuda_matches = cuda::merge_matches(on_cuda, cuda_views, options);
  const auto match_count = host(on_cuda, cuda_matches.count.data(), count);
  const auto match_total = host(on_cuda, cuda_matches.total.data(), 2 * count);
  for (std::size_t p = 0; p < count; ++p) {
    SCOPED_TRACE("matches, pair " + std::to_string(p));
    const cpu::MatchSet& m = matches[p];
    ASSERT_EQ(m.size(), match_count[p]);
    const cuda::MatchSetView v = cuda_matches.view();
    const std::size_t at = cuda_matches.room.offset[p];
    const std::vector<float>* values[] = {&m.px, &m.py, &m.pz, &m.qx, &m.qy, &m.qz,
                                          &m.mx, &m.my, &m.mz, &m.nx, &m.ny, &m.nz};
    const float* columns[] = {v.px, v.py, v.pz, v.qx, v.qy, v.qz,
                              v.mx, v.my, v.mz, v.nx, v.ny, v.nz};
    ASSERT_TRUE(same_bytes(m.source, host(on_cuda, v.source + at, m.size())));
    ASSERT_TRUE(same_bytes(m.target, host(on_cuda, v.target + at, m.size())));
    for (int k = 0; k < 12; ++k)
      ASSERT_TRUE(same_bytes(*values[k], host(on_cuda, columns[k] + at, m.size())))
          << "column " << k;
    ASSERT_TRUE(same_bytes(m.source_weight, host(on_cuda, v.source_weight + at, m.size())));
    ASSERT_TRUE(same_bytes(m.target_weight, host(on_cuda, v.target_weight + at, m.size())));
    ASSERT_EQ(m.source_total, match_total[2 * p]);
    ASSERT_EQ(m.target_total, match_total[2 * p + 1]);
  }

  const auto seeds = cpu::choose_seeds(on_cpu, matches, options);
  const auto cuda_seeds = cuda::choose_seeds(on_cuda, cuda_matches, options);
  const auto seed_count = host(on_cuda, cuda_seeds.count.data(), count);
  for (std::size_t p = 0; p < count; ++p) {
    SCOPED_TRACE("seeds, pair " + std::to_string(p));
    ASSERT_EQ(seeds[p].size(), seed_count[p]);
    ASSERT_TRUE(same_bytes(
        seeds[p], host(on_cuda, cuda_seeds.match.data() + p * cuda_seeds.most, seeds[p].size())));
  }

  auto candidates = cpu::propose_poses(on_cpu, matches, seeds, options);
  auto cuda_candidates = cuda::propose_poses(on_cuda, cuda_matches, cuda_seeds, options);
  cpu::score_candidates(on_cpu, cpu_views, matches, candidates, options);
  cuda::score_candidates(on_cuda, cuda_views, cuda_matches, cuda_candidates, options);
  const auto candidate_count = host(on_cuda, cuda_candidates.count.data(), count);
  for (std::size_t p = 0; p < count; ++p) {
    SCOPED_TRACE("candidates, pair " + std::to_string(p));
    const std::size_t at = p * cuda_candidates.most, size = candidates[p].pose.size();
    ASSERT_EQ(size, candidate_count[p]);
    ASSERT_TRUE(
        same_bytes(candidates[p].seed, host(on_cuda, cuda_candidates.seed.data() + at, size)));
    ASSERT_TRUE(
        same_bytes(candidates[p].pose, host(on_cuda, cuda_candidates.pose.data() + at, size)));
    ASSERT_EQ(evidence_bytes(candidates[p].matches),
              evidence_bytes(host(on_cuda, cuda_candidates.matches.data() + at, size)));
    ASSERT_TRUE(same_bytes(candidates[p].coarse_score,
                           host(on_cuda, cuda_candidates.coarse_score.data() + at, size)));
  }

  auto modes = cpu::select_modes(on_cpu, candidates, first_selection(options.evidence));
  auto cuda_modes = cuda::select_modes(on_cuda, cuda_candidates, first_selection(options.evidence));
  const auto expect_same_modes = [&](const char* stage) {
    const auto mode_count = host(on_cuda, cuda_modes.count.data(), count);
    for (std::size_t p = 0; p < count; ++p) {
      SCOPED_TRACE(stage + std::string(", pair ") + std::to_string(p));
      ASSERT_EQ(modes[p].size(), mode_count[p]);
      ASSERT_EQ(
          mode_bytes(modes[p]),
          mode_bytes(host(on_cuda, cuda_modes.mode.data() + p * cuda_modes.most, mode_count[p])));
    }
  };
  ASSERT_NO_FATAL_FAILURE(expect_same_modes("selected modes"));
  cpu::refine_roughly(on_cpu, cpu_views, modes, options);
  cuda::refine_roughly(on_cuda, cuda_views, cuda_modes, options);
  ASSERT_NO_FATAL_FAILURE(expect_same_modes("roughly refined modes"));
  auto refined_once = cpu::candidates_from_modes(on_cpu, matches, modes, options);
  auto cuda_refined_once = cuda::candidates_from_modes(on_cuda, cuda_matches, cuda_modes, options);
  cpu::score_candidates(on_cpu, cpu_views, matches, refined_once, options);
  cuda::score_candidates(on_cuda, cuda_views, cuda_matches, cuda_refined_once, options);
  modes = cpu::select_modes(on_cpu, refined_once, second_selection(options.evidence));
  cuda_modes = cuda::select_modes(on_cuda, cuda_refined_once, second_selection(options.evidence));
  ASSERT_NO_FATAL_FAILURE(expect_same_modes("modes of the second refinement"));
  cpu::polish_modes(on_cpu, cpu_views, modes, options);
  cuda::polish_modes(on_cuda, cuda_views, cuda_modes, options);
  ASSERT_NO_FATAL_FAILURE(expect_same_modes("refined modes"));
  cpu::merge_modes(on_cpu, modes, options, 1.0f);
  cuda::merge_modes(on_cuda, cuda_modes, options, 1.0f);
  ASSERT_NO_FATAL_FAILURE(expect_same_modes("merged modes"));

  // Perturbed poses: the first mode of each pair is the origin, the others have left it or not.
  std::vector<PosesOfPair> perturbations(count);
  for (std::size_t p = 0; p < count; ++p) {
    ReturnTest& returned = perturbations[p].returned;
    returned.squared_distance = p % 3 == 0 ? 0.5 : p % 3 == 1 ? 0.02 : -1.0;
    for (int k = 0; k < 3; ++k) returned.mean[k] = 0.1 * k - 0.2;
    for (int k = 0; k < 6; ++k) returned.outer[k] = k == 0 || k == 3 || k == 5 ? 0.7 : 0.05 * k;
    if (modes[p].empty()) continue;
    returned.origin = modes[p][0].pose;
    for (std::size_t k = 0; k < limits::kMaxPerturbedPoses; ++k)
      perturbations[p].poses.push_back(modes[p][(k / 2) % modes[p].size()].pose);
  }
  auto perturbed = cpu::modes_from_poses(on_cpu, perturbations);
  auto cuda_perturbed = cuda::modes_from_poses(on_cuda, perturbations);
  cpu::drop_returned(on_cpu, perturbed, perturbations);
  cuda::drop_returned(on_cuda, cuda_perturbed, perturbations);
  const auto left = host(on_cuda, cuda_perturbed.count.data(), count);
  for (std::size_t p = 0; p < count; ++p) {
    ASSERT_EQ(perturbed[p].size(), left[p]) << "perturbed poses, pair " << p;
    ASSERT_EQ(
        mode_bytes(perturbed[p]),
        mode_bytes(host(on_cuda, cuda_perturbed.mode.data() + p * cuda_perturbed.most, left[p])));
  }

  std::vector<PairOutcome> outcomes(count), cuda_outcomes(count);
  cpu::verify_modes(on_cpu, cpu_views, matches, candidates, modes, options,
                    {outcomes.data(), count});
  cuda::verify_modes(on_cuda, cuda_views, cuda_matches, cuda_candidates, cuda_modes, options,
                     {cuda_outcomes.data(), count});
  for (std::size_t p = 0; p < count; ++p)
    ASSERT_EQ(test::bytes(outcomes[p]), test::bytes(cuda_outcomes[p])) << "outcome, pair " << p;
}

TEST_F(EvidenceOnCuda, Default) {
  keep_scene();
  all_pairs();
  expect_same();
}

TEST_F(EvidenceOnCuda, SmallSheets) {
  for (const std::size_t size : {2000u, 3000u}) {
    std::mt19937 same_shape(5);
    keep(test::bumpy_sheet(same_shape, size, 0.9f));
  }
  pairs = {{0, 1, {}, {}}, {1, 0, {}, {}}};
  options.compatibility.seeds = 100;
  options.compatibility.triangles = 200;
  options.evidence.sample = 64;
  options.evidence.modes = 4;
  expect_same();
}

TEST_F(EvidenceOnCuda, OtherSeedWithoutWideFeaturesOrMaps) {
  keep_scene();
  all_pairs();
  options.seed = 0x123456789abcdefull;
  options.prepare.wide_feature_radius = 0;
  options.prepare.depth_maps = 0;
  expect_same();
}

TEST_F(EvidenceOnCuda, MatchesAndSeedsOfOddNumbers) {
  keep_scene();
  pairs = {{0, 1, {}, {}}, {2, 0, {}, {}}, {6, 1, {}, {}}, {3, 5, {}, {}}, {4, 2, {}, {}}};
  for (const std::uint32_t most : {4u, 33u, 1025u, 65536u}) {
    options.compatibility.max_matches = most;
    options.compatibility.seeds = most == 4 ? 1 : most == 33 ? 8192 : 77;
    options.compatibility.max_members = most == 1025 ? 1024 : most == 33 ? 3 : 100;
    options.compatibility.triangles = most == 1025 ? 300 : most == 33 ? 1 : 40;
    options.compatibility.refits = most == 65536 ? 8 : 1;
    options.evidence.modes = most == 1025 ? 64 : 3;
    options.evidence.sample = most == 1025 ? 65536 : 64;
    SCOPED_TRACE(most);
    expect_same();
  }
}

TEST_F(EvidenceOnCuda, ManySeedsWithoutRefinement) {
  keep_scene();
  pairs = {{0, 1, {}, {}}, {3, 2, {}, {}}};
  options.compatibility.seeds = 8192;
  options.compatibility.max_turn = 2;
  options.evidence.modes = 64;
  options.evidence.mode_angle = 1;
  options.evidence.mode_distance = 0.02f;
  options.refine.max_iterations = 0;
  expect_same();
}

TEST_F(EvidenceOnCuda, ACloudWithItself) {
  keep_scene();
  pairs = {{0, 0, {}, {}}, {4, 4, {}, {}}};
  expect_same();
}

// Lists of hundreds of candidates do not fit the word of their cell.
TEST_F(EvidenceOnCuda, LongLists) {
  keep_scene();
  options.prepare.max_correspondence_distance = 0.4f;
  pairs = {{0, 1, {}, {}}, {3, 2, {}, {}}, {4, 0, {}, {}}};
  expect_same();
}

// A map with more candidates than 24 bits number, and a piece of it.
TEST_F(EvidenceOnCuda, AMapOfManyCandidates) {
  std::vector<Vec3> map = test::bumpy_sheet(random, 300'000, 22.0f), piece;
  for (const Vec3& p : map)
    if (std::fabs(p.x - 3) < 1.2f && std::fabs(p.y + 2) < 1.2f) piece.push_back(p);
  keep(std::move(map));
  keep(std::move(piece));
  options = resolve(RegistrationOptions{0.05f});
  options.prepare.voxel_size = 0;
  pairs = {{1, 0, {}, {}}};
  expect_same();
}

TEST_F(EvidenceOnCuda, Priors) {
  keep_scene();
  all_pairs();
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    // Between a permissive and a restrictive prior.
    PriorTest& prior = pairs[p].prior;
    prior.gravity = p % 3 != 0;
    prior.pose = p % 3 != 1;
    prior.swapped = p % 2 == 1;
    prior.moved_up = test::random_unit(random);
    prior.fixed_up = test::random_unit(random);
    prior.min_up_cosine = -0.9f + 0.3f * static_cast<float>(p % 6);
    prior.expected =
        to_rigid(Pose<double>{0.6, 0.8, 0, 0, 0.3, -0.2, 0.1 * static_cast<double>(p % 4)});
    prior.min_trace = -0.8f + 0.5f * static_cast<float>(p % 5);
    prior.max_squared_distance = 0.1f + static_cast<float>(p % 4);
  }
  expect_same();
}

TEST_F(EvidenceOnCuda, PointsWithoutNormals) {
  // Too far apart for any neighbours: no normals, no features, only given matches.
  std::vector<Vec3> sparse;
  for (int k = 0; k < 400; ++k) sparse.push_back(test::random_unit(random) * 20.0f);
  keep(sparse);
  keep(sparse);
  std::vector<std::uint32_t> same(300);
  for (std::uint32_t k = 0; k < 300; ++k) same[k] = k;
  pairs = {{0, 1, {}, {}}, {0, 1, same, same}};
  expect_same();
  options.compatibility.max_turn = 2;
  expect_same();
}

TEST_F(EvidenceOnCuda, GivenCorrespondences) {
  keep_scene();
  all_pairs();
  const auto clouds =
      pipeline::prepare(*std::make_unique<cpu::Exec>(2), span_of(raw()), options.prepare);
  std::vector<PairWithPrior> custom;
  for (std::size_t p = 0; p < 12; ++p) {
    custom.push_back(pairs[p]);
    const std::uint32_t n = clouds[pairs[p].source]->size, m = clouds[pairs[p].target]->size;
    if (n == 0 || m == 0) continue;
    // Some of them many times over.
    for (int k = 0; k < (p % 3 == 0 ? 3 : 15000); ++k) {
      const auto range = static_cast<std::uint32_t>(p % 3 == 1 ? 50 : 1 << 30);
      custom.back().custom_source.push_back(
          static_cast<std::uint32_t>(random() % std::min(n, range)));
      custom.back().custom_target.push_back(
          static_cast<std::uint32_t>(random() % std::min(m, range)));
    }
  }
  pairs = custom;
  expect_same();
}

TEST_F(EvidenceOnCuda, GivenFeatures) {
  keep_scene();
  std::normal_distribution<float> normal;
  for (const std::size_t dimension : {3u, 33u, 70u}) {
    std::vector<std::vector<float>> features;
    auto clouds = raw();
    for (RawCloud& cloud : clouds) {
      features.emplace_back(cloud.size * dimension);
      for (float& f : features.back())
        f = random() % 4 == 0 ? normal(random) : static_cast<float>(random() % 3);
      cloud.features = features.back().data();
      cloud.feature_dimension = dimension;
      cloud.feature_stride = dimension;
    }
    pairs = {{0, 1, {}, {}}, {4, 0, {}, {}}, {5, 0, {}, {}}, {6, 3, {}, {}}};
    SCOPED_TRACE(dimension);
    expect_same(clouds);
  }
}

TEST_F(EvidenceOnCuda, NothingButDegenerateClouds) {
  keep({});
  keep({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  keep(std::vector<Vec3>(100, Vec3{1, 2, 3}));
  std::vector<Vec3> line;
  for (int k = 0; k < 500; ++k) line.push_back({0.01f * static_cast<float>(k), 0, 0});
  keep(std::move(line));
  all_pairs();
  expect_same();
  pairs = {{0, 0, {}, {}}};
  expect_same();
}

}  // namespace
}  // namespace gpureg
