// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/mode_selection.hpp"
#include "confidence/degeneracy_search.hpp"
#include "cuda/common/stage_data.hpp"
#include "cuda/device/exec.hpp"

/// The stages of the pipeline on the GPU: the names of src/cpu, on batches that stay on the device.
/// The computation of one element is in src/algorithm.
namespace gpureg::cuda {

// Preparation, one entry per cloud.
DownsampledClouds downsample(Exec& exec, Span<const RawCloud> clouds,
                             const PrepareSettings& options);
Grids build_grids(Exec& exec, const DownsampledClouds& clouds, const PrepareSettings& options);
DeviceBuffer<Vec3> estimate_normals(Exec& exec, const DownsampledClouds& clouds, const Grids& grids,
                                    float radius);
Features compute_features(Exec& exec, DownsampledClouds& clouds, const DeviceBuffer<Vec3>& normals,
                          const Grids& grids, const PrepareSettings& options);
/// FPFH of the wide radius, from normals of a wide radius; empty without one.
Features compute_wide_features(Exec& exec, const DownsampledClouds& clouds, const Grids& grids,
                               const PrepareSettings& options);
ClosestGrids build_closest_grids(Exec& exec, const DownsampledClouds& clouds, const Grids& grids,
                                 const PrepareSettings& options);
DepthMaps build_depth_maps(Exec& exec, Span<const RawCloud> raw, const DownsampledClouds& clouds,
                           const PrepareSettings& options);
SurfaceSides build_surface_sides(Exec& exec, const DownsampledClouds& clouds,
                                 const DeviceBuffer<Vec3>& normals, const PrepareSettings& options);
std::vector<std::shared_ptr<CudaCloud>> assemble(
    Exec& exec, const DownsampledClouds& clouds, const DeviceBuffer<Vec3>& normals,
    const Features& features, const Features& wide_features, const ClosestGrids& closest,
    const DepthMaps& depth_maps, const SurfaceSides& surface_sides, const PrepareSettings& options);

// Alignment, one entry per pair.
Matches match_features(Exec& exec, Span<const PairView> pairs, const RegistrationSettings& options);
Samples sample_quadruples(Exec& exec, const Matches& matches, const RegistrationSettings& options);
/// As many pairs each as the memory of their survivors allows.
std::vector<pipeline::Run> runs_of(Exec& exec, const Samples& samples);
Quadruples survivors_of(Exec& exec, const Samples& samples, pipeline::Run pairs);
Hypotheses fit_hypotheses(Exec& exec, const Matches& matches, const Quadruples& quadruples,
                          const RegistrationSettings& options);
DeviceBuffer<BestPose> score_hypotheses(Exec& exec, Span<const PairView> pairs,
                                        const Hypotheses& hypotheses,
                                        const RegistrationSettings& options);
DeviceBuffer<BestPose> refine_poses(Exec& exec, Span<const PairView> pairs,
                                    const DeviceBuffer<BestPose>& best,
                                    const RegistrationSettings& options);
DeviceBuffer<Verification> verify_poses(Exec& exec, Span<const PairView> pairs,
                                        const DeviceBuffer<BestPose>& poses,
                                        const RegistrationSettings& options);

// Alignment by compatibility and evidence, one entry per pair.
/// Merges the nearest features in both directions and of both radii; keeps at most max_matches.
MatchSets merge_matches(Exec& exec, Span<const PairView> pairs,
                        const RegistrationSettings& options);
/// Matches with the most compatible others, local maxima first.
Seeds choose_seeds(Exec& exec, const MatchSets& matches, const RegistrationSettings& options);
/// A pose for each seed with a determinate neighbourhood, in the order of the seeds, and the
/// matches that it aligns.
Candidates propose_poses(Exec& exec, const MatchSets& matches, const Seeds& seeds,
                         const RegistrationSettings& options);
/// Adds the coarse_score, from a sample of the points.
void score_candidates(Exec& exec, Span<const PairView> pairs, const MatchSets& matches,
                      Candidates& candidates, const RegistrationSettings& options);
/// Distinct poses with the highest coarse_score.
Modes select_modes(Exec& exec, const Candidates& candidates, const ModeSelection& selection);
/// Modes as candidates, with the matches that they align: to score and select them again.
Candidates candidates_from_modes(Exec& exec, const MatchSets& matches, const Modes& modes,
                                 const RegistrationSettings& options);
/// The first refinement: on a sample, with the wide kernel.
void refine_roughly(Exec& exec, Span<const PairView> pairs, Modes& modes,
                    const RegistrationSettings& options);
/// The second refinement: with a narrower kernel, on a sample and then on all points.
void polish_modes(Exec& exec, Span<const PairView> pairs, Modes& modes,
                  const RegistrationSettings& options);
/// Merges modes that refinement moved to the same pose, within a share of the limits of a mode;
/// keeps the one with the highest coarse_score.
void merge_modes(Exec& exec, Modes& modes, const RegistrationSettings& options, float share);
/// Drops perturbed poses that have returned to their origin mode or to an earlier one of them.
void drop_returned(Exec& exec, Modes& perturbed, const std::vector<PosesOfPair>& perturbations);
/// Perturbed poses of the most likely mode of each pair; on the host.
inline std::vector<PosesOfPair> search_degeneracies(Exec& exec, Span<const PairInput> inputs,
                                                    Span<const PairOutcome> outcomes,
                                                    const RegistrationSettings& options) {
  return confidence::search_degeneracies(inputs, outcomes, options, exec.host_threads());
}
Modes modes_from_poses(Exec& exec, const std::vector<PosesOfPair>& poses);
/// For poses that were not proposed by the stages before.
Candidates no_candidates(Exec& exec, Span<const PairView> pairs);
/// All evidence, from all points.
void verify_modes(Exec& exec, Span<const PairView> pairs, const MatchSets& matches,
                  const Candidates& candidates, const Modes& modes,
                  const RegistrationSettings& options, Span<PairOutcome> outcomes);

void conclude(Exec& exec, Span<const PairView> pairs, const Matches& matches,
              const Quadruples& quadruples, const Hypotheses& hypotheses,
              const DeviceBuffer<BestPose>& poses, const DeviceBuffer<Verification>& verifications,
              const RegistrationSettings& options, Span<PairOutcome> outcomes);

}  // namespace gpureg::cuda
