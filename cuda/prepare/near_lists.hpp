// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/stage_data.hpp"
#include "cuda/device/exec.hpp"

/// Near lists of the blocks of closest-point grids, see candidate_lists.hpp. Part of
/// build_closest_grids().
namespace gpureg::cuda {

/// Units of list memory that a cloud can number.
constexpr std::uint64_t kMaxListUnits = (std::uint64_t(1) << 31) - 1;

/// Writes out.size and out.list_start; waits for the sizes. On the device: near_start, offsets of
/// the blocks into the points within reach of each; used, the candidates among them before each
/// point, and all.
void measure_near_lists(Exec& exec, const std::uint32_t* near_start, const std::uint32_t* used,
                        ClosestGrids& out);
/// Writes out.near and out.near_start: the points that are candidates. near: `points` indices.
void fill_near_lists(Exec& exec, const std::uint32_t* near_start, const std::uint32_t* near,
                     const std::uint32_t* used, std::uint32_t points, ClosestGrids& out);

}  // namespace gpureg::cuda
