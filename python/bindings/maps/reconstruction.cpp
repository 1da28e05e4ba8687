// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/reconstruction.hpp"

#include <pybind11/stl.h>

#include <string>

#include "cloud.hpp"
#include "cloud_input.hpp"
#include "gpureg/error.hpp"
#include "gpureg/reconstruction/mend.hpp"
#include "gpureg/reconstruction/reconstruct.hpp"
#include "gpureg/reconstruction/scales.hpp"
#include "interrupt.hpp"
#include "maps/python_set.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

using namespace reconstruction;
using IndexArray = py::array_t<std::uint32_t, py::array::c_style>;
using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// poses: (N, 4, 4), NaN where a scan has none.
std::vector<UnalignedIsometry3d> poses_of(const DoubleArray& poses) {
  std::vector<UnalignedIsometry3d> out(static_cast<std::size_t>(poses.shape(0)));
  for (std::size_t k = 0; k < out.size(); ++k)
    for (int n = 0; n < 16; ++n)
      out[k].matrix()(n / 4, n % 4) = poses.data()[16 * k + static_cast<std::size_t>(n)];
  return out;
}

/// (N, 4, 4) poses, NaN where not known, or (source, target, pose, information or None) of each.
void set_odometry(const py::object& given, MapInput& input) {
  if (py::isinstance<py::array>(given)) {
    input.world_from_scan = poses_of(given.cast<DoubleArray>());
    return;
  }
  for (const py::handle item : given.cast<py::list>()) {
    const auto parts = item.cast<py::tuple>();
    Odometry edge;
    edge.source = parts[0].cast<std::uint32_t>();
    edge.target = parts[1].cast<std::uint32_t>();
    edge.target_from_source.matrix() =
        matrix_of<Eigen::Matrix4d>(parts[2].cast<DoubleArray>(), "odometry");
    if (!parts[3].is_none())
      edge.information = matrix_of<Eigen::Matrix<double, 6, 6>>(parts[3].cast<DoubleArray>(),
                                                                "odometry information");
    input.odometry.push_back(edge);
  }
}

std::vector<PreparedCloud> prepared_of(const py::list& clouds) {
  std::vector<PreparedCloud> out;
  for (const py::handle cloud : clouds) out.push_back(cloud.cast<const Cloud&>().prepared);
  return out;
}

std::vector<std::vector<std::uint32_t>> lists_of(const std::vector<Island>& islands) {
  std::vector<std::vector<std::uint32_t>> out;
  for (const Island& island : islands) out.push_back(island.scans);
  return out;
}

/// islands: of each scan.
Audit audit_of(const Context& context, const py::list& clouds, const DoubleArray& poses,
               const std::vector<std::uint32_t>& islands, const RegistrationOptions options,
               const AuditOptions audit_options) {
  const std::vector<PreparedCloud> prepared = prepared_of(clouds);
  const Reconstruction map = map_of_poses(poses_of(poses), islands);
  return interruptible([&] { return audit(context, prepared, map, options, audit_options); });
}

py::tuple mend_of(const Context& context, const py::list& clouds, const DoubleArray& poses,
                  const std::vector<std::uint32_t>& islands, const Audit& found,
                  const RegistrationOptions options, const AuditOptions audit_options) {
  const std::vector<PreparedCloud> prepared = prepared_of(clouds);
  const Reconstruction map = map_of_poses(poses_of(poses), islands);
  const MendedMap mended =
      interruptible([&] { return mend(context, prepared, map, found, options, audit_options); });
  return py::make_tuple(poses_array(mended.world_from_scan), mended.moved, mended.left_out,
                        mended.registered, mended.audit);
}

void bind_audit(py::module_& m) {
  py::class_<Audit>(m, "AuditRecord", "What the scans of a map say about it.")
      .def_property_readonly(
          "pairs",
          [](const Audit& audit) {
            py::list pairs;
            for (const AuditedPair& pair : audit.pairs)
              pairs.append(py::make_tuple(pair.source, pair.target, to_string(pair.verdict),
                                          pair.log_likelihood_ratio, pair.overlap, pair.observed,
                                          pair.violation, pair.shift));
            return pairs;
          })
      .def_property_readonly("connections",
                             [](const Audit& audit) {
                               py::list out;
                               for (const AuditedConnection& c : audit.connections)
                                 out.append(py::make_tuple(
                                     to_string(c.verdict), c.confidence, c.supporting,
                                     c.contradicting, c.contradictions, c.island, c.first, c.size));
                               return out;
                             })
      .def_readonly("order", &Audit::order)
      .def_property_readonly("islands", [](const Audit& audit) { return lists_of(audit.islands); })
      .def_property_readonly("verdicts",
                             [](const Audit& audit) {
                               std::vector<std::string> out;
                               for (const AuditVerdict verdict : audit.verdicts())
                                 out.emplace_back(to_string(verdict));
                               return out;
                             })
      .def_property_readonly("verdict",
                             [](const Audit& audit) { return to_string(audit.verdict()); });
  m.def("audit", &audit_of, py::arg("context"), py::arg("clouds"), py::arg("poses"),
        py::arg("islands"), py::arg("options"), py::arg("audit_options"));
  m.def("mend", &mend_of, py::arg("context"), py::arg("clouds"), py::arg("poses"),
        py::arg("islands"), py::arg("found"), py::arg("options"), py::arg("audit_options"));
}

py::dict report_of(const RefineReport& report) {
  py::dict out;
  out["pairs"] = report.pairs;
  out["correspondences"] = report.correspondences;
  out["iterations"] = report.iterations;
  out["rejected_edges"] = report.rejected_edges;
  out["initial_rmse"] = report.initial_rmse;
  out["final_rmse"] = report.final_rmse;
  out["solved"] = report.solved;
  return out;
}

/// [(scale, part)] of each fragment. progress: called with (done, total).
std::vector<std::pair<double, std::uint32_t>> scales_of(
    const Context& context, const PythonSet& set, double least, double most,
    const RegistrationOptions options, const std::string& journal, const py::object& progress) {
  Teller tell(progress);
  ScaleSearch search;
  search.range = {least, most};
  search.journal = journal;
  search.on_progress = [&](std::size_t done, std::size_t total) { tell(done, total); };
  search.should_stop = [&] { return !tell.check(); };
  std::vector<std::pair<double, std::uint32_t>> out;
  tell.run([&] {
    for (const ScanScale& scan : find_scales(context, set, options, search).scans)
      out.emplace_back(scan.scale, scan.part);
  });
  return out;
}

/// results: of the pairs; None: they are aligned. scales: of each fragment; None: 1. progress:
/// called with (step, done, total).
py::dict reconstruct_set(const Context& context, const PythonSet& set,
                         const std::optional<IndexArray>& pairs,
                         const std::optional<std::vector<RegistrationResult>>& results,
                         const py::object& odometry, const MapOptions options,
                         const std::optional<std::vector<double>>& scales,
                         const py::object& progress) {
  MapInput input;
  if (pairs) input.pairs = pairs_of(*pairs);
  input.results = results;
  set_odometry(odometry, input);
  Teller tell(progress);
  MapCallbacks callbacks;
  callbacks.on_progress = [&](MapStep step, std::size_t done, std::size_t total) {
    tell(static_cast<int>(step), done, total);
  };
  callbacks.should_stop = [&] { return !tell.check(); };
  MapOfSet made;
  py::dict out;
  if (scales) {
    ScaledMapOfSet scaled;
    tell.run(
        [&] { scaled = reconstruct_scaled(context, set, *scales, input, options, callbacks); });
    out["scales"] = scaled.scales;
    made = std::move(scaled.made);
  } else {
    tell.run([&] { made = reconstruct(context, set, input, options, callbacks); });
  }
  out["scans"] = made.scans;
  out["unusable"] = dict_of(made.unusable);
  out["map"] = std::move(made.map);
  out["audit"] = made.audit ? py::cast(std::move(*made.audit)) : py::none();
  out["places_look_alike"] = made.places_look_alike;
  out["refinement"] = made.refinement ? py::object(report_of(*made.refinement)) : py::none();
  if (made.journal) made.journal->remove();
  return out;
}

/// Options of the Python function of that name.
MapOptions map_options(const RegistrationOptions& registration, const Options& graph,
                       const AuditOptions& audit, bool with_audit, bool with_refinement,
                       const std::string& journal) {
  MapOptions options{registration};
  options.graph = graph;
  options.audit = audit;
  options.with_audit = with_audit;
  options.with_refinement = with_refinement;
  options.journal = journal;
  return options;
}

py::list scans_list(const Reconstruction& map) {
  py::list out;
  for (const Scan& scan : map.scans) {
    const py::object island = scan.placed ? py::object(py::int_(scan.island)) : py::none();
    out.append(py::make_tuple(scan.placed, island, scan.confidence, to_string(scan.reason),
                              describe(scan.reason)));
  }
  return out;
}

py::list edges_list(const Reconstruction& map) {
  py::list out;
  for (const Edge& edge : map.edges)
    out.append(py::make_tuple(edge.source, edge.target, array_of(edge.target_from_source.matrix()),
                              edge.confidence, edge.map_confidence, edge.weight, edge.accepted,
                              to_string(edge.reason), edge.mode, array_of(edge.information)));
  return out;
}

py::list links_list(const Reconstruction& map) {
  py::list out;
  for (const Link& link : weakest_links(map))
    out.append(py::make_tuple(link.scans, link.confidence, link.accepted, link.rejected));
  return out;
}

void bind_voxel_map(py::module_& m) {
  py::class_<VoxelMap>(m, "VoxelMap", "Points of scans averaged per voxel.")
      .def(py::init<float>(), py::arg("voxel_size"))
      .def(
          "add",
          [](VoxelMap& map, const py::array_t<float, py::array::c_style>& points,
             const py::object& normals, const DoubleArray& origin, const DoubleArray& pose) {
            PointCloudView view;
            const auto rows = [](const py::array_t<float, py::array::c_style>& array) {
              if (array.ndim() != 2 || array.shape(1) != 3)
                throw py::type_error("not a matrix with three columns");
              return static_cast<std::size_t>(array.shape(0));
            };
            view.size = rows(points);
            view.points = points.data();
            py::array_t<float, py::array::c_style> directions;
            if (!normals.is_none()) {
              directions = normals.cast<py::array_t<float, py::array::c_style>>();
              if (rows(directions) != view.size) throw py::type_error("normals: another number");
              view.normals = directions.data();
            }
            const auto shift = matrix_of<Eigen::Vector3d>(origin, "origin");
            for (int k = 0; k < 3; ++k) view.origin[k] = shift[k];
            UnalignedIsometry3d map_from_scan;
            map_from_scan.matrix() = matrix_of<Eigen::Matrix4d>(pose, "map_from_scan");
            const py::gil_scoped_release release;
            map.add(view, map_from_scan);
          },
          py::arg("points"), py::arg("normals"), py::arg("origin"), py::arg("map_from_scan"))
      .def("cloud", [](const VoxelMap& map) {
        const PointCloud cloud = map.cloud();
        const py::object normals =
            cloud.normals.empty() ? py::object(py::none()) : py::object(array_of(cloud.normals));
        return py::make_tuple(in_frame(cloud.points, cloud.origin), normals);
      });
}

}  // namespace

void bind_reconstruction(py::module_& m) {
  py::class_<Reconstruction>(m, "MapGraph", "Scans, edges and islands of a map.")
      .def_property_readonly("poses",
                             [](const Reconstruction& map) {
                               std::vector<UnalignedIsometry3d> poses;
                               for (const Scan& scan : map.scans)
                                 poses.push_back(scan.placed ? scan.island_from_scan : no_pose());
                               return poses_array(poses);
                             })
      .def_property_readonly("scans", &scans_list)
      .def_property_readonly("edges", &edges_list)
      .def_property_readonly("links", &links_list)
      .def_property_readonly("islands",
                             [](const Reconstruction& map) { return lists_of(map.islands); })
      .def_property_readonly("agreement", [](const Reconstruction& map) {
        const Agreement& of = map.agreement;
        return py::make_tuple(of.contradicted, of.edges_per_scan, of.jumps);
      });
  py::class_<MapOptions>(m, "ReconstructOptions", "All options of a map of a set.")
      .def(py::init(&map_options), py::arg("registration"), py::arg("graph"), py::arg("audit"),
           py::arg("with_audit"), py::arg("with_refinement"), py::arg("journal"));
  m.def("reconstruct_set", &reconstruct_set, py::arg("context"), py::arg("fragments"),
        py::arg("pairs"), py::arg("results"), py::arg("odometry"), py::arg("options"),
        py::arg("scales"), py::arg("progress"));
  m.def("find_scales", &scales_of, py::arg("context"), py::arg("fragments"), py::arg("least"),
        py::arg("most"), py::arg("options"), py::arg("journal"), py::arg("progress"));
  bind_audit(m);
  bind_voxel_map(m);
}

}  // namespace gpureg::python
