// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/voxel_size.hpp"

#include <cstdio>

#include "cloud.hpp"
#include "fields.hpp"

namespace gpureg::python {

void bind_voxel_size(py::module_& m) {
  using S = VoxelSizeSuggestion;
  py::class_<S>(m, "VoxelSizeSuggestion", "A voxel size that suits a set of clouds.")
      .def_property_readonly(
          "voxel_size", [](const S& s) { return shortest(s.voxel_size); },
          "In the unit of the points; 0 where there is none.")
      .def_property_readonly(
          "reason", [](const S& s) { return to_string(s.reason); },
          "Why there is none; \"none\" where there is one.")
      .def_property_readonly(
          "explanation", [](const S& s) { return explain(s.reason); }, "The reason as a sentence.")
      .def_readonly("spacing", &S::spacing, "Median distance of a point to its nearest neighbour.")
      .def_readonly("noise", &S::noise,
                    "Median distance of points from the plane of their surroundings.")
      .def_readonly("flat", &S::flat,
                    "Most of the clouds are scans of a 2-D scanner; noise is then the distance "
                    "from a line.")
      .def_readonly("points", &S::points, "That a cloud keeps, in the median.")
      .def("__repr__", [](const S& s) {
        if (!s.valid())
          return std::string("<gpureg.VoxelSizeSuggestion none: ") + to_string(s.reason) + ">";
        char text[160];
        std::snprintf(text, sizeof(text),
                      "<gpureg.VoxelSizeSuggestion %.6g, spacing %.4g, noise %.4g, %zu points>",
                      static_cast<double>(s.voxel_size), s.spacing, s.noise, s.points);
        return std::string(text);
      });
  m.def(
      "suggest_voxel_size",
      [](const py::list& clouds) {
        std::vector<FloatArray> held;
        std::vector<PointCloudView> views;
        for (const py::handle cloud : clouds) {
          held.push_back(cloud.cast<FloatArray>());
          const Rows rows = rows_of(held.back(), "points");
          PointCloudView view(rows.data, rows.count);
          view.point_stride = rows.stride;
          views.push_back(view);
        }
        const py::gil_scoped_release release;
        return suggest_voxel_size(views);
      },
      py::arg("clouds"));
  m.def(
      "question_units",
      [](const FloatArray& source, const FloatArray& target, bool failed) {
        const auto view_of = [](const FloatArray& array, const char* name) {
          const Rows rows = rows_of(array, name);
          PointCloudView view(rows.data, rows.count);
          view.point_stride = rows.stride;
          return view;
        };
        const PointCloudView a = view_of(source, "source"), b = view_of(target, "target");
        const py::gil_scoped_release release;
        return question_units(a, b, failed ? kLeastUnitRatio : kSuspectRatio);
      },
      py::arg("source"), py::arg("target"), py::arg("failed"),
      "Asks whether the units differ; empty where the extents do not suggest it.");
}

}  // namespace gpureg::python
