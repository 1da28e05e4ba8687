// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/evaluation.hpp"

#include <pybind11/stl.h>

#include "matrix.hpp"

namespace gpureg::python {
namespace {

using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

template <typename Entry, typename Matrix>
std::vector<Entry> entries_of(const py::list& list, Matrix Entry::* matrix, const char* name) {
  std::vector<Entry> entries;
  for (const py::handle item : list) {
    const auto parts = item.cast<py::tuple>();
    if (parts.size() != 4) throw py::type_error("an entry is (i, j, count, matrix)");
    Entry entry;
    entry.i = parts[0].cast<int>();
    entry.j = parts[1].cast<int>();
    entry.count = parts[2].cast<int>();
    entry.*matrix = matrix_of<Matrix>(parts[3].cast<DoubleArray>(), name);
    entries.push_back(entry);
  }
  return entries;
}

py::dict dict_of(const evaluation::Scores& s) {
  py::dict out;
  out["recall"] = s.recall();
  out["precision"] = s.precision();
  out["good"] = s.good;
  out["good_recall"] = s.good_recall;
  out["ground_truth"] = s.ground_truth;
  out["reported"] = s.reported;
  return out;
}

}  // namespace

void bind_evaluation(py::module_& m) {
  using evaluation::InformationEntry;
  using evaluation::LogEntry;
  m.def(
      "write_log",
      [](const std::string& path, const py::list& list) {
        const auto entries = entries_of(list, &LogEntry::transform, "transform");
        const py::gil_scoped_release release;
        evaluation::write_log(path, entries);
      },
      py::arg("path"), py::arg("entries"));
  m.def(
      "write_information",
      [](const std::string& path, const py::list& list) {
        const auto entries = entries_of(list, &InformationEntry::information, "information");
        const py::gil_scoped_release release;
        evaluation::write_information(path, entries);
      },
      py::arg("path"), py::arg("entries"));
  m.def(
      "read_log",
      [](const std::string& path) {
        py::list out;
        for (const LogEntry& e : evaluation::read_log(path))
          out.append(py::make_tuple(e.i, e.j, e.count, array_of(e.transform)));
        return out;
      },
      py::arg("path"));
  m.def(
      "evaluate",
      [](const std::string& folder, const py::list& list) {
        std::vector<evaluation::Report> reports;
        for (const LogEntry& e : entries_of(list, &LogEntry::transform, "transform")) {
          evaluation::Report report;
          report.i = e.i;
          report.j = e.j;
          report.transform = e.transform;
          reports.push_back(report);
        }
        return dict_of(
            evaluation::evaluate(evaluation::read_ground_truth(folder), reports, false).strict);
      },
      py::arg("folder"), py::arg("reports"));
}

}  // namespace gpureg::python
