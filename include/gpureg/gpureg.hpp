// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Everything in gpureg's core but cuda_interop.hpp, for programs with CUDA. The components have
/// headers of their own: change.hpp, evaluation.hpp, files.hpp, io.hpp, localization.hpp,
/// loop_closure.hpp, mesh.hpp, overlay.hpp, pcl.hpp, pose_graph.hpp, reconstruction.hpp.
#include "gpureg/calibration.hpp"
#include "gpureg/loop_consistency.hpp"
#include "gpureg/preparation/sensor_fixed.hpp"
#include "gpureg/pruning.hpp"
#include "gpureg/registration.hpp"
#include "gpureg/registration/scale.hpp"
#include "gpureg/surface_set.hpp"
#include "gpureg/time_budget.hpp"
#include "gpureg/verification.hpp"
#include "gpureg/voxel_size.hpp"
