// SPDX-License-Identifier: BSD-3-Clause
#include <gpureg/io.hpp>
#include <gpureg/pcl.hpp>
#include <iostream>

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  using Cloud = pcl::PointCloud<pcl::PointXYZ>;
  const gpureg::PointCloud source = gpureg::io::read_point_cloud(argv[1]),
                           target = gpureg::io::read_point_cloud(argv[2]);
  gpureg::PclRegistration<pcl::PointXYZ> registration(gpureg::RegistrationOptions{0.05f});
  registration.setInputSource(
      pcl::make_shared<Cloud>(gpureg::to_pcl<pcl::PointXYZ>(source.view())));
  registration.setInputTarget(
      pcl::make_shared<Cloud>(gpureg::to_pcl<pcl::PointXYZ>(target.view())));
  Cloud moved;
  registration.align(moved);
  std::cout << registration.getFinalTransformation() << "\n";
  return registration.hasConverged() ? 0 : 1;
}
