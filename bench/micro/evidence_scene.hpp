// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "scene.hpp"

namespace gpureg::bench {

/// The scene for alignment by evidence: its clouds with both features and depth maps, and the
/// products of its stages.
struct EvidenceScene {
  EvidenceScene() : exec(1), options(RegistrationOptions::from_voxel_size(0.05f)) {
    const Scene& scene = Scene::get();
    raw[0] = test::raw_cloud(scene.raw_source);
    raw[1] = test::raw_cloud(scene.raw_target);
    for (RawCloud& view : raw) {
      view.viewpoints = &viewpoints[0].x;
      view.viewpoint_count = 12;
    }
    for (int k = 0; k < 12; ++k) viewpoints[k] = {0.2f * static_cast<float>(k) - 1.0f, 0.1f, 2.0f};
    for (int k = 0; k < 2; ++k) cloud[k] = test::prepare_one(exec, raw[k], options.prepare);
    pair = test::pair_view(*cloud[0], *cloud[1]);
    matches = cpu::merge_matches(exec, {&pair, 1}, options);
    seeds = cpu::choose_seeds(exec, matches, options);
    candidates = cpu::propose_poses(exec, matches, seeds, options);
    cpu::score_candidates(exec, {&pair, 1}, matches, candidates, options);
    modes = cpu::select_modes(exec, candidates, first_selection(options.evidence));
  }
  static EvidenceScene& get() {
    static EvidenceScene scene;
    return scene;
  }
  cpu::Exec exec;
  RegistrationOptions options;
  Vec3 viewpoints[12];
  RawCloud raw[2];
  std::shared_ptr<cpu::CpuCloud> cloud[2];
  PairView pair;
  std::vector<cpu::MatchSet> matches;
  std::vector<std::vector<std::uint32_t>> seeds;
  std::vector<cpu::Candidates> candidates;
  std::vector<std::vector<cpu::Mode>> modes;
};

}  // namespace gpureg::bench
