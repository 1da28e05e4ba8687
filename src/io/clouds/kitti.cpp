// SPDX-License-Identifier: BSD-3-Clause
#include "io/clouds/kitti.hpp"

#include <cmath>

#include "io/decode.hpp"

namespace gpureg::io {
namespace {

constexpr std::size_t kRow = 4 * sizeof(float);
/// No scanner reaches farther, in metres; other data read as floats mostly does.
constexpr float kMostDistant = 1e5f;

}  // namespace

bool looks_like_kitti(const std::string& path) {
  if (path.size() < 4) return false;
  std::string end = path.substr(path.size() - 4);
  for (char& c : end)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return end == ".bin";
}

PointCloud read_kitti(Source& source) {
  const std::string_view bytes = source.rest();
  if (bytes.size() % kRow != 0)
    source.fail(std::to_string(bytes.size()) +
                " bytes are no scan of KITTI: expected rows of 16 bytes, x y z reflectance");
  PointCloud cloud;
  cloud.points.reserve(bytes.size() / kRow);
  const bool swap = host_order() != ByteOrder::little;
  std::size_t strange = 0;
  for (std::size_t at = 0; at < bytes.size(); at += kRow) {
    Eigen::Vector3f p;
    for (int k = 0; k < 3; ++k)
      p[k] = static_cast<float>(load(
          Scalar::float32, bytes.data() + at + sizeof(float) * static_cast<std::size_t>(k), swap));
    strange += !(p.cwiseAbs().maxCoeff() <= kMostDistant);
    cloud.points.push_back(p);
  }
  if (2 * strange > cloud.points.size())
    source.fail("no scan of KITTI: " + std::to_string(strange) + " of " +
                std::to_string(cloud.points.size()) + " rows are no coordinates");
  source.skip(bytes.size());
  return cloud;
}

}  // namespace gpureg::io
