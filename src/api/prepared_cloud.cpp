// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/prepared_cloud.hpp"

#include "gpureg/error.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

namespace {
const PreparedState& checked(const std::shared_ptr<const PreparedState>& state) {
  if (!state)
    throw InvalidArgument("prepared cloud is an empty handle: it was not made by prepare()");
  return *state;
}

std::vector<Eigen::Vector3f> to_eigen(const std::vector<Vec3>& v, const float* shift) {
  std::vector<Eigen::Vector3f> out;
  out.reserve(v.size());
  for (const Vec3& p : v)
    out.emplace_back(p.x + (shift ? shift[0] : 0), p.y + (shift ? shift[1] : 0),
                     p.z + (shift ? shift[2] : 0));
  return out;
}
}  // namespace

std::size_t PreparedCloud::size() const { return checked(state_).size; }
std::size_t PreparedCloud::feature_dimension() const { return checked(state_).feature_dimension; }
const PrepareStatistics& PreparedCloud::statistics() const { return checked(state_).statistics; }
const PrepareSettings& PreparedCloud::settings() const { return checked(state_).options; }
float PreparedCloud::voxel_size() const {
  return settings().voxel_size > 0 ? settings().voxel_size : settings().unit;
}
Eigen::Vector3d PreparedCloud::origin() const {
  return Eigen::Map<const Eigen::Vector3d>(checked(state_).frame_offset);
}
std::vector<Eigen::Vector3f> PreparedCloud::points() const {
  return to_eigen(checked(state_).copy_points(), state_->origin);
}
std::vector<Eigen::Vector3f> PreparedCloud::normals() const {
  return to_eigen(checked(state_).copy_normals(), nullptr);
}
std::vector<float> PreparedCloud::features() const { return checked(state_).copy_features(); }
std::vector<Eigen::Vector3f> PreparedCloud::viewpoints() const {
  return to_eigen(checked(state_).viewpoints, state_->origin);
}

}  // namespace gpureg
