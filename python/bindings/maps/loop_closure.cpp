// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/loop_closure.hpp"

#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <algorithm>

#include "cloud.hpp"
#include "common/stop_scope.hpp"
#include "gpureg/error.hpp"
#include "interrupt.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

using namespace loop_closure;
using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

UnalignedIsometry3d pose_of(const DoubleArray& array, const char* name) {
  UnalignedIsometry3d pose;
  pose.matrix() = matrix_of<Eigen::Matrix4d>(array, name);
  return pose;
}

std::optional<UnalignedMatrix6d> matrix6_of(const py::object& value, const char* name) {
  if (value.is_none()) return std::nullopt;
  return UnalignedMatrix6d(matrix_of<Eigen::Matrix<double, 6, 6>>(value.cast<DoubleArray>(), name));
}

void add(LoopCloser& closer, FragmentId id, const py::object& cloud, const py::object& pose,
         std::int64_t session, double time, const py::object& up) {
  Fragment fragment;
  fragment.id = id;
  fragment.session = session;
  fragment.time = time;
  if (!cloud.is_none()) fragment.cloud = cloud.cast<const Cloud&>().prepared;
  if (!pose.is_none())
    fragment.world_from_fragment = pose_of(pose.cast<DoubleArray>(), "world_from_fragment");
  if (!up.is_none()) fragment.up = matrix_of<Eigen::Vector3d>(up.cast<DoubleArray>(), "up");
  const py::gil_scoped_release release;
  closer.add(fragment);
}

Update process(LoopCloser& closer, std::optional<double> milliseconds,
               std::optional<std::size_t> registrations) {
  ProcessLimits limits;
  limits.milliseconds = milliseconds;
  limits.registrations = registrations;
  // It throws: a call that is interrupted reports nothing, and the next one all.
  limits.should_stop = [] {
    StopScope::poll_now();
    return false;
  };
  return interruptible([&] { return closer.process(limits); });
}

py::dict poses_of(const std::vector<FragmentPose>& poses) {
  py::dict out;
  for (const FragmentPose& pose : poses)
    out[py::int_(pose.id)] = array_of(pose.world_from_fragment.matrix());
  return out;
}

void bind_loop(py::module_& m) {
  py::class_<Loop>(m, "Loop", "A loop of two fragments.")
      .def_readonly("source", &Loop::source)
      .def_readonly("target", &Loop::target)
      .def_readonly("from_host", &Loop::from_host)
      .def_property_readonly("state", [](const Loop& l) { return to_string(l.state); })
      .def_property_readonly("reason", [](const Loop& l) { return to_string(l.reason); })
      .def_property_readonly("explanation", [](const Loop& l) { return describe(l.reason); })
      .def_property_readonly("target_from_source",
                             [](const Loop& l) { return array_of(l.target_from_source.matrix()); })
      .def_property_readonly("information", [](const Loop& l) { return array_of(l.information); })
      .def_readonly("confidence", &Loop::confidence)
      .def_readonly("weight", &Loop::weight)
      .def_readonly("drift_ratio", &Loop::drift_ratio)
      .def("__repr__", [](const Loop& l) {
        return "<gpureg.Loop " + std::to_string(l.source) + " -> " + std::to_string(l.target) +
               ", " + to_string(l.state) + ", " + to_string(l.reason) + ">";
      });
  py::class_<Update>(m, "LoopUpdate", "What one process() did.")
      .def_readonly("changed", &Update::changed)
      .def_property_readonly("poses", [](const Update& u) { return poses_of(u.poses); })
      .def_readonly("registered", &Update::registered)
      .def_readonly("proposals_left", &Update::proposals_left)
      .def_property_readonly("status",
                             [](const Update& u) { return pose_graph::to_string(u.status); })
      .def_readonly("reason", &Update::reason)
      .def("__repr__", [](const Update& u) {
        return "<gpureg.LoopUpdate, " + std::to_string(u.changed.size()) + " changed>";
      });
}

}  // namespace

void bind_loop_closure(py::module_& m) {
  bind_loop(m);
  py::class_<LoopCloser>(m, "LoopCloser", "Loops for a SLAM system.")
      .def(py::init<const Context&, const Options&>(), py::arg("context"), py::arg("options"))
      .def("add", &add, py::arg("id"), py::arg("cloud"), py::arg("world_from_fragment"),
           py::arg("session"), py::arg("time"), py::arg("up"))
      .def(
          "add_odometry",
          [](LoopCloser& c, FragmentId source, FragmentId target, const DoubleArray& pose,
             const py::object& covariance) {
            c.add_odometry(source, target, pose_of(pose, "target_from_source"),
                           matrix6_of(covariance, "covariance"));
          },
          py::arg("source"), py::arg("target"), py::arg("target_from_source"),
          py::arg("covariance"))
      .def("set_covisible", &LoopCloser::set_covisible, py::arg("id"), py::arg("others"))
      .def(
          "propose",
          [](LoopCloser& c, FragmentId source, FragmentId target,
             const std::optional<RegistrationPrior>& prior) { c.propose(source, target, prior); },
          py::arg("source"), py::arg("target"), py::arg("prior"))
      .def(
          "add_loop",
          [](LoopCloser& c, FragmentId source, FragmentId target, const DoubleArray& pose,
             const py::object& information, double confidence) {
            c.add_loop(source, target, pose_of(pose, "target_from_source"),
                       matrix6_of(information, "information"), confidence);
          },
          py::arg("source"), py::arg("target"), py::arg("target_from_source"),
          py::arg("information"), py::arg("confidence"))
      .def("add_result", &LoopCloser::add_result, py::arg("source"), py::arg("target"),
           py::arg("result"))
      .def(
          "set_poses",
          [](LoopCloser& c, const py::dict& poses) {
            std::vector<FragmentPose> list;
            for (const auto& [id, pose] : poses)
              list.push_back(
                  {id.cast<FragmentId>(),
                   pose_of(py::reinterpret_borrow<py::object>(pose).cast<DoubleArray>(), "poses"),
                   0});
            c.set_poses(list);
          },
          py::arg("poses"))
      .def("remove", &LoopCloser::remove, py::arg("id"))
      .def("process", &process, py::arg("milliseconds"), py::arg("registrations"))
      .def_property_readonly("poses", [](const LoopCloser& c) { return poses_of(c.poses()); })
      .def_property_readonly("frames",
                             [](const LoopCloser& c) {
                               py::dict out;
                               for (const FragmentPose& pose : c.poses())
                                 out[py::int_(pose.id)] = pose.frame;
                               return out;
                             })
      .def_property_readonly("loops", [](const LoopCloser& c) { return c.loops(); })
      .def("graph", &LoopCloser::graph)
      .def(
          "save",
          [](const LoopCloser& c, const std::string& path) {
            interruptibly([&] { c.save(path); });
          },
          py::arg("path"))
      .def(
          "load",
          [](LoopCloser& c, const std::string& path, const py::object& clouds) {
            // process() asks for Python's lock while it holds its own: never the other way round.
            interruptibly([&] {
              c.load(path, [&](FragmentId id) {
                const py::gil_scoped_acquire acquire;
                return clouds(id).cast<const Cloud&>().prepared;
              });
            });
          },
          py::arg("path"), py::arg("clouds"))
      .def("__len__", &LoopCloser::size);
}

}  // namespace gpureg::python
