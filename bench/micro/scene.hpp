// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <benchmark/benchmark.h>

#include <random>

#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

/// What the stage benchmarks work on: two samplings of one bumpy sheet, about 5,000 points each
/// after downsampling, and every product on the way from them to a pose. Made once, on one thread,
/// so that a benchmark times its own stage only.
namespace gpureg::bench {

struct Scene {
  Scene() : exec(1) {
    std::mt19937 random(1);
    const std::vector<Vec3> all = test::bumpy_sheet(random, 240000, 1.7f);
    raw_source.assign(all.begin(), all.begin() + 120000);
    raw_target.assign(all.begin() + 120000, all.end());
    source = test::prepare_one(exec, test::raw_cloud(raw_source), options.prepare);
    target = test::prepare_one(exec, test::raw_cloud(raw_target), options.prepare);
    pair = test::pair_view(*source, *target);
    matches = cpu::match_features(exec, {&pair, 1}, options);
    quadruples = cpu::sample_quadruples(exec, matches, options);
    hypotheses = cpu::fit_hypotheses(exec, matches, quadruples, options);
    best = cpu::score_hypotheses(exec, {&pair, 1}, hypotheses, options);
  }
  static Scene& get() {
    static Scene scene;
    return scene;
  }
  cpu::Exec exec;
  RegistrationOptions options;
  std::vector<Vec3> raw_source, raw_target;
  std::shared_ptr<cpu::CpuCloud> source, target;
  PairView pair;
  std::vector<cpu::Matches> matches;
  std::vector<std::vector<std::uint32_t>> quadruples;
  std::vector<cpu::Hypotheses> hypotheses;
  std::vector<cpu::BestPose> best;
};

}  // namespace gpureg::bench
