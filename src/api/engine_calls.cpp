// SPDX-License-Identifier: BSD-3-Clause
#include "api/engine_calls.hpp"

#include <algorithm>
#include <chrono>

#include "api/frames.hpp"
#include "common/in_halves.hpp"
#include "flat/planar_pose.hpp"

namespace gpureg {
namespace {

using Poses = std::vector<Pose<double>>;

/// Poses of a pair that go through the engine together: enough to fill a device, few enough for its
/// memory.
constexpr std::size_t kPosesPerCall = 64;

/// The layers of a 2-D scan hold a pose in the plane only weakly while it is refined, and a pose
/// that has left it is projected to a worse one. So the projected pose is refined again, by so few
/// iterations that it stays near the plane, and projected after them.
constexpr std::uint32_t kPlanarRounds = 2, kPlanarIterations = 2;

/// The modes of all pairs are those of the poses, in their order.
std::vector<PairOutcome> verify_in_parts(Engine& engine, const std::vector<PairInput>& pairs,
                                         const std::vector<Poses>& poses,
                                         const RegistrationSettings& options, bool refine) {
  std::vector<PairOutcome> out(pairs.size());
  std::size_t most = 0;
  for (const Poses& of_pair : poses) most = std::max(most, of_pair.size());
  for (std::size_t begin = 0; begin < most; begin += kPosesPerCall) {
    std::vector<PosesOfPair> part(pairs.size());
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      const std::size_t first = std::min(begin, poses[p].size()),
                        last = std::min(begin + kPosesPerCall, poses[p].size());
      part[p].poses.assign(poses[p].begin() + static_cast<std::ptrdiff_t>(first),
                           poses[p].begin() + static_cast<std::ptrdiff_t>(last));
    }
    std::vector<PairOutcome> more(pairs.size());
    in_halves(0, pairs.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t p = first; p < last; ++p) more[p] = PairOutcome();
      engine.verify({pairs.data() + first, last - first},
                    {part.begin() + static_cast<std::ptrdiff_t>(first),
                     part.begin() + static_cast<std::ptrdiff_t>(last)},
                    options, refine, {more.data() + first, last - first});
    });
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      std::vector<ModeOutcome> modes = std::move(out[p].modes);
      modes.insert(modes.end(), more[p].modes.begin(), more[p].modes.end());
      out[p] = std::move(more[p]);
      out[p].modes = std::move(modes);
    }
  }
  return out;
}

Pose<double> planar(const Pose<double>& pose, const PairInput& pair) {
  const PreparedState &moved = *pair.source, &fixed = *pair.target;
  const UnalignedIsometry3d found = rows_from_local(pose, moved, fixed);
  return local_from_rows(planar(found, moved.plane, fixed.plane, origin_of(moved)), moved, fixed);
}

Poses planar_poses(const PairOutcome& outcome, const PairInput& pair) {
  Poses out;
  for (const ModeOutcome& mode : outcome.modes) out.push_back(planar(mode.pose, pair));
  return out;
}

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

/// Moves the modes of 2-D scans to poses in the plane, with the evidence of these. A pose that
/// drifted out of it loses points that the projected one has.
void keep_in_plane(Engine& engine, Span<const PairInput> all, const RegistrationSettings& options,
                   Span<PairOutcome> outcomes) {
  std::vector<PairInput> pairs;
  std::vector<PairOutcome*> kept;
  std::vector<Poses> poses;
  for (std::size_t p = 0; p < all.size; ++p) {
    const PairInput& pair = all[p];
    if (outcomes[p].modes.empty() || !planar_pair(*pair.source, *pair.target)) continue;
    pairs.push_back(pair);
    kept.push_back(&outcomes[p]);
    poses.push_back(planar_poses(outcomes[p], pair));
  }
  if (pairs.empty()) return;

  const auto begin = std::chrono::steady_clock::now();
  RegistrationSettings few = options;
  few.refine.max_iterations = std::min(kPlanarIterations, options.refine.max_iterations);
  const std::uint32_t first = 0;  // a match, so that none are searched; their evidence is not used
  std::vector<PairInput> unmatched = pairs;
  for (PairInput& pair : unmatched) pair.custom_source = pair.custom_target = {&first, 1};
  for (std::uint32_t round = 0; round < kPlanarRounds && few.refine.max_iterations > 0; ++round) {
    const std::vector<PairOutcome> refined = verify_in_parts(engine, unmatched, poses, few, true);
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      poses[p] = planar_poses(refined[p], pairs[p]);
      for (std::size_t k = 0; k < poses[p].size(); ++k)
        kept[p]->modes[k].iterations += refined[p].modes[k].iterations;
    }
  }
  const double share = 1.0 / static_cast<double>(pairs.size()),
               refinement = milliseconds_since(begin) * share;
  const std::vector<PairOutcome> verified = verify_in_parts(engine, pairs, poses, options, false);
  const double verification = milliseconds_since(begin) * share - refinement;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    kept[p]->timings.refine += refinement;
    kept[p]->timings.verify += verification;
    for (std::size_t k = 0; k < poses[p].size(); ++k) {
      const ModeOutcome before = kept[p]->modes[k];
      ModeOutcome& mode = kept[p]->modes[k];
      mode = verified[p].modes[k];
      mode.hypothesis = before.hypothesis;
      mode.iterations = before.iterations;
      mode.origin_mode = before.origin_mode;
    }
  }
}

}  // namespace

void align_all(Engine& engine, Span<const PairInput> pairs, const RegistrationSettings& options,
               Span<PairOutcome> outcomes) {
  in_halves(0, pairs.size, [&](std::size_t begin, std::size_t end) {
    // A larger part that failed may have left some of its outcomes.
    for (std::size_t p = begin; p < end; ++p) outcomes[p] = PairOutcome();
    engine.align({pairs.data + begin, end - begin}, options, {outcomes.data + begin, end - begin});
  });
  keep_in_plane(engine, pairs, options, outcomes);
}

std::vector<PairOutcome> verify_all(Engine& engine, const std::vector<PairInput>& pairs,
                                    const std::vector<Poses>& poses,
                                    const RegistrationSettings& options, bool refine) {
  std::vector<PairOutcome> out = verify_in_parts(engine, pairs, poses, options, refine);
  if (refine) keep_in_plane(engine, span_of(pairs), options, {out.data(), out.size()});
  return out;
}

}  // namespace gpureg
