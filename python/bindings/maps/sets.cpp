// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstdio>
#include <cstdlib>
#include <memory>

#include "cloud.hpp"
#include "cloud_input.hpp"
#include "fields.hpp"
#include "gpureg/error.hpp"
#include "maps/python_set.hpp"

namespace gpureg::python {
namespace {

using IndexArray = py::array_t<std::uint32_t, py::array::c_style>;
using Identities = std::vector<std::pair<std::string, std::string>>;

PairJournal::Mode mode_of(const std::string& name) {
  if (name == "resume") return PairJournal::Mode::resume;
  if (name == "restart") return PairJournal::Mode::restart;
  return PairJournal::Mode::fresh;
}

Journal open_journal(const std::string& path, const RegistrationOptions& options,
                     const PythonSet& set, const IndexArray& pairs, const std::string& mode) {
  RunIdentity run{RunIdentity::settings_of(options), {}};
  for (std::size_t k = 0; k < set.size(); ++k)
    run.clouds.push_back({set.name(k), set.fingerprint(k)});
  return {std::make_unique<PairJournal>(path, run, pairs_of(pairs), mode_of(mode))};
}

/// names of clouds, (M, 2) rows (source, target), results
py::tuple contents_of(const std::string& path) {
  JournalContents contents = read_journal(path);
  std::vector<std::string> names;
  for (const CloudIdentity& cloud : contents.clouds) names.push_back(cloud.name);
  IndexArray rows({static_cast<py::ssize_t>(contents.pairs.size()), py::ssize_t(2)});
  std::uint32_t* next = rows.mutable_data();
  for (const Pair& pair : contents.pairs) {
    *next++ = pair.source;
    *next++ = pair.target;
  }
  py::list results;
  for (RegistrationResult& result : contents.results) results.append(py::cast(std::move(result)));
  return py::make_tuple(names, rows, results);
}

void bind_journal(py::module_& m) {
  py::class_<Journal>(m, "PairJournal", "Results of pairs in a file that survives a kill.")
      .def(py::init(&open_journal), py::arg("path"), py::arg("options"), py::arg("fragments"),
           py::arg("pairs"), py::arg("mode"))
      .def_property_readonly("size", [](const Journal& j) { return j.get().size(); })
      .def_property_readonly("done", [](const Journal& j) { return j.get().done(); })
      .def_property_readonly("resumed", [](const Journal& j) { return j.get().resumed(); })
      .def_property_readonly("note", [](const Journal& j) { return j.get().note(); })
      .def(
          "set_note", [](Journal& j, std::uint64_t note) { j.get().set_note(note); },
          py::arg("note"))
      .def(
          "has", [](const Journal& j, std::size_t k) { return j.get().done(k); }, py::arg("pair"))
      .def(
          "result", [](Journal& j, std::size_t k) { return j.get().result(k); }, py::arg("pair"))
      .def(
          "add",
          [](Journal& j, std::size_t k, const RegistrationResult& result) {
            j.get().add(k, result);
          },
          py::arg("pair"), py::arg("result"))
      .def("flush", [](Journal& j) { j.get().flush(); })
      .def("close", [](Journal& j) { j.journal.reset(); });
  m.def("read_journal", &contents_of, py::arg("path"));
  m.def(
      "voxel_size_of_journal",
      [](const std::string& path) {
        const std::string text = PairJournal::setting(path, "options.voxel_size");
        return shortest(std::strtof(text.c_str(), nullptr));
      },
      py::arg("path"), "0: there is no journal.");
  m.def(
      "in_tiles", [](const IndexArray& pairs) { return in_tiles(pairs_of(pairs)); },
      py::arg("pairs"));
}

/// A list with a prepared cloud, or the reason why there is none, for each fragment.
py::list prepare_set(const Context& context, const PythonSet& set,
                     const RegistrationOptions options, const py::object& progress) {
  Teller tell(progress);
  std::vector<PreparedFragment> prepared;
  tell.run([&] {
    prepared = prepare_all(context, set, options,
                           {[&](std::size_t done) { tell(done); }, [&] { return !tell.check(); }});
  });
  py::list out;
  for (PreparedFragment& fragment : prepared)
    out.append(fragment.usable() ? py::cast(Cloud{std::move(fragment.cloud)})
                                 : py::object(py::str(fragment.reason)));
  return out;
}

py::dict register_set(const std::vector<Context>& contexts, const PythonSet& set, Journal& journal,
                      const RegistrationOptions options, std::size_t memory,
                      const py::object& progress) {
  Teller tell(progress);
  RegisterAllReport report;
  tell.run([&] {
    report =
        register_all(contexts, set, journal.get(), options, memory,
                     [&](std::size_t done, std::size_t prepared) { return tell(done, prepared); });
  });
  return dict_of(report.unusable);
}

void bind_aligner(py::module_& m) {
  py::class_<FragmentAligner>(m, "FragmentAligner", "Pairs of a set in bounded memory.")
      .def(py::init<Context, const PythonSet&, RegistrationOptions, std::size_t>(),
           py::arg("context"), py::arg("fragments"), py::arg("options"), py::arg("memory"),
           py::keep_alive<1, 3>())
      .def(
          "align",
          [](FragmentAligner& aligner, const IndexArray& rows, const py::object& take) {
            const std::vector<Pair> pairs = pairs_of(rows);
            Teller tell(take);
            tell.run([&] {
              aligner.align(
                  pairs, [&](std::size_t k, const RegistrationResult& result) { tell(k, result); },
                  [&] { return !tell.check(); });
            });
          },
          py::arg("pairs"), py::arg("on_result"))
      .def_property_readonly(
          "unusable", [](const FragmentAligner& aligner) { return dict_of(aligner.unusable()); });
}

/// Clouds whose viewpoints cannot be what they were seen from: says so, as nothing else would.
void warn_of_viewpoints(const PointCloudView& view, const std::string& label) {
  const double share = view.share_facing_away();
  if (share <= PointCloudView::kMaxFacingAway) return;
  char percent[16];
  std::snprintf(percent, sizeof(percent), "%.1f %%", 100 * share);
  const std::string text = label + ": viewpoints: " + percent +
                           " of the normals show all of them their back: are they in the frame "
                           "of the cloud, and do the normals point to where it was seen from?";
  if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 2) != 0) throw py::error_already_set();
}

}  // namespace

LoadedCloud PythonSet::read(std::size_t k, const RegistrationOptions& options) const {
  const py::gil_scoped_acquire acquire;
  try {
    const std::shared_ptr<py::tuple> tuple(new py::tuple(load_(k, options)), [](py::tuple* held) {
      const py::gil_scoped_acquire again;
      delete held;
    });
    LoadedCloud cloud;
    cloud.view = Input(*tuple).view;
    cloud.owner = tuple;
    if (options.prepare.depth_maps > 0) warn_of_viewpoints(cloud.view, label(k));
    return cloud;
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_OSError)) throw;
    throw IoError(py::str(error.value()).cast<std::string>());
  }
}

std::vector<Pair> pairs_of(const IndexArray& rows) {
  if (rows.ndim() != 2 || rows.shape(1) != 2)
    throw py::type_error("pairs: not a matrix with two columns");
  std::vector<Pair> pairs(static_cast<std::size_t>(rows.shape(0)));
  for (std::size_t k = 0; k < pairs.size(); ++k)
    pairs[k] = {rows.data()[2 * k], rows.data()[2 * k + 1]};
  return pairs;
}

py::dict dict_of(const std::map<std::size_t, std::string>& unusable) {
  py::dict out;
  for (const auto& [k, reason] : unusable) out[py::int_(k)] = reason;
  return out;
}

void bind_sets(py::module_& m) {
  py::class_<PythonSet>(m, "FragmentSource", "Clouds that are loaded when they are needed.")
      .def(py::init<std::vector<std::string>, std::vector<std::string>, py::object>(),
           py::arg("names"), py::arg("fingerprints"), py::arg("load"));
  bind_journal(m);
  bind_aligner(m);
  m.def("prepare_set", &prepare_set, py::arg("context"), py::arg("fragments"), py::arg("options"),
        py::arg("progress") = py::none());
  m.def("register_set", &register_set, py::arg("contexts"), py::arg("fragments"),
        py::arg("journal"), py::arg("options"), py::arg("memory"), py::arg("progress"));
}

}  // namespace gpureg::python
