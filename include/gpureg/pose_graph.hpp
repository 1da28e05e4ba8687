// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Robust SE(3) pose graphs (component `pose_graph`; standard library and Eigen only).
#include "gpureg/pose_graph/files.hpp"
#include "gpureg/pose_graph/graph.hpp"
#include "gpureg/pose_graph/optimize.hpp"
#include "gpureg/pose_graph/options.hpp"
#include "gpureg/pose_graph/result.hpp"
