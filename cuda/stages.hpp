// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "exec.hpp"
#include "products.hpp"

/// The stages of the pipeline on the GPU: the names of src/cpu, on batches that stay on the device. What one item does is written once,
/// in src/algorithm.
namespace gpureg::cuda {

// Preparation, one entry per cloud.
DownsampledClouds downsample(Exec& exec, Span<const RawCloud> clouds, const PrepareOptions& options);
Grids build_grids(Exec& exec, const DownsampledClouds& clouds, const PrepareOptions& options);
DeviceBuffer<Vec3> estimate_normals(Exec& exec, const DownsampledClouds& clouds, const Grids& grids, const PrepareOptions& options);
Features compute_features(Exec& exec, DownsampledClouds& clouds, const DeviceBuffer<Vec3>& normals, const Grids& grids,
                          const PrepareOptions& options);
ClosestGrids build_closest_grids(Exec& exec, const DownsampledClouds& clouds, const Grids& grids, const PrepareOptions& options);
std::vector<std::shared_ptr<CudaCloud>> assemble(Exec& exec, const DownsampledClouds& clouds, const DeviceBuffer<Vec3>& normals,
                                                 const Features& features, const ClosestGrids& closest, const PrepareOptions& options);

// Alignment, one entry per pair.
Matches match_features(Exec& exec, Span<const PairView> pairs, const HypothesisOptions& options);
Quadruples sample_quadruples(Exec& exec, const Matches& matches, const HypothesisOptions& options);
Hypotheses fit_hypotheses(Exec& exec, const Matches& matches, const Quadruples& quadruples, const HypothesisOptions& options);
DeviceBuffer<BestPose> score_hypotheses(Exec& exec, Span<const PairView> pairs, const Hypotheses& hypotheses, const ScoreOptions& options);
DeviceBuffer<BestPose> refine_poses(Exec& exec, Span<const PairView> pairs, const DeviceBuffer<BestPose>& best, const ScoreOptions& score,
                                    const RefineOptions& options);
DeviceBuffer<Judgement> judge_poses(Exec& exec, Span<const PairView> pairs, const DeviceBuffer<BestPose>& poses, const ScoreOptions& options);
void conclude(Exec& exec, Span<const PairView> pairs, const Matches& matches, const Quadruples& quadruples, const Hypotheses& hypotheses,
              const DeviceBuffer<BestPose>& poses, const DeviceBuffer<Judgement>& judgements, const RegistrationOptions& options,
              Span<PairOutcome> outcomes);

}  // namespace gpureg::cuda
