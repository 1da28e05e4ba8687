// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/loop_consistency.hpp"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "fields.hpp"

namespace gpureg::python {
namespace {

using IndexArray = py::array_t<std::uint32_t, py::array::c_style>;

std::vector<Field<LoopConsistencyOptions>> option_fields() {
  using O = LoopConsistencyOptions;
  return {
      field("closing_angle", &O::closing_angle,
            "Standard deviation of the rotation error of a loop of three correct poses, degrees."),
      field("closing_distance", &O::closing_distance,
            "Standard deviation of its translation error, metres."),
      field("false_closure_rate", &O::false_closure_rate,
            "Probability that a loop with a false pose closes all the same."),
      field("missed_closure_rate", &O::missed_closure_rate,
            "Probability that a loop of three correct poses does not close."),
      field("max_odds_factor", &O::max_odds_factor,
            "Largest factor by which all loops together change the odds of a pose."),
      field("min_confidence", &O::min_confidence,
            "Pairs below take no part and keep their confidence."),
      field("min_alternative_confidence", &O::min_alternative_confidence,
            "Confidence from which a mode that is not the first takes part."),
      field("modes", &O::modes, "Number of modes of a pair that take part, 1 to 16."),
      field("neighbors", &O::neighbors,
            "Number of pairs of a cloud that form loops, the most confident ones, 2 to 1024."),
      field("iterations", &O::iterations, "Damped updates, 1 to 100."),
  };
}

std::vector<Field<PairConsistency>> result_fields() {
  using P = PairConsistency;
  return {
      field("confidence", &P::confidence, "Probability that the mode is correct, given all pairs."),
      field("mode", &P::mode,
            "Index into RegistrationResult.modes; 0, target_from_source, where there are none."),
      field("loops", &P::loops, "Loops of three that the pair is in."),
      field("path", &P::path,
            "Number of pairs on the most confident path that the pair was compared with; 0: none. "
            "Without loops and path the confidence is the result's score."),
  };
}

std::vector<PairConsistency> consistency_of(const IndexArray& pairs, const py::list& results,
                                            const LoopConsistencyOptions& options) {
  if (pairs.ndim() != 2 || pairs.shape(1) != 2)
    throw py::type_error("pairs: not a matrix with two columns");
  std::vector<Pair> entries(static_cast<std::size_t>(pairs.shape(0)));
  for (std::size_t k = 0; k < entries.size(); ++k)
    entries[k] = {pairs.data()[2 * k], pairs.data()[2 * k + 1]};
  std::vector<RegistrationResult> values;
  for (const py::handle result : results)
    values.push_back(result.cast<const RegistrationResult&>());
  const py::gil_scoped_release release;
  return loop_consistency(entries, values, options);
}

}  // namespace

void bind_loop_consistency(py::module_& m) {
  auto cls = bind_options_class<LoopConsistencyOptions>(
      m, "LoopConsistencyOptions", "Model of closing errors.", option_fields());
  cls.def_static(
      "from_voxel_size",
      [](const py::object& voxel_size) {
        return LoopConsistencyOptions::from_voxel_size(argument<float>(voxel_size, "voxel_size"));
      },
      py::arg("voxel_size"),
      "closing_distance of three voxels; the rest does not depend on the voxel.");
  bind_record_class<PairConsistency>(
      m, "PairConsistency", "Confidence of one pair in view of the others.", result_fields());
  m.def("loop_consistency", &consistency_of, py::arg("pairs"), py::arg("results"),
        py::arg("options"));
}

}  // namespace gpureg::python
