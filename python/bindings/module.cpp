// SPDX-License-Identifier: BSD-3-Clause
#include "bindings.hpp"

PYBIND11_MODULE(_core, m) {
  using namespace gpureg::python;
  m.doc() = "Private: use the package gpureg.";
  m.attr("__version__") = GPUREG_VERSION;
  bind_errors(m);
  bind_context(m);
  bind_options(m);
  bind_result(m);
  bind_cloud(m);
  bind_prepare(m);
  bind_prior(m);
  bind_align(m);
  bind_verification(m);
  bind_loop_consistency(m);
  bind_scale(m);
  bind_time_budget(m);
  bind_voxel_size(m);
  bind_files(m);
  bind_evaluation(m);
  bind_confidence(m);
  bind_map_options(m);
  bind_pose_graph(m);
  bind_loop_closure(m);
  bind_sets(m);
  bind_reconstruction(m);
  bind_localization(m);
  bind_find(m);
  bind_pruning(m);
  bind_trajectory(m);
  bind_calibration(m);
}
