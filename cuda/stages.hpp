// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "exec.hpp"
#include "products.hpp"

/// The stages of the pipeline on the GPU: the names of src/cpu, on batches that stay on the device.
/// What one item does is written once, in src/algorithm.
namespace gpureg::cuda {

// Preparation, one entry per cloud.
DownsampledClouds downsample(Exec& exec, Span<const RawCloud> clouds,
                             const PrepareOptions& options);
Grids build_grids(Exec& exec, const DownsampledClouds& clouds, const PrepareOptions& options);
DeviceBuffer<Vec3> estimate_normals(Exec& exec, const DownsampledClouds& clouds, const Grids& grids,
                                    float radius);
Features compute_features(Exec& exec, DownsampledClouds& clouds, const DeviceBuffer<Vec3>& normals,
                          const Grids& grids, const PrepareOptions& options);
/// FPFH of the second radius, of normals of a second radius, too; empty where there is none.
Features compute_wide_features(Exec& exec, const DownsampledClouds& clouds, const Grids& grids,
                               const PrepareOptions& options);
ClosestGrids build_closest_grids(Exec& exec, const DownsampledClouds& clouds, const Grids& grids,
                                 const PrepareOptions& options);
DepthMaps build_depth_maps(Exec& exec, Span<const RawCloud> raw, const DownsampledClouds& clouds,
                           const PrepareOptions& options);
Fronts build_fronts(Exec& exec, const DownsampledClouds& clouds, const DeviceBuffer<Vec3>& normals,
                    const PrepareOptions& options);
std::vector<std::shared_ptr<CudaCloud>> assemble(
    Exec& exec, const DownsampledClouds& clouds, const DeviceBuffer<Vec3>& normals,
    const Features& features, const Features& wide_features, const ClosestGrids& closest,
    const DepthMaps& depth_maps, const Fronts& fronts, const PrepareOptions& options);

// Alignment, one entry per pair.
Matches match_features(Exec& exec, Span<const PairView> pairs, const HypothesisOptions& options);
Quadruples sample_quadruples(Exec& exec, const Matches& matches, const HypothesisOptions& options);
Hypotheses fit_hypotheses(Exec& exec, const Matches& matches, const Quadruples& quadruples,
                          const HypothesisOptions& options);
DeviceBuffer<BestPose> score_hypotheses(Exec& exec, Span<const PairView> pairs,
                                        const Hypotheses& hypotheses, const ScoreOptions& options);
DeviceBuffer<BestPose> refine_poses(Exec& exec, Span<const PairView> pairs,
                                    const DeviceBuffer<BestPose>& best, const ScoreOptions& score,
                                    const RefineOptions& options);
DeviceBuffer<Judgement> judge_poses(Exec& exec, Span<const PairView> pairs,
                                    const DeviceBuffer<BestPose>& poses,
                                    const ScoreOptions& options);

// Alignment by compatibility and evidence, one entry per pair.
/// Nearest features in both directions and of both radii, united; at most max_matches of them.
MatchSets unite_matches(Exec& exec, Span<const PairView> pairs, const HypothesisOptions& hypothesis,
                        const CompatibilityOptions& options);
/// Matches with the most compatible others, local maxima first.
Seeds choose_seeds(Exec& exec, const MatchSets& matches, const CompatibilityOptions& options);
/// A pose for each seed whose neighbourhood determines one, in the order of the seeds, and the
/// matches that it brings together.
Candidates propose_poses(Exec& exec, const MatchSets& matches, const Seeds& seeds,
                         const HypothesisOptions& hypothesis, const CompatibilityOptions& options);
/// Adds the promise: evidence from a sample of the points.
void weigh_candidates(Exec& exec, Span<const PairView> pairs, const MatchSets& matches,
                      Candidates& candidates, const EvidenceOptions& options,
                      const ScoreOptions& score);
/// The most promising distinct poses.
Modes select_modes(Exec& exec, const Candidates& candidates, const EvidenceOptions& options);
void refine_modes(Exec& exec, Span<const PairView> pairs, Modes& modes,
                  const EvidenceOptions& evidence, const RefineOptions& options);
/// Modes that have met: the most promising of them stays.
void merge_modes(Exec& exec, Modes& modes, const EvidenceOptions& evidence);
Modes modes_of(Exec& exec, const std::vector<FurtherPoses>& poses);
/// All evidence, from all points.
void weigh_modes(Exec& exec, Span<const PairView> pairs, const MatchSets& matches,
                 const Candidates& candidates, const Modes& modes,
                 const RegistrationOptions& options, Span<PairOutcome> outcomes);

void conclude(Exec& exec, Span<const PairView> pairs, const Matches& matches,
              const Quadruples& quadruples, const Hypotheses& hypotheses,
              const DeviceBuffer<BestPose>& poses, const DeviceBuffer<Judgement>& judgements,
              const RegistrationOptions& options, Span<PairOutcome> outcomes);

}  // namespace gpureg::cuda
