// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/evaluation/surface_error.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "evaluation/nearest_point.hpp"
#include "evaluation/statistics.hpp"
#include "gpureg/error.hpp"

namespace gpureg::evaluation {

void SurfaceOptions::validate() const {
  if (!(std::isfinite(plane_reach) && plane_reach >= 0))
    throw InvalidArgument("plane_reach is " + std::to_string(plane_reach) +
                          ", expected 0 or more metres");
  if (!(std::isfinite(max_distance) && max_distance > 0))
    throw InvalidArgument("max_distance is " + std::to_string(max_distance) +
                          ", expected more than 0 metres");
}

SurfaceEvaluation evaluate_surface(const std::vector<Eigen::Vector3f>& map,
                                   const std::vector<Eigen::Vector3f>& true_points,
                                   const std::vector<Eigen::Vector3f>& true_normals,
                                   const SurfaceOptions& options) {
  options.validate();
  if (!true_normals.empty() && true_normals.size() != true_points.size())
    throw InvalidArgument("the true surface has " + std::to_string(true_points.size()) +
                          " points and " + std::to_string(true_normals.size()) + " normals");
  std::vector<Eigen::Vector3f> points, normals;
  for (std::size_t k = 0; k < true_points.size(); ++k) {
    if (!true_points[k].allFinite()) continue;
    points.push_back(true_points[k]);
    if (!true_normals.empty()) normals.push_back(true_normals[k]);
  }
  if (points.empty()) throw InvalidArgument("the true surface has no finite point");
  const NearestPoint nearest(points);
  SurfaceEvaluation out;
  std::vector<double> distances;
  for (const Eigen::Vector3f& place : map) {
    if (!place.allFinite()) {
      ++out.skipped;
      continue;
    }
    const std::size_t at = nearest(place);
    const Eigen::Vector3d offset = (place - points[at]).cast<double>();
    double distance = offset.norm();
    if (!normals.empty() && distance <= options.plane_reach && normals[at].allFinite())
      distance = std::abs(normals[at].cast<double>().dot(offset));
    if (distance > options.max_distance) {
      ++out.beyond;
      distance = options.max_distance;
    }
    distances.push_back(distance);
  }
  if (distances.empty()) throw InvalidArgument("the map has no finite point");
  out.distance = statistics_of(std::move(distances));
  return out;
}

}  // namespace gpureg::evaluation
