// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/pruning.hpp"

#include <pybind11/numpy.h>

#include "bindings.hpp"
#include "cloud.hpp"

namespace gpureg::python {
namespace {

using Floats = py::array_t<float, py::array::c_style>;

pruning::FeatureView view_of(const Floats& rows, const char* name) {
  if (rows.ndim() != 2) throw py::type_error(std::string(name) + ": not a matrix");
  return {rows.data(), static_cast<std::size_t>(rows.shape(0)),
          static_cast<std::size_t>(rows.shape(1))};
}

pruning::Matrix matrix_from(const Floats& rows, const char* name) {
  const pruning::FeatureView view = view_of(rows, name);
  return {std::vector<float>(view.data, view.data + view.size * view.dimension), view.size,
          view.dimension};
}

Floats learn(const py::list& clouds, std::uint32_t most) {
  std::vector<Floats> kept;
  std::vector<pruning::FeatureView> views;
  for (const py::handle cloud : clouds) {
    kept.push_back(cloud.cast<Floats>());
    views.push_back(view_of(kept.back(), "features"));
  }
  pruning::Matrix words;
  {
    const py::gil_scoped_release release;
    words = pruning::learn_words(views, most);
  }
  Floats out({static_cast<py::ssize_t>(words.rows), static_cast<py::ssize_t>(words.columns)});
  std::copy(words.data.begin(), words.data.end(), out.mutable_data());
  return out;
}

Floats descriptor(const Floats& features, const Floats& words) {
  const std::vector<float> out =
      pruning::describe(view_of(features, "features"), matrix_from(words, "words"));
  return Floats(static_cast<py::ssize_t>(out.size()), out.data());
}

pruning::Summary summary(const Cloud& cloud, const Floats& words) {
  const pruning::Matrix rows = matrix_from(words, "words");
  const py::gil_scoped_release release;
  return pruning::summarize(cloud.prepared, rows);
}

py::array_t<std::int64_t> likely(const std::vector<pruning::Summary>& summaries,
                                 std::uint32_t neighbors, std::uint32_t consecutive) {
  std::vector<Pair> pairs;
  {
    const py::gil_scoped_release release;
    pruning::Options options;
    options.neighbors = neighbors;
    options.consecutive = consecutive;
    pairs = pruning::likely_pairs(summaries, options);
  }
  py::array_t<std::int64_t> out({static_cast<py::ssize_t>(pairs.size()), py::ssize_t(2)});
  std::int64_t* next = out.mutable_data();
  for (const Pair& pair : pairs) {
    *next++ = pair.target;
    *next++ = pair.source;
  }
  return out;
}

}  // namespace

void bind_pruning(py::module_& m) {
  m.def("learn_words", &learn, py::arg("clouds"), py::arg("most"));
  m.def("describe_features", &descriptor, py::arg("features"), py::arg("words"));
  py::class_<pruning::Summary>(m, "CloudSummary")
      .def_property_readonly("descriptor",
                             [](const pruning::Summary& own) {
                               return Floats(static_cast<py::ssize_t>(own.descriptor.size()),
                                             own.descriptor.data());
                             })
      .def("__len__", [](const pruning::Summary& own) { return own.points.size(); });
  m.def("summarize_cloud", &summary, py::arg("cloud"), py::arg("words"));
  m.def("likely_pairs", &likely, py::arg("summaries"), py::arg("neighbors"),
        py::arg("consecutive"));
}

}  // namespace gpureg::python
