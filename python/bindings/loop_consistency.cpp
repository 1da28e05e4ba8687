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
            "Degrees by which three right poses typically miss their beginning."),
      field("closing_distance", &O::closing_distance, "The same in metres."),
      field("chance", &O::chance, "How often a loop with a wrong pose closes all the same."),
      field("miss", &O::miss, "How often a loop of three right poses does not close."),
      field("max_factor", &O::max_factor,
            "By which all loops together may raise or lower the odds of a pose."),
      field("min_confidence", &O::min_confidence, "Pairs below take no part."),
      field("min_rival", &O::min_rival,
            "Confidence from which a mode that is not the first takes part."),
      field("modes", &O::modes, "Of a pair, the first so many take part, 1 to 16."),
      field("neighbors", &O::neighbors,
            "Of a cloud, so many pairs, the most confident, judge others, 2 to 1024."),
      field("rounds", &O::rounds, "Damped updates, 1 to 100."),
  };
}

std::vector<Field<PairConsistency>> result_fields() {
  using A = PairConsistency;
  return {
      field("confidence", &A::confidence, "Probability that the mode is right, given all pairs."),
      field("mode", &A::mode,
            "Index into RegistrationResult.modes; 0 where there are none: target_from_source."),
      field("loops", &A::loops, "Of three that were looked at."),
      field("path", &A::path,
            "Pairs on the trusted path that it was compared with; 0: none. Without loops or a path "
            "the confidence is the result's score."),
  };
}

std::vector<PairConsistency> agree(const IndexArray& pairs, const py::list& results,
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
  return agreement(entries, values, options);
}

}  // namespace

void bind_loop_consistency(py::module_& m) {
  auto cls = bind_options_class<LoopConsistencyOptions>(m, "LoopConsistencyOptions",
                                                        "How loops are judged.", option_fields());
  cls.def_static(
      "from_voxel_size",
      [](const py::object& voxel_size) {
        return LoopConsistencyOptions::from_voxel_size(argument<float>(voxel_size, "voxel_size"));
      },
      py::arg("voxel_size"),
      "The distance is three voxels; the rest does not depend on the voxel.");
  bind_record_class<PairConsistency>(m, "PairConsistency", "What the other pairs say of one pair.",
                                     result_fields());
  m.def("agreement", &agree, py::arg("pairs"), py::arg("results"), py::arg("options"));
}

}  // namespace gpureg::python
