// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>

#include <optional>

#include "cloud.hpp"
#include "gpureg/registration.hpp"
#include "prior.hpp"

namespace gpureg::python {
namespace {

using IndexArray = py::array_t<std::uint32_t, py::array::c_style>;

/// (M, 2) indices as pairs or correspondences; the face has checked the numbers.
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
                              const RegistrationOptions& options,
                              const std::optional<IndexArray>& correspondences,
                              const std::optional<RegistrationPrior>& prior) {
  RegistrationResult result;
  if (correspondences) {
    const auto entries = entries_of<Correspondence>(*correspondences, "correspondences");
    const py::gil_scoped_release release;
    result = align(context, source.prepared, target.prepared, entries, options);
  } else if (prior) {
    const py::gil_scoped_release release;
    result = align(context, source.prepared, target.prepared,
                   in_prepared_frames(*prior, source, target), options);
  } else {
    const py::gil_scoped_release release;
    result = align(context, source.prepared, target.prepared, options);
  }
  move_to_origins(result, source, target);
  return result;
}

/// Returns (results, error): what was raised between two chunks, by Ctrl-C or by progress, does not
/// take with it what is done.
py::tuple align_pairs(const Context& context, const py::list& clouds, const IndexArray& pairs,
                      const RegistrationOptions& options, const py::object& progress,
                      const std::vector<RegistrationPrior>& priors) {
  std::vector<Cloud> held;  // copies share the data
  std::vector<PreparedCloud> prepared;
  for (const py::handle cloud : clouds) {
    held.push_back(cloud.cast<const Cloud&>());
    prepared.push_back(held.back().prepared);
  }
  const auto entries = entries_of<Pair>(pairs, "pairs");
  std::size_t done = 0;
  py::object error = py::none();
  BatchCallbacks callbacks;
  callbacks.on_result = [&](std::size_t, const RegistrationResult&) { ++done; };
  callbacks.should_stop = [&] {
    const py::gil_scoped_acquire acquire;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (!progress.is_none()) progress(done);
      return false;
    } catch (const py::error_already_set& raised) {
      error = raised.value();
      return true;
    }
  };
  std::vector<RegistrationResult> results;
  {
    const py::gil_scoped_release release;
    std::vector<RegistrationPrior>
        moved;  // a wrong number of them, or of clouds, is align_batch's to name
    for (std::size_t k = 0; k < priors.size(); ++k) {
      const bool known =
          k < entries.size() && entries[k].source < held.size() && entries[k].target < held.size();
      moved.push_back(
          known ? in_prepared_frames(priors[k], held[entries[k].source], held[entries[k].target])
                : priors[k]);
    }
    results = align_batch(context, prepared, entries, moved, options, callbacks);
    for (std::size_t k = 0; k < results.size(); ++k)
      move_to_origins(results[k], held[entries[k].source], held[entries[k].target]);
  }
  if (error.is_none() && !progress.is_none()) progress(done);
  py::list out(results.size());
  for (std::size_t k = 0; k < results.size(); ++k) out[k] = py::cast(std::move(results[k]));
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
