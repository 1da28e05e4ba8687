// SPDX-License-Identifier: BSD-3-Clause
// Features of your own: spin images (Johnson and Hebert 1999) are matched instead of FPFH.
//
//   04_own_features SOURCE.ply TARGET.ply
//
// Exit status: 0 aligned, 1 not aligned, 2 an error.
#include <algorithm>
#include <cmath>
#include <gpureg/gpureg.hpp>
#include <gpureg/io.hpp>
#include <iostream>

constexpr float kVoxel = 0.05f, kRadius = 8 * kVoxel;  // metres
constexpr int kBins = 8, kDimension = 2 * kBins * kBins;

// One row per point: a histogram of its neighbours by their distance from the line of its normal
// and by their height above its tangent plane.
std::vector<float> spin_images(const std::vector<Eigen::Vector3f>& points,
                               const std::vector<Eigen::Vector3f>& normals) {
  std::vector<float> rows(points.size() * kDimension, 0.f);
  for (std::size_t i = 0; i < points.size(); ++i) {
    float *row = &rows[i * kDimension], sum = 0;
    for (const Eigen::Vector3f& other : points) {
      const Eigen::Vector3f offset = other - points[i];
      if (offset.squaredNorm() >= kRadius * kRadius) continue;
      const float height = normals[i].dot(offset);
      const float distance = std::sqrt(std::max(0.f, offset.squaredNorm() - height * height));
      const int column = std::min(kBins - 1, static_cast<int>(kBins * distance / kRadius));
      const int line = static_cast<int>(kBins * (1 + height / kRadius));
      row[std::clamp(line, 0, 2 * kBins - 1) * kBins + column] += 1;
      sum += 1;
    }
    for (int k = 0; k < kDimension; ++k) row[k] /= sum;  // a point is its own neighbour
  }
  return rows;
}

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: 04_own_features SOURCE.ply TARGET.ply\n";
    return 2;
  }
  const gpureg::Context context = gpureg::Context::best();
  gpureg::RegistrationOptions options{kVoxel};

  const auto prepare = [&](const char* file) {
    // gpureg downsamples and estimates normals ...
    const gpureg::PointCloud cloud = gpureg::io::read_point_cloud(file);
    const auto plain = gpureg::prepare(context, cloud.view(), options);
    const auto points = plain.points(), normals = plain.normals();
    const auto features = spin_images(points, normals);
    // ... and takes these points again, as they are, with their features.
    gpureg::PointCloudView view(points);
    view.normals = normals.front().data();
    view.features = features.data();
    view.feature_dimension = kDimension;
    auto as_they_are = options;
    as_they_are.prepare.downsample = false;
    return gpureg::prepare(context, view, as_they_are);
  };
  const auto source = prepare(argv[1]), target = prepare(argv[2]);

  const auto result = gpureg::align(context, source, target, options);
  std::cout << explain(result.reason) << "\nconfidence " << result.confidence << "\n";
  if (!result.aligned()) return 1;
  std::cout << "target_from_source\n" << result.target_from_source.matrix() << "\n";
  return 0;
} catch (const gpureg::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 2;
}
