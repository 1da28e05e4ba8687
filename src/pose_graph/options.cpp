// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/pose_graph/options.hpp"

#include "fields/pose_graph.hpp"
#include "fields/validate.hpp"

namespace gpureg::pose_graph {
void DriftOptions::validate() const { fields::validate(*this); }
void LoopNoiseOptions::validate() const { fields::validate(*this); }
void GncOptions::validate() const { fields::validate(*this); }
void LineProcessOptions::validate() const { fields::validate(*this); }
void SolverOptions::validate() const { fields::validate(*this); }
void Options::validate() const { fields::validate(*this); }

Options Options::loopsmart() {
  Options options;
  options.robust = Robust::line_process;
  options.line_process.odometry_weight = 1000;
  options.line_process.tau = 0.2;
  options.line_process.tau_not_squared = true;
  options.line_process.min_weight = 0.25;
  return options;
}

}  // namespace gpureg::pose_graph
