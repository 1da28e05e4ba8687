// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/reconstruction.hpp"

#include <pybind11/stl.h>

#include <string>

#include "cloud.hpp"
#include "cloud_input.hpp"
#include "gpureg/error.hpp"
#include "gpureg/reconstruction/mend.hpp"
#include "interrupt.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

using namespace reconstruction;
using IndexArray = py::array_t<std::uint32_t, py::array::c_style>;
using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

std::vector<Pair> pairs_of(const IndexArray& rows) {
  if (rows.ndim() != 2 || rows.shape(1) != 2)
    throw py::type_error("pairs: not a matrix with two columns");
  std::vector<Pair> pairs(static_cast<std::size_t>(rows.shape(0)));
  for (std::size_t k = 0; k < pairs.size(); ++k)
    pairs[k] = {rows.data()[2 * k], rows.data()[2 * k + 1]};
  return pairs;
}

/// poses: (N, 4, 4), NaN where a scan has none.
std::vector<UnalignedIsometry3d> poses_of(const DoubleArray& poses) {
  std::vector<UnalignedIsometry3d> out(static_cast<std::size_t>(poses.shape(0)));
  for (std::size_t k = 0; k < out.size(); ++k)
    for (int n = 0; n < 16; ++n)
      out[k].matrix()(n / 4, n % 4) = poses.data()[16 * k + static_cast<std::size_t>(n)];
  return out;
}

/// (N, 4, 4) poses, NaN where not known, or (source, target, pose, information or None) of each.
std::vector<Odometry> odometry_of(const py::object& given) {
  std::vector<Odometry> out;
  if (py::isinstance<py::array>(given)) {
    return odometry_of_poses(poses_of(given.cast<DoubleArray>()));
  }
  const auto items = given.cast<py::list>();
  for (const py::handle item : items) {
    const auto parts = item.cast<py::tuple>();
    Odometry edge;
    edge.source = parts[0].cast<std::uint32_t>();
    edge.target = parts[1].cast<std::uint32_t>();
    edge.target_from_source.matrix() =
        matrix_of<Eigen::Matrix4d>(parts[2].cast<DoubleArray>(), "odometry");
    if (!parts[3].is_none())
      edge.information = matrix_of<Eigen::Matrix<double, 6, 6>>(parts[3].cast<DoubleArray>(),
                                                                "odometry information");
    out.push_back(edge);
  }
  return out;
}

std::vector<PreparedCloud> prepared_of(const py::list& clouds) {
  std::vector<PreparedCloud> out;
  for (const py::handle cloud : clouds) out.push_back(cloud.cast<const Cloud&>().prepared);
  return out;
}

py::array_t<double> poses_array(const std::vector<UnalignedIsometry3d>& poses) {
  py::array_t<double> out({static_cast<py::ssize_t>(poses.size()), py::ssize_t(4), py::ssize_t(4)});
  double* next = out.mutable_data();
  for (const UnalignedIsometry3d& pose : poses)
    for (int k = 0; k < 16; ++k) *next++ = pose.matrix()(k / 4, k % 4);
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

/// clouds: of the pairs, audited; none: not audited.
/// @return the map, its audit or None, and whether places look alike.
py::tuple reconstruct_of(std::size_t scans, const IndexArray& rows, const py::list& results,
                         const Options options, const py::object& odometry, const Context& context,
                         const py::list& clouds, const RegistrationOptions registration,
                         const AuditOptions audit_options) {
  const std::vector<PreparedCloud> prepared = prepared_of(clouds);
  const std::vector<Pair> pairs = pairs_of(rows);
  std::vector<RegistrationResult> values;
  for (const py::handle result : results)
    values.push_back(result.cast<const RegistrationResult&>());
  const std::vector<Odometry> known = odometry_of(odometry);
  if (!prepared.empty()) {
    AuditedReconstruction out = interruptible([&] {
      return reconstruct(context, prepared, pairs, values, options, known, registration,
                         audit_options);
    });
    return py::make_tuple(std::move(out.map), std::move(out.audit), out.places_look_alike);
  }
  Reconstruction map =
      interruptible([&] { return reconstruct_from_poses(scans, pairs, values, options, known); });
  return py::make_tuple(std::move(map), py::none(), false);
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

Surface surface_of_input(const Context& context, const py::tuple& cloud,
                         const PrepareOptions registration) {
  const Input input(cloud);
  const py::gil_scoped_release release;
  return surface_of(context, input.view, registration);
}

/// surfaces: None for scans that are left out. tell: called with the number of each iteration.
py::dict refine_map(const Context& context, Reconstruction& map, const py::list& given,
                    double voxel_size, const py::object& tell) {
  std::vector<Surface> surfaces;
  for (const py::handle surface : given)
    surfaces.push_back(surface.is_none() ? Surface{} : surface.cast<const Surface&>());
  reconstruction::RefineOptions options =
      reconstruction::RefineOptions::for_depth_cameras(static_cast<float>(voxel_size));
  options.threads = static_cast<int>(context.backend() == Backend::cpu ? context.threads() : 0);
  std::exception_ptr failed;
  options.should_stop = [&](int iteration) {
    const py::gil_scoped_acquire acquire;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (!tell.is_none()) tell(iteration + 1);
    } catch (...) {
      failed = std::current_exception();
    }
    return failed != nullptr;
  };
  Reconstruction refined = map;  // which another thread may read meanwhile
  RefineReport report;
  {
    const py::gil_scoped_release release;
    report = refine(context, surfaces, refined, options);
  }
  map = std::move(refined);
  if (failed) std::rethrow_exception(failed);
  return report_of(report);
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

/// The result of a pair of which a table holds the pose, the score and the information only.
RegistrationResult result_of_row(bool aligned, const py::object& pose, double score,
                                 const py::object& information) {
  RegistrationResult result;
  result.status = aligned ? RegistrationStatus::aligned : RegistrationStatus::not_aligned;
  result.reason = aligned ? RegistrationReason::none : RegistrationReason::confidence_too_low;
  result.score = score;
  if (pose.is_none()) return result;
  result.has_candidate = true;
  result.target_from_source.matrix() =
      matrix_of<Eigen::Matrix4d>(pose.cast<DoubleArray>(), "target_from_source");
  if (!information.is_none())
    result.source_moments = CorrespondenceMoments::from_redwood(
        matrix_of<Eigen::Matrix<double, 6, 6>>(information.cast<DoubleArray>(), "information"));
  return result;
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
                             [](const Reconstruction& map) { return lists_of(map.islands); });
  m.def("reconstruct_map", &reconstruct_of, py::arg("scans"), py::arg("pairs"), py::arg("results"),
        py::arg("options"), py::arg("odometry"), py::arg("context"), py::arg("clouds"),
        py::arg("registration"), py::arg("audit_options"));
  bind_audit(m);
  m.def("refine_map", &refine_map, py::arg("context"), py::arg("map"), py::arg("surfaces"),
        py::arg("voxel_size"), py::arg("tell"));
  py::class_<Surface>(m, "Surface", "Points of a scan with their normals.");
  m.def("surface_of", &surface_of_input, py::arg("context"), py::arg("cloud"),
        py::arg("registration"));
  m.def("surface_options", &surface_options, py::arg("registration"));
  m.def("result_of_row", &result_of_row, py::arg("aligned"), py::arg("target_from_source"),
        py::arg("score"), py::arg("information"));
  m.attr("REFINE_ITERATIONS") = reconstruction::RefineOptions{}.iterations;
  bind_voxel_map(m);
}

}  // namespace gpureg::python
