// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>

#include <optional>

#include "cloud.hpp"
#include "gpureg/prior.hpp"
#include "gpureg/registration.hpp"
#include "interrupt.hpp"
#include "teller.hpp"

namespace gpureg::python {
namespace {

using IndexArray = py::array_t<std::uint32_t, py::array::c_style>;

/// (M, 2) indices as pairs or correspondences; the package has checked the numbers.
template <typename Entry>
std::vector<Entry> entries_of(const IndexArray& array, const char* name) {
  if (array.ndim() != 2 || array.shape(1) != 2)
    throw py::type_error(std::string(name) + ": not a matrix with two columns");
  std::vector<Entry> entries(static_cast<std::size_t>(array.shape(0)));
  for (std::size_t k = 0; k < entries.size(); ++k)
    entries[k] = {array.data()[2 * k], array.data()[2 * k + 1]};
  return entries;
}

RegistrationResult align_pair(const Context& context, const Cloud& source, const Cloud& target,
                              const RegistrationOptions options,
                              const std::optional<IndexArray>& correspondences,
                              const std::optional<RegistrationPrior>& prior) {
  RegistrationPrior known = prior.value_or(RegistrationPrior());
  if (correspondences)
    known.correspondences = entries_of<Correspondence>(*correspondences, "correspondences");
  return interruptible(
      [&] { return align(context, source.prepared, target.prepared, options, known); });
}

/// Returns (results, error): an exception, by Ctrl-C or by progress, does not take the finished
/// results with it.
py::tuple align_pairs(const Context& context, const py::list& clouds, const IndexArray& rows,
                      const RegistrationOptions options, const py::object& progress,
                      const std::vector<RegistrationPrior>& priors) {
  std::vector<PreparedCloud> prepared;  // copies share the data
  for (const py::handle cloud : clouds) prepared.push_back(cloud.cast<const Cloud&>().prepared);
  const auto pairs = entries_of<Pair>(rows, "pairs");
  std::vector<RegistrationResult> results(pairs.size());
  std::size_t done = 0;
  Teller tell(progress);
  BatchCallbacks callbacks;
  callbacks.on_result = [&](std::size_t k, const RegistrationResult& result) {
    results[k] = result;
    ++done;
  };
  callbacks.should_stop = [&] { return !tell(done); };
  py::object error = py::none();
  try {
    interruptibly([&] { align_batch(context, prepared, pairs, options, callbacks, priors); });
    tell(done);
    tell.rethrow();
  } catch (const py::error_already_set& raised) {
    error = raised.value();
  }
  py::list out;
  for (RegistrationResult& result : results) out.append(py::cast(std::move(result)));
  return py::make_tuple(std::move(out), std::move(error));
}

}  // namespace

void bind_align(py::module_& m) {
  m.def("align", &align_pair, py::arg("context"), py::arg("source"), py::arg("target"),
        py::arg("options"), py::arg("correspondences") = py::none(), py::arg("prior") = py::none());
  m.def("align_batch", &align_pairs, py::arg("context"), py::arg("clouds"), py::arg("pairs"),
        py::arg("options"), py::arg("progress") = py::none(),
        py::arg("priors") = std::vector<RegistrationPrior>());
}

}  // namespace gpureg::python
