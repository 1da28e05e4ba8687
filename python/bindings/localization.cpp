// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/change.hpp"

#include <pybind11/stl.h>

#include <cstdio>
#include <memory>

#include "cloud_input.hpp"
#include "fields.hpp"
#include "fields/localization.hpp"
#include "interrupt.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

using namespace localization;
using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// clouds: one that is in the frame of the map, or scans with their poses, one at a time.
PreparedMap make_map(const Context& context, const py::iterable& clouds, const py::object& poses,
                     const MapOptions& options) {
  MapBuilder builder(options);
  const bool posed = !poses.is_none();
  const DoubleArray array = posed ? poses.cast<DoubleArray>() : DoubleArray();
  std::size_t k = 0;
  for (const py::handle cloud : clouds) {
    const auto parts = cloud.cast<py::tuple>();  // keeps alive what the view points at
    const Input input(parts);
    UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
    if (posed)
      pose.matrix() =
          Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(array.data() + 16 * k);
    ++k;
    interruptible([&] {
      if (posed)
        builder.add_scan(context, input.view, pose);
      else
        builder.add_cloud(input.view);
      return 0;
    });
  }
  return interruptible([&] { return builder.build(); });
}

std::string path_of(const py::object& path) {
  return py::module_::import("os").attr("fspath")(path).cast<std::string>();
}

LocatePrior prior_of(const py::object& up, const py::object& near) {
  LocatePrior prior;
  if (!up.is_none()) {
    const auto parts = up.cast<std::tuple<DoubleArray, DoubleArray, double>>();
    prior.gravity =
        GravityPrior{matrix_of<Eigen::Vector3d>(std::get<0>(parts), "up"),
                     matrix_of<Eigen::Vector3d>(std::get<1>(parts), "up"), std::get<2>(parts)};
  }
  if (!near.is_none()) {
    const auto parts = near.cast<std::pair<DoubleArray, double>>();
    prior.position = PositionPrior{matrix_of<Eigen::Vector3d>(parts.first, "near"), parts.second};
  }
  return prior;
}

std::vector<LocateResult> locate_all(const Context& context, const py::list& scans,
                                     const PreparedMap& map, const LocateOptions options,
                                     const py::object& up, const py::object& near,
                                     const std::vector<std::string>& names) {
  std::vector<PointCloudView> views;
  for (const py::handle scan : scans) views.push_back(Input(scan.cast<py::tuple>()).view);
  const std::vector<LocatePrior> priors(views.size(), prior_of(up, near));
  return interruptible([&] { return locate(context, views, map, options, priors, names); });
}

ChangeResult compare(const Context& context, const py::tuple& scan, const PreparedMap& map,
                     const DoubleArray& pose, const ChangeOptions options) {
  const Input input(scan);
  UnalignedIsometry3d map_from_scan = no_pose();
  map_from_scan.matrix() =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(pose.data());
  return interruptible(
      [&] { return find_changes(context, input.view, map, map_from_scan, options); });
}

py::array_t<std::uint8_t> labels_of(const PointChanges& changes) {
  static_assert(sizeof(ChangeLabel) == 1);
  return py::array_t<std::uint8_t>(static_cast<py::ssize_t>(changes.labels.size()),
                                   reinterpret_cast<const std::uint8_t*>(changes.labels.data()));
}

py::array_t<float> probabilities_of(const PointChanges& changes) {
  return py::array_t<float>(static_cast<py::ssize_t>(changes.probabilities.size()),
                            changes.probabilities.data());
}

void bind_change(py::module_& m) {
  bind_options_class<ChangeOptions>(m);
  using C = ChangeResult;
  py::class_<C>(m, "ChangeResult",
                "Labels of the points of a scan and of a map: rows of CHANGE_LABELS.")
      .def_property_readonly(
          "map_from_scan", [](const C& c) { return array_of(c.map_from_scan.matrix()); },
          "(4, 4) float64: as given, or refined.")
      .def_readonly("inlier_ratio", &C::inlier_ratio,
                    "Share of the scan on surfaces of the map; low: a wrong pose.")
      .def_property_readonly(
          "scan_labels", [](const C& c) { return labels_of(c.scan); },
          "(N,) uint8, of the points of the scan.")
      .def_property_readonly(
          "scan_probabilities", [](const C& c) { return probabilities_of(c.scan); },
          "(N,) float32: that the label is correct.")
      .def_property_readonly(
          "map_labels", [](const C& c) { return labels_of(c.map); },
          "(M,) uint8, of the points of PreparedMap.cloud.")
      .def_property_readonly(
          "map_probabilities", [](const C& c) { return probabilities_of(c.map); },
          "(M,) float32: that the label is correct.")
      .def("__repr__", [](const C& c) {
        char text[128];
        std::snprintf(text, sizeof(text), "<gpureg.ChangeResult, %zu points new, %zu gone>",
                      c.scan.count(ChangeLabel::appeared), c.map.count(ChangeLabel::gone));
        return std::string(text);
      });
  m.def("find_changes", &compare, py::arg("context"), py::arg("scan"), py::arg("map"),
        py::arg("pose"), py::arg("options"));
}

}  // namespace

void bind_localization(py::module_& m) {
  bind_options_class<MapOptions>(m);
  bind_options_class<LocateOptions>(m);

  py::class_<PreparedMap>(m, "PreparedMap", "A map that scans are located in; see prepare_map.")
      .def("__len__", &PreparedMap::size)
      .def_property_readonly("tiles", &PreparedMap::tiles, "Number of tiles.")
      .def_property_readonly(
          "options", [](const PreparedMap& map) { return map.options(); }, "A copy.")
      .def_property_readonly("cloud", &PreparedMap::cloud,
                             "Points, sides of surfaces as normals, sensor positions: a copy.")
      .def(
          "save",
          [](const PreparedMap& map, const py::object& path) {
            const std::string name = path_of(path);
            const py::gil_scoped_release release;
            map.save(name);
          },
          py::arg("path"), "Writes the map into one file, all or nothing. Raises IoError.")
      .def("__repr__", [](const PreparedMap& map) {
        return "<gpureg.PreparedMap of " + std::to_string(map.size()) + " points, " +
               std::to_string(map.tiles()) + " tiles>";
      });

  using P = LocatedPose;
  py::class_<P>(m, "LocatedPose", "A pose of a scan in a map.")
      .def_property_readonly(
          "map_from_scan", [](const P& p) { return array_of(p.map_from_scan.matrix()); },
          "(4, 4) float64: maps points of the scan into the map's frame.")
      .def_readonly("confidence", &P::confidence,
                    "Probability that the pose is correct, in view of all other places.")
      .def_readonly("alias", &P::alias,
                    "The scan fits here about as well as at the first pose, which is elsewhere.")
      .def_readonly("verification", &P::verification,
                    "Against the map around the pose; its confidence leaves other places aside.")
      .def("__repr__", [](const P& p) {
        char text[80];
        std::snprintf(text, sizeof(text), "<gpureg.LocatedPose, confidence %.3f%s>", p.confidence,
                      p.alias ? ", alias" : "");
        return std::string(text);
      });

  using R = LocateResult;
  py::class_<R>(m, "LocateResult", "Where a scan is in a map.")
      .def_property_readonly(
          "status", [](const R& r) { return localization::to_string(r.status); },
          "'found', 'ambiguous' (places that look alike) or 'not_found'.")
      .def_property_readonly(
          "found", [](const R& r) { return r.status == LocateStatus::found; },
          "True where the first pose reaches min_confidence.")
      .def_property_readonly(
          "map_from_scan",
          [](const R& r) {
            return array_of((r.poses.empty() ? no_pose() : r.poses.front().map_from_scan).matrix());
          },
          "(4, 4) float64 of the first pose, NaN without one.")
      .def_readonly("poses", &R::poses, "The most confident first, all of different places.")
      .def_readonly("absent_probability", &R::absent_probability,
                    "Probability that none of the poses is correct: the scan is not in this map, "
                    "or its place was not among the candidates.")
      .def_readonly("scan_points", &R::scan_points, "Prepared points of the scan.")
      .def_property_readonly(
          "stage", [](const R& r) { return localization::to_string(r.stage); },
          "The search that the result comes from; each one runs if the one before is not sure: "
          "'from_above' (scan and map seen from above), 'coarse_tiles' (tiles of the map, in "
          "coarse "
          "voxels), 'tiles' (the best ones, in the voxels of the map).")
      .def_readonly("tiles", &R::tiles, "Tiles that the scan was aligned with.")
      .def_readonly("neighborhood_points", &R::neighborhood_points,
                    "Points of the map around the first pose.")
      .def("__repr__", [](const R& r) {
        char text[96];
        std::snprintf(text, sizeof(text), "<gpureg.LocateResult %s, %zu poses, absent %.3f>",
                      localization::to_string(r.status), r.poses.size(), r.absent_probability);
        return std::string(text);
      });

  m.def(
      "load_map",
      [](const py::object& path) {
        const std::string name = path_of(path);
        const py::gil_scoped_release release;
        return PreparedMap::load(name);
      },
      py::arg("path"),
      "Reads a file of PreparedMap.save(). Raises IoError where it is missing, another kind of "
      "file or version, truncated or damaged.");
  m.def("make_map", &make_map, py::arg("context"), py::arg("clouds"), py::arg("poses"),
        py::arg("options"));
  m.def("locate", &locate_all, py::arg("context"), py::arg("scans"), py::arg("map"),
        py::arg("options"), py::arg("up"), py::arg("near"), py::arg("names"));
  bind_change(m);
}

}  // namespace gpureg::python
