// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "api/with_settings.hpp"
#include "cpu/common/stages.hpp"
#include "pipeline/align_by_quadruples.hpp"
#include "pipeline/prepare.hpp"

/// The CPU's stages for tests that look inside: one cloud prepared, with everything public.
namespace gpureg::test {

inline RawCloud raw_cloud(const std::vector<Vec3>& points) {
  RawCloud raw{};
  raw.points = points.empty() ? nullptr : &points[0].x;
  raw.size = points.size();
  raw.point_stride = 3;
  raw.normal_stride = 3;
  return raw;
}

inline std::shared_ptr<cpu::CpuCloud> prepare_one(cpu::Exec& exec, const RawCloud& raw,
                                                  const PrepareSettings& options) {
  return pipeline::prepare(exec, Span<const RawCloud>{&raw, 1}, options).front();
}

inline PairView pair_view(const cpu::CpuCloud& source, const cpu::CpuCloud& target) {
  return {source.view(), target.view(), nullptr, nullptr, 0};
}

/// A cloud that was seen from one place.
inline std::shared_ptr<cpu::CpuCloud> seen_from(cpu::Exec& exec, const std::vector<Vec3>& points,
                                                Vec3 eye, const PrepareSettings& options = {}) {
  RawCloud raw = raw_cloud(points);
  raw.viewpoints = &eye.x;
  raw.viewpoint_count = 1;
  return prepare_one(exec, raw, options);
}

/// A pair with one mode, the identity between the clouds' own frames, and the evidence of that.
inline PairOutcome verified_in_place(cpu::Exec& exec, const cpu::CpuCloud& source,
                                     const cpu::CpuCloud& target) {
  const PairView pair = pair_view(source, target);
  std::vector<cpu::Mode> modes(1);
  modes[0].pose = {1,
                   0,
                   0,
                   0,
                   static_cast<double>(source.origin[0] - target.origin[0]),
                   static_cast<double>(source.origin[1] - target.origin[1]),
                   static_cast<double>(source.origin[2] - target.origin[2])};
  PairOutcome outcome;
  cpu::verify_modes(exec, {&pair, 1}, std::vector<cpu::MatchSet>(1),
                    std::vector<cpu::Candidates>(1), {modes}, resolve(RegistrationOptions{}),
                    {&outcome, 1});
  return outcome;
}

}  // namespace gpureg::test
