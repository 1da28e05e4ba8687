// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>

#include <algorithm>
#include <chrono>
#include <optional>

#include "cloud.hpp"
#include "gpureg/prior.hpp"
#include "gpureg/registration.hpp"
#include "interrupt.hpp"

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
  std::vector<Correspondence> entries;
  if (correspondences) entries = entries_of<Correspondence>(*correspondences, "correspondences");
  return interruptible([&] {
    if (correspondences) return align(context, source.prepared, target.prepared, entries, options);
    if (prior) return align(context, source.prepared, target.prepared, *prior, options);
    return align(context, source.prepared, target.prepared, options);
  });
}

/// One call of align_batch from Python.
class Batch {
 public:
  Batch(const Context& context, const py::list& clouds, const IndexArray& pairs,
        const RegistrationOptions& options, py::object progress)
      : context_(context),
        options_(options),
        pairs_(entries_of<Pair>(pairs, "pairs")),
        progress_(std::move(progress)) {
    for (const py::handle cloud : clouds) prepared_.push_back(cloud.cast<const Cloud&>().prepared);
  }

  /// Returns (results, error). An exception raised between two pieces, by Ctrl-C or by a callback,
  /// does not take the finished results with it.
  py::tuple run(const std::vector<RegistrationPrior>& priors) {
    priors_ = priors;
    if (context_.backend() == Backend::cpu)
      align_in_pieces();
    else
      align_at_once();
    if (error_.is_none()) report();
    py::list out;
    for (RegistrationResult& result : results_) out.append(py::cast(std::move(result)));
    return py::make_tuple(std::move(out), std::move(error_));
  }

 private:
  /// The library splits the batch: a chunk of a device takes a fraction of a second.
  void align_at_once() {
    BatchCallbacks callbacks;
    callbacks.on_result = [&](std::size_t, const RegistrationResult&) { ++done_; };
    callbacks.should_stop = [&] {
      const py::gil_scoped_acquire acquire;
      return !report();
    };
    const py::gil_scoped_release release;
    results_ = align_batch(context_, prepared_, pairs_, priors_, options_, callbacks);
  }

  /// A chunk of the CPU may take seconds; pieces of about kPieceSeconds keep progress moving, and
  /// Ctrl-C drops no more than one. Results do not depend on the split.
  void align_in_pieces() {
    // Names whatever is wrong, before the first pair runs.
    BatchCallbacks nothing;
    nothing.should_stop = [] { return true; };
    results_ = interruptible(
        [&] { return align_batch(context_, prepared_, pairs_, priors_, options_, nothing); });
    const std::size_t most = 2 * std::size_t{context_.threads()} + 2;  // a chunk of the CPU
    std::size_t piece = 1;
    while (done_ < pairs_.size()) {
      if (!report()) return;
      const std::size_t count = std::min(piece, pairs_.size() - done_);
      const auto begin = std::chrono::steady_clock::now();
      if (!align_next(count)) return;
      const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
      const double wanted = kPieceSeconds * static_cast<double>(count) / seconds.count();
      piece = wanted < static_cast<double>(most)
                  ? std::max<std::size_t>(1, static_cast<std::size_t>(wanted))
                  : most;
    }
  }

  /// False where Ctrl-C came before the end.
  bool align_next(std::size_t count) {
    const auto part = [&](const auto& all) {
      const auto begin = all.begin() + static_cast<std::ptrdiff_t>(done_);
      return std::vector(begin, begin + static_cast<std::ptrdiff_t>(count));
    };
    try {
      auto results = interruptible([&] {
        return align_batch(context_, prepared_, part(pairs_),
                           priors_.empty() ? priors_ : part(priors_), options_);
      });
      for (RegistrationResult& result : results) results_[done_++] = std::move(result);
      return true;
    } catch (const py::error_already_set& raised) {
      error_ = raised.value();
      return false;
    }
  }

  /// False where somebody raised: Ctrl-C, or progress.
  bool report() {
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (!progress_.is_none()) progress_(done_);
      return true;
    } catch (const py::error_already_set& raised) {
      error_ = raised.value();
      return false;
    }
  }

  static constexpr double kPieceSeconds = 0.4;

  const Context& context_;
  const RegistrationOptions options_;
  std::vector<PreparedCloud> prepared_;  // copies share the data
  std::vector<Pair> pairs_;
  std::vector<RegistrationPrior> priors_;
  py::object progress_, error_ = py::none();
  std::vector<RegistrationResult> results_;
  std::size_t done_ = 0;
};

py::tuple align_pairs(const Context& context, const py::list& clouds, const IndexArray& pairs,
                      const RegistrationOptions& options, const py::object& progress,
                      const std::vector<RegistrationPrior>& priors) {
  return Batch(context, clouds, pairs, options, progress).run(priors);
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
