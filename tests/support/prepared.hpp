// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "cpu/stages.hpp"
#include "pipeline/align.hpp"
#include "pipeline/prepare.hpp"

/// The CPU's stages for tests that look inside: one cloud prepared, with everything public.
namespace gpureg::test {

inline RawCloud raw_cloud(const std::vector<Vec3>& points) {
  return {points.empty() ? nullptr : &points[0].x, points.size(), 3, nullptr, 3, nullptr, 0, 0, nullptr, 0};
}

inline std::shared_ptr<cpu::CpuCloud> prepare_one(cpu::Exec& exec, const RawCloud& raw, const PrepareOptions& options) {
  return pipeline::prepare(exec, Span<const RawCloud>{&raw, 1}, options).front();
}

inline PairView pair_view(const cpu::CpuCloud& source, const cpu::CpuCloud& target) {
  return {source.view(), target.view(), nullptr, nullptr, 0};
}

}  // namespace gpureg::test
