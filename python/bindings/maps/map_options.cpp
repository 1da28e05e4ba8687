// SPDX-License-Identifier: BSD-3-Clause
// Options of pose graphs, reconstructions and loop closure.
#include "fields.hpp"
#include "fields/audit.hpp"
#include "fields/loop_closure.hpp"

namespace gpureg::python {
void bind_map_options(py::module_& m) {
  bind_options_class<pose_graph::GncOptions>(m);
  bind_options_class<pose_graph::LineProcessOptions>(m);
  bind_options_class<pose_graph::DriftOptions>(m);
  bind_options_class<pose_graph::LoopNoiseOptions>(m);
  bind_options_class<pose_graph::SolverOptions>(m);
  bind_options_class<pose_graph::Options>(m);
  bind_options_class<reconstruction::EdgeNoiseOptions>(m);
  bind_options_class<reconstruction::Options>(m);
  bind_options_class<reconstruction::AuditOptions>(m);
  bind_options_class<loop_closure::ProposalOptions>(m);
  bind_options_class<loop_closure::AcceptanceOptions>(m);
  bind_options_class<loop_closure::Options>(m).def_static(
      "loopsmart",
      [](const py::object& voxel_size) {
        return loop_closure::Options::loopsmart(argument<float>(voxel_size, "voxel_size"));
      },
      py::arg("voxel_size") = shortest(RegistrationOptions{}.voxel_size),
      "Verification by the constants of the LoopSmart paper.");
}

}  // namespace gpureg::python
