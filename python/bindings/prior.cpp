// SPDX-License-Identifier: BSD-3-Clause
#include "prior.hpp"

#include <pybind11/stl.h>

#include <cmath>
#include <cstdio>
#include <optional>

#include "gpureg/error.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

struct PriorParts {
  std::optional<DoubleArray> source_up, target_up, pose;
  double max_angle, max_rotation, max_translation;
};

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", value);
  return text;
}

/// What validate() cannot see, as an isometry has no last row, or does not say: which value it is.
void require_transform(const Eigen::Matrix4d& m) {
  const std::string name = "target_from_source";
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      if (!std::isfinite(m(row, column)))
        throw InvalidArgument(name + "[" + std::to_string(row) + ", " + std::to_string(column) +
                              "] is " + number(m(row, column)) + ", expected a finite number");
  const Eigen::RowVector4d last(0, 0, 0, 1);
  if ((m.row(3) - last).cwiseAbs().maxCoeff() <= 1e-6) return;
  std::string row;
  for (int column = 0; column < 4; ++column) row += (column ? ", " : "") + number(m(3, column));
  const bool transposed = m.col(3) == last.transpose();
  throw InvalidArgument(name + ": its last row is [" + row + "], expected [0, 0, 0, 1]" +
                        (transposed ? "; it looks transposed" : ""));
}

RegistrationPrior prior_of(const PriorParts& parts) {
  RegistrationPrior prior;
  if (parts.source_up.has_value() != parts.target_up.has_value())
    throw py::value_error("source_up, target_up: give both, or none");
  if (parts.source_up)
    prior.gravity =
        GravityPrior{matrix_of<Eigen::Vector3d>(*parts.source_up, "source_up"),
                     matrix_of<Eigen::Vector3d>(*parts.target_up, "target_up"), parts.max_angle};
  if (parts.pose) {
    const auto pose = matrix_of<Eigen::Matrix4d>(*parts.pose, "target_from_source");
    require_transform(pose);
    prior.pose = PosePrior{};
    prior.pose->target_from_source.matrix() = pose;
    prior.pose->max_rotation = parts.max_rotation;
    prior.pose->max_translation = parts.max_translation;
  }
  try {
    prior.validate();
  } catch (const InvalidArgument& error) {
    const std::string message = error.what();
    if (message.find("no rigid motion") == std::string::npos) throw;
    const Eigen::Matrix3d r = prior.pose->target_from_source.linear();
    const double off = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    throw InvalidArgument(message + ": its rotation R has determinant " + number(r.determinant()) +
                          ", and R R' is off the identity by " + number(off));
  }
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
