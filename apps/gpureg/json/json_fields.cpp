// SPDX-License-Identifier: BSD-3-Clause
#include "json/json_fields.hpp"

#include <Eigen/LU>
#include <cmath>
#include <cstdint>
#include <limits>

namespace gpureg::cli {
namespace {

[[noreturn]] void fail(const char* name, const Json& value, const char* expected) {
  throw InvalidArgument(std::string("\"") + name + "\" is " +
                        value.dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 60) +
                        ", expected " + expected);
}

}  // namespace

const Json& member(const Json& object, const char* name) {
  if (!object.is_object()) throw InvalidArgument("it is no object");
  const auto found = object.find(name);
  if (found == object.end()) throw InvalidArgument(std::string("it lacks \"") + name + "\"");
  return *found;
}

std::string text_member(const Json& object, const char* name) {
  const Json& value = member(object, name);
  if (!value.is_string()) fail(name, value, "a text");
  return value.get<std::string>();
}

int fragment_member(const Json& object, const char* name) {
  constexpr std::int64_t kMost = std::numeric_limits<int>::max();
  const Json& value = member(object, name);
  if (!value.is_number_integer() || value.get<std::int64_t>() < 0 ||
      value.get<std::int64_t>() > kMost)
    fail(name, value, "the number of a fragment");
  return value.get<int>();
}

std::string text_of(const Json& json, const char* pointer) {
  const Json::json_pointer at(pointer);
  if (!json.contains(at)) return "";
  const Json& value = json.at(at);
  return value.is_string() ? value.get<std::string>() : value.dump();
}

double finite_number(const Json& value, const char* name) {
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    fail(name, value, "a finite number");
  return value.get<double>();
}

double number_or_nan(const Json& value, const char* name) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : finite_number(value, name);
}

Eigen::Matrix4d rigid_motion(const Json& array, const char* name) {
  // As for Redwood's logs: it only tells poses from other numbers.
  constexpr double kTolerance = 0.02;
  const Eigen::Matrix4d pose = square_matrix<4>(array, name);
  const Eigen::Matrix3d r = pose.topLeftCorner<3, 3>();
  if ((r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kTolerance ||
      r.determinant() < 0 ||
      (pose.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6)
    throw InvalidArgument(std::string("\"") + name + "\" is no rigid motion");
  return pose;
}

}  // namespace gpureg::cli
