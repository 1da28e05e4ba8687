// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/mode_selection.hpp"
#include "confidence/degeneracy_search.hpp"
#include "cpu/common/exec.hpp"
#include "cpu/common/stage_data.hpp"
#include "pipeline/runs.hpp"

/// The stages of the pipeline on the CPU: free functions without state of their own, each on a
/// batch. The CUDA backend has the same names. The computation of one element is in src/algorithm.
namespace gpureg::cpu {

// Preparation, one entry per cloud.
std::vector<DownsampledCloud> downsample(Exec& exec, Span<const RawCloud> clouds,
                                         const PrepareSettings& options);
std::vector<Grid> build_grids(Exec& exec, const std::vector<DownsampledCloud>& clouds,
                              const PrepareSettings& options);
std::vector<std::vector<Vec3>> estimate_normals(Exec& exec,
                                                const std::vector<DownsampledCloud>& clouds,
                                                const std::vector<Grid>& grids, float radius);
std::vector<Features> compute_features(Exec& exec, const std::vector<DownsampledCloud>& clouds,
                                       const std::vector<std::vector<Vec3>>& normals,
                                       const std::vector<Grid>& grids,
                                       const PrepareSettings& options);
std::vector<std::shared_ptr<const ClosestGrid>> build_closest_grids(
    Exec& exec, const std::vector<DownsampledCloud>& clouds, const std::vector<Grid>& grids,
    const PrepareSettings& options);
/// FPFH of the wide radius, from normals of a wide radius; empty without one.
std::vector<Features> compute_wide_features(Exec& exec, const std::vector<DownsampledCloud>& clouds,
                                            const std::vector<Grid>& grids,
                                            const PrepareSettings& options);
std::vector<Visibility> build_depth_maps(Exec& exec, Span<const RawCloud> raw,
                                         const std::vector<DownsampledCloud>& clouds,
                                         const PrepareSettings& options);
std::vector<SurfaceSides> build_surface_sides(Exec& exec,
                                              const std::vector<DownsampledCloud>& clouds,
                                              const std::vector<std::vector<Vec3>>& normals,
                                              const PrepareSettings& options);
std::vector<std::shared_ptr<CpuCloud>> assemble(
    Exec& exec, std::vector<DownsampledCloud>& clouds, std::vector<std::vector<Vec3>>& normals,
    std::vector<Features>& features, std::vector<Features>& wide_features,
    std::vector<std::shared_ptr<const ClosestGrid>>& closest, std::vector<Visibility>& visibility,
    std::vector<SurfaceSides>& surface_sides, const PrepareSettings& options);

// Alignment, one entry per pair.
std::vector<Matches> match_features(Exec& exec, Span<const PairView> pairs,
                                    const RegistrationSettings& options);
/// Indices of the quadruples that pass the polygon test, ascending.
std::vector<std::vector<std::uint32_t>> sample_quadruples(Exec& exec,
                                                          const std::vector<Matches>& matches,
                                                          const RegistrationSettings& options);
/// All pairs are one run: the engine takes few at a time.
inline std::vector<pipeline::Run> runs_of(Exec&,
                                          const std::vector<std::vector<std::uint32_t>>& samples) {
  return {{0, samples.size()}};
}
inline const std::vector<std::vector<std::uint32_t>>& survivors_of(
    Exec&, const std::vector<std::vector<std::uint32_t>>& samples, pipeline::Run) {
  return samples;
}
std::vector<Hypotheses> fit_hypotheses(Exec& exec, const std::vector<Matches>& matches,
                                       const std::vector<std::vector<std::uint32_t>>& quadruples,
                                       const RegistrationSettings& options);
std::vector<BestPose> score_hypotheses(Exec& exec, Span<const PairView> pairs,
                                       const std::vector<Hypotheses>& hypotheses,
                                       const RegistrationSettings& options);
std::vector<BestPose> refine_poses(Exec& exec, Span<const PairView> pairs,
                                   const std::vector<BestPose>& best,
                                   const RegistrationSettings& options);
std::vector<Verification> verify_poses(Exec& exec, Span<const PairView> pairs,
                                       const std::vector<BestPose>& poses,
                                       const RegistrationSettings& options);
// Alignment by compatibility and evidence, one entry per pair.
/// Merges the nearest features in both directions and of both radii; keeps at most max_matches.
std::vector<MatchSet> merge_matches(Exec& exec, Span<const PairView> pairs,
                                    const RegistrationSettings& options);
/// Matches with the most compatible others, local maxima first.
std::vector<std::vector<std::uint32_t>> choose_seeds(Exec& exec,
                                                     const std::vector<MatchSet>& matches,
                                                     const RegistrationSettings& options);
/// A pose for each seed with a determinate neighbourhood, in the order of the seeds, and the
/// matches that it aligns.
std::vector<Candidates> propose_poses(Exec& exec, const std::vector<MatchSet>& matches,
                                      const std::vector<std::vector<std::uint32_t>>& seeds,
                                      const RegistrationSettings& options);
/// Adds the coarse_score, from a sample of the points.
void score_candidates(Exec& exec, Span<const PairView> pairs, const std::vector<MatchSet>& matches,
                      std::vector<Candidates>& candidates, const RegistrationSettings& options);
/// Distinct poses with the highest coarse_score.
std::vector<std::vector<Mode>> select_modes(Exec& exec, const std::vector<Candidates>& candidates,
                                            const ModeSelection& selection);
/// Modes as candidates, with the matches that they align: to score and select them again.
std::vector<Candidates> candidates_from_modes(Exec& exec, const std::vector<MatchSet>& matches,
                                              const std::vector<std::vector<Mode>>& modes,
                                              const RegistrationSettings& options);
/// The first refinement: on a sample, with the wide kernel.
void refine_roughly(Exec& exec, Span<const PairView> pairs, std::vector<std::vector<Mode>>& modes,
                    const RegistrationSettings& options);
/// The second refinement: with a narrower kernel, on a sample and then on all points.
void polish_modes(Exec& exec, Span<const PairView> pairs, std::vector<std::vector<Mode>>& modes,
                  const RegistrationSettings& options);
/// Merges modes that refinement moved to the same pose, within a share of the limits of a mode;
/// keeps the one with the highest coarse_score.
void merge_modes(Exec& exec, std::vector<std::vector<Mode>>& modes,
                 const RegistrationSettings& options, float share);
/// Drops perturbed poses that have returned to their origin mode or to an earlier one of them.
void drop_returned(Exec& exec, std::vector<std::vector<Mode>>& perturbed,
                   const std::vector<PosesOfPair>& perturbations);
/// Perturbed poses of the most likely mode of each pair; on the host.
inline std::vector<PosesOfPair> search_degeneracies(Exec& exec, Span<const PairInput> inputs,
                                                    Span<const PairOutcome> outcomes,
                                                    const RegistrationSettings& options) {
  return confidence::search_degeneracies(inputs, outcomes, options, exec.threads());
}
std::vector<std::vector<Mode>> modes_from_poses(Exec& exec, const std::vector<PosesOfPair>& poses);
/// For poses that were not proposed by the stages before.
std::vector<Candidates> no_candidates(Exec& exec, Span<const PairView> pairs);
/// All evidence, from all points.
void verify_modes(Exec& exec, Span<const PairView> pairs, const std::vector<MatchSet>& matches,
                  const std::vector<Candidates>& candidates,
                  const std::vector<std::vector<Mode>>& modes, const RegistrationSettings& options,
                  Span<PairOutcome> outcomes);

void conclude(Exec& exec, Span<const PairView> pairs, const std::vector<Matches>& matches,
              const std::vector<std::vector<std::uint32_t>>& quadruples,
              const std::vector<Hypotheses>& hypotheses, const std::vector<BestPose>& poses,
              const std::vector<Verification>& verifications, const RegistrationSettings& options,
              Span<PairOutcome> outcomes);

/// Nearest features of every query row: k indices per query in order of distance (squared_norm of
/// the difference as a chain of fmaf over the dimensions, then the lower index), kNoValue where
/// fewer exist. Invalid rows neither query nor match.
void nearest_features(FeatureRows queries, FeatureRows rows, std::uint32_t k, std::size_t begin,
                      std::size_t end, std::uint32_t* out);

/// Matches that the pose brings within the distance.
MatchEvidence count_matches(const MatchSet& matches, const Rigid& pose, float squared_distance);

/// Exact support of one pose, for scoring, refinement and tests.
Support measure_support(const CloudView& source, const CloudView& target, const Rigid& pose,
                        const RegistrationSettings& options);

}  // namespace gpureg::cpu
