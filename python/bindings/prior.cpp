// SPDX-License-Identifier: BSD-3-Clause

#include <pybind11/stl.h>

#include <cmath>
#include <cstdio>
#include <optional>

#include "bindings.hpp"
#include "fields.hpp"
#include "gpureg/error.hpp"
#include "gpureg/prior.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

struct PriorParts {
  std::optional<DoubleArray> source_up, target_up, pose;
  std::optional<double> max_angle, max_rotation, max_translation;
};

PriorParts parts_of(const py::kwargs& values) {
  PriorParts parts;
  const std::pair<const char*, std::optional<DoubleArray>*> arrays[] = {
      {"source_up", &parts.source_up},
      {"target_up", &parts.target_up},
      {"target_from_source", &parts.pose}};
  const std::pair<const char*, std::optional<double>*> limits[] = {
      {"max_angle", &parts.max_angle},
      {"max_rotation", &parts.max_rotation},
      {"max_translation", &parts.max_translation}};
  for (const auto& [key, value] : values) {
    const std::string name = py::str(key);
    bool known = false;
    for (const auto& [field, array] : arrays)
      if (name == field) {
        known = true;
        if (value.is_none()) continue;
        *array = DoubleArray::ensure(value);
        if (!**array)
          throw py::type_error(name + ": expected an array of numbers, got " + shown(value));
      }
    for (const auto& [field, limit] : limits)
      if (name == field) {
        known = true;
        *limit = argument<double>(value, name);
      }
    if (!known)
      throw py::type_error("RegistrationPrior has no argument '" + name +
                           "'; it has source_up, target_up, max_angle, target_from_source, "
                           "max_rotation, max_translation");
  }
  return parts;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", value);
  return text;
}

RegistrationPrior prior_of(const PriorParts& parts) {
  RegistrationPrior prior;
  if (parts.source_up.has_value() != parts.target_up.has_value())
    throw py::value_error("source_up, target_up: give both, or none");
  const auto require_no = [](const std::optional<double>& limit, const char* name, const char* of) {
    if (limit)
      throw py::value_error(std::string(name) + " is " + number(*limit) + ", but there is no " +
                            of + " that it limits");
  };
  if (parts.source_up) {
    prior.gravity = GravityPrior{matrix_of<Eigen::Vector3d>(*parts.source_up, "source_up"),
                                 matrix_of<Eigen::Vector3d>(*parts.target_up, "target_up")};
    if (parts.max_angle) prior.gravity->max_angle = *parts.max_angle;
  } else {
    require_no(parts.max_angle, "max_angle", "source_up and target_up");
  }
  if (parts.pose) {
    prior.pose = PosePrior{};
    prior.pose->target_from_source.matrix() =
        matrix_of<Eigen::Matrix4d>(*parts.pose, "target_from_source");
    if (parts.max_rotation) prior.pose->max_rotation = *parts.max_rotation;
    if (parts.max_translation) prior.pose->max_translation = *parts.max_translation;
  } else {
    require_no(parts.max_rotation, "max_rotation", "target_from_source");
    require_no(parts.max_translation, "max_translation", "target_from_source");
  }
  prior.validate();
  return prior;
}

}  // namespace

void bind_prior(py::module_& m) {
  using P = RegistrationPrior;
  py::class_<P>(m, "RegistrationPrior",
                "What is known of a pair's pose beforehand: poses that contradict it are dropped.")
      .def(py::init([](const py::args& positional, const py::kwargs& values) {
             require_no_positional(positional, "RegistrationPrior", "target_from_source");
             return prior_of(parts_of(values));
           }),
           "Keywords: source_up and target_up, max_angle (degrees, 10); target_from_source, "
           "max_rotation (degrees, 30), max_translation (metres, 1).")
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
