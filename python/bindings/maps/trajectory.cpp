// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/evaluation/trajectory.hpp"

#include <pybind11/stl.h>

#include "fields.hpp"
#include "gpureg/error.hpp"
#include "inputs/map_poses.hpp"
#include "inputs/odometry_file.hpp"
#include "matrix.hpp"
#include "scans.hpp"

namespace gpureg::python {
namespace {

using namespace evaluation;
using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

TrajectoryFormat format_of(const std::string& text) {
  if (text == "auto") return TrajectoryFormat::automatic;
  if (text == "tum") return TrajectoryFormat::tum;
  if (text == "kitti") return TrajectoryFormat::kitti;
  if (text == "poses") return TrajectoryFormat::blocks;
  throw InvalidArgument("format is '" + text + "', expected 'auto', 'tum', 'kitti' or 'poses'");
}

/// (N,) times and (N, 4, 4) poses, in ascending order.
Trajectory trajectory_of(const DoubleArray& times, const DoubleArray& poses) {
  Trajectory out(static_cast<std::size_t>(times.shape(0)));
  for (std::size_t k = 0; k < out.size(); ++k) {
    out[k].time = times.data()[k];
    for (int n = 0; n < 16; ++n)
      out[k].world_from_body(n / 4, n % 4) = poses.data()[16 * k + static_cast<std::size_t>(n)];
  }
  return out;
}

std::vector<Field<ErrorStatistics>> statistics_fields() {
  using S = ErrorStatistics;
  return {field("count", &S::count, "Number of errors."),
          field("rmse", &S::rmse, "Root of the mean of the squares."),
          field("mean", &S::mean, "Mean."),
          field("median", &S::median, "Median."),
          field("deviation", &S::deviation, "Standard deviation."),
          field("min", &S::min, "Smallest."),
          field("max", &S::max, "Largest.")};
}

void bind_evaluation_result(py::module_& m) {
  using E = TrajectoryEvaluation;
  py::class_<E>(m, "TrajectoryEvaluation", "Errors of a trajectory.")
      .def_readonly("estimated", &E::estimated, "Poses of the estimate.")
      .def_readonly("true_poses", &E::true_poses, "Poses of the truth.")
      .def_readonly("matched", &E::matched, "Poses that have a true one.")
      .def_property_readonly(
          "truth_from_estimate", [](const E& e) { return array_of(e.truth_from_estimate); },
          "(4, 4) float64: moves the estimate onto the truth.")
      .def_readonly("path_length", &E::path_length, "Of the matched true poses, metres.")
      .def_readonly("absolute_translation", &E::absolute_translation, "ATE, metres.")
      .def_readonly("absolute_rotation", &E::absolute_rotation, "Degrees.")
      .def_readonly("relative_translation", &E::relative_translation, "RPE, metres.")
      .def_readonly("relative_rotation", &E::relative_rotation, "Degrees.")
      .def("__repr__", [](const E& e) {
        return "<gpureg.TrajectoryEvaluation, " + std::to_string(e.matched) + " poses, ATE " +
               std::to_string(e.absolute_translation.rmse) + " m>";
      });
}

}  // namespace

void bind_trajectory(py::module_& m) {
  bind_record_class<ErrorStatistics>(m, "ErrorStatistics", "Figures of a list of errors.",
                                     statistics_fields());
  bind_evaluation_result(m);
  m.def(
      "read_trajectory",
      [](const std::string& path, const std::string& format) {
        const Trajectory poses = read_trajectory(path, format_of(format));
        const auto size = static_cast<py::ssize_t>(poses.size());
        py::array_t<double> times(size), matrices({size, py::ssize_t(4), py::ssize_t(4)});
        double* next = matrices.mutable_data();
        for (std::size_t k = 0; k < poses.size(); ++k) {
          times.mutable_data()[k] = poses[k].time;
          for (int n = 0; n < 16; ++n) *next++ = poses[k].world_from_body(n / 4, n % 4);
        }
        return py::make_tuple(times, matrices);
      },
      py::arg("path"), py::arg("format"));
  // Of fragments, as the command reads them; `folder` is what messages call their set.
  m.def(
      "read_pose_file",
      [](const std::string& path, const std::vector<int>& numbers,
         const std::vector<std::string>& names, const std::string& folder) {
        const auto map = cli::read_pose_file(path, scans_of(numbers, names), folder);
        py::array_t<double> matrices(
            {static_cast<py::ssize_t>(map.scans.size()), py::ssize_t(4), py::ssize_t(4)});
        double* next = matrices.mutable_data();
        std::vector<std::uint32_t> islands;
        for (const auto& scan : map.scans) {
          const UnalignedIsometry3d pose = scan.placed ? scan.island_from_scan : no_pose();
          for (int n = 0; n < 16; ++n) *next++ = pose.matrix()(n / 4, n % 4);
          islands.push_back(scan.placed ? scan.island : 0);
        }
        return py::make_tuple(matrices, islands);
      },
      py::arg("path"), py::arg("numbers"), py::arg("names"), py::arg("folder"));
  m.def(
      "read_odometry",
      [](const std::string& path, const std::vector<int>& numbers,
         const std::vector<std::string>& names, const std::string& folder) -> py::object {
        const auto known = cli::read_odometry(path, scans_of(numbers, names), folder);
        if (!known.world_from_scan.empty()) return poses_array(known.world_from_scan);
        py::list out;
        for (const auto& edge : known.odometry)
          out.append(py::make_tuple(edge.source, edge.target,
                                    array_of(edge.target_from_source.matrix()), py::none()));
        return out;
      },
      py::arg("path"), py::arg("numbers"), py::arg("names"), py::arg("folder"));
  m.def(
      "evaluate_trajectory",
      [](const DoubleArray& times, const DoubleArray& poses, const DoubleArray& true_times,
         const DoubleArray& true_poses, double max_difference, bool align, double delta,
         const std::string& delta_unit) {
        TrajectoryOptions options;
        options.max_difference = max_difference;
        options.align = align;
        options.delta = delta;
        if (delta_unit != "frames" && delta_unit != "metres")
          throw InvalidArgument("delta_unit is '" + delta_unit +
                                "', expected 'frames' or 'metres'");
        options.delta_unit = delta_unit == "frames" ? DeltaUnit::frames : DeltaUnit::metres;
        return evaluate_trajectory(trajectory_of(times, poses),
                                   trajectory_of(true_times, true_poses), options);
      },
      py::arg("times"), py::arg("poses"), py::arg("true_times"), py::arg("true_poses"),
      py::arg("max_difference"), py::arg("align"), py::arg("delta"), py::arg("delta_unit"));
}

}  // namespace gpureg::python
