// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

/// The private module gpureg._core: one file per subject. Arguments are strict here (float32
/// arrays, no conversion); python/gpureg converts what users pass.
namespace gpureg::python {

namespace py = pybind11;

void bind_errors(py::module_& m);
void bind_context(py::module_& m);
void bind_options(py::module_& m);
void bind_result(py::module_& m);
void bind_cloud(py::module_& m);
void bind_prepare(py::module_& m);
void bind_prior(py::module_& m);
void bind_align(py::module_& m);
void bind_verification(py::module_& m);
void bind_loop_consistency(py::module_& m);
void bind_scale(py::module_& m);
void bind_time_budget(py::module_& m);
void bind_voxel_size(py::module_& m);
void bind_files(py::module_& m);
void bind_evaluation(py::module_& m);
void bind_confidence(py::module_& m);
void bind_map_options(py::module_& m);
void bind_pose_graph(py::module_& m);
void bind_loop_closure(py::module_& m);
void bind_reconstruction(py::module_& m);
void bind_sets(py::module_& m);
void bind_find(py::module_& m);
void bind_localization(py::module_& m);
void bind_pruning(py::module_& m);
void bind_trajectory(py::module_& m);
void bind_calibration(py::module_& m);

}  // namespace gpureg::python
