// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/loop_consistency.hpp"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "fields.hpp"
#include "fields/loop_consistency.hpp"

namespace gpureg::python {
namespace {

using IndexArray = py::array_t<std::uint32_t, py::array::c_style>;

std::vector<PairConsistency> consistency_of(const IndexArray& pairs, const py::list& results,
                                            const LoopConsistencyOptions options) {
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
  bind_options_class<LoopConsistencyOptions>(m);
  bind_record_class<PairConsistency>(m);
  m.def("loop_consistency", &consistency_of, py::arg("pairs"), py::arg("results"),
        py::arg("options"));
}

}  // namespace gpureg::python
