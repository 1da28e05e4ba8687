// SPDX-License-Identifier: BSD-3-Clause
#include "prior.hpp"

#include <pybind11/stl.h>

#include <optional>

#include "matrix.hpp"

namespace gpureg::python {
namespace {

using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

struct PriorParts {
  std::optional<DoubleArray> source_up, target_up, pose;
  double max_angle, max_rotation, max_translation;
};

RegistrationPrior prior_of(const PriorParts& parts) {
  RegistrationPrior prior;
  if (parts.source_up.has_value() != parts.target_up.has_value())
    throw py::value_error("source_up, target_up: give both, or none");
  if (parts.source_up)
    prior.gravity =
        GravityPrior{matrix_of<Eigen::Vector3d>(*parts.source_up, "source_up"),
                     matrix_of<Eigen::Vector3d>(*parts.target_up, "target_up"), parts.max_angle};
  if (parts.pose) {
    prior.pose = PosePrior{};
    prior.pose->target_from_source.matrix() =
        matrix_of<Eigen::Matrix4d>(*parts.pose, "target_from_source");
    prior.pose->max_rotation = parts.max_rotation;
    prior.pose->max_translation = parts.max_translation;
  }
  prior.validate();
  return prior;
}

}  // namespace

RegistrationPrior in_prepared_frames(RegistrationPrior prior, const Cloud& source,
                                     const Cloud& target) {
  if (prior.pose)
    prior.pose->target_from_source.translation() =
        prior.pose->target_from_source * source.origin - target.origin;
  return prior;
}

void bind_prior(py::module_& m) {
  using P = RegistrationPrior;
  const GravityPrior gravity;
  const PosePrior pose;
  py::class_<P>(m, "RegistrationPrior",
                "What is known of a pair's pose beforehand: poses that contradict it are dropped.")
      .def(py::init([](std::optional<DoubleArray> source_up, std::optional<DoubleArray> target_up,
                       double max_angle, std::optional<DoubleArray> target_from_source,
                       double max_rotation, double max_translation) {
             return prior_of({source_up, target_up, target_from_source, max_angle, max_rotation,
                              max_translation});
           }),
           py::kw_only(), py::arg("source_up") = py::none(), py::arg("target_up") = py::none(),
           py::arg("max_angle") = gravity.max_angle, py::arg("target_from_source") = py::none(),
           py::arg("max_rotation") = pose.max_rotation,
           py::arg("max_translation") = pose.max_translation)
      .def("__repr__", [](const P& p) {
        return std::string("<gpureg.RegistrationPrior of ") +
               (p.empty()             ? "nothing"
                : p.gravity && p.pose ? "gravity and pose"
                : p.pose              ? "pose"
                                      : "gravity") +
               ">";
      });
}

}  // namespace gpureg::python
