// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cpu/exec.hpp"
#include "cpu/products.hpp"

/// The stages of the pipeline on the CPU, each a free function without hidden state, each on a batch. The CUDA backend has the same
/// names. What one item does is written once, in src/algorithm.
namespace gpureg::cpu {

// Preparation, one entry per cloud.
std::vector<DownsampledCloud> downsample(Exec& exec, Span<const RawCloud> clouds, const PrepareOptions& options);
std::vector<Grid> build_grids(Exec& exec, const std::vector<DownsampledCloud>& clouds, const PrepareOptions& options);
std::vector<std::vector<Vec3>> estimate_normals(Exec& exec, const std::vector<DownsampledCloud>& clouds, const std::vector<Grid>& grids,
                                                const PrepareOptions& options);
std::vector<Features> compute_features(Exec& exec, const std::vector<DownsampledCloud>& clouds,
                                       const std::vector<std::vector<Vec3>>& normals, const std::vector<Grid>& grids,
                                       const PrepareOptions& options);
std::vector<ClosestGrid> build_closest_grids(Exec& exec, const std::vector<DownsampledCloud>& clouds, const std::vector<Grid>& grids,
                                             const PrepareOptions& options);
std::vector<std::shared_ptr<CpuCloud>> assemble(Exec& exec, std::vector<DownsampledCloud>& clouds, std::vector<std::vector<Vec3>>& normals,
                                                std::vector<Features>& features, std::vector<ClosestGrid>& closest,
                                                const PrepareOptions& options);

// Alignment, one entry per pair.
std::vector<Matches> match_features(Exec& exec, Span<const PairView> pairs, const HypothesisOptions& options);
/// Numbers of the quadruples that pass the polygon test, ascending.
std::vector<std::vector<std::uint32_t>> sample_quadruples(Exec& exec, const std::vector<Matches>& matches, const HypothesisOptions& options);
std::vector<Hypotheses> fit_hypotheses(Exec& exec, const std::vector<Matches>& matches,
                                       const std::vector<std::vector<std::uint32_t>>& quadruples, const HypothesisOptions& options);
std::vector<BestPose> score_hypotheses(Exec& exec, Span<const PairView> pairs, const std::vector<Hypotheses>& hypotheses,
                                       const ScoreOptions& options);
std::vector<BestPose> refine_poses(Exec& exec, Span<const PairView> pairs, const std::vector<BestPose>& best, const ScoreOptions& score,
                                   const RefineOptions& options);
std::vector<Judgement> judge_poses(Exec& exec, Span<const PairView> pairs, const std::vector<BestPose>& poses,
                                         const ScoreOptions& options);
void conclude(Exec& exec, Span<const PairView> pairs, const std::vector<Matches>& matches,
              const std::vector<std::vector<std::uint32_t>>& quadruples, const std::vector<Hypotheses>& hypotheses,
              const std::vector<BestPose>& poses, const std::vector<Judgement>& judgements, const RegistrationOptions& options,
              Span<PairOutcome> outcomes);

/// Nearest features of every query row: k indices per query in order of distance (squared_norm of the difference as a chain of fmaf
/// over the dimensions, then the lower index), kNoValue where fewer exist. Rows marked invalid neither ask nor answer.
struct FeatureRows {
  const float* values;
  const std::uint8_t* valid;
  std::uint32_t size, dimension;
};
void nearest_features(FeatureRows queries, FeatureRows rows, std::uint32_t k, std::size_t begin, std::size_t end, std::uint32_t* out);

/// Exact support of one pose: the per-pose loop that scoring, refinement and tests share.
Support measure_support(const CloudView& source, const CloudView& target, const Rigid& pose, const ScoreOptions& options);

}  // namespace gpureg::cpu
