// SPDX-License-Identifier: BSD-3-Clause
// Clouds of PCL: aligns them without a copy, and through the interface of pcl::Registration.
//
//   03_pcl SOURCE.ply TARGET.ply
//
// Exit status: 0 aligned, 1 not aligned, 2 an error.
#include <gpureg/io.hpp>
#include <gpureg/pcl.hpp>
#include <iostream>

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: 03_pcl SOURCE.ply TARGET.ply\n";
    return 2;
  }
  // to_pcl copies. Programs that have clouds of PCL start below.
  const auto read = [](const char* file) {
    const gpureg::PointCloud cloud = gpureg::io::read_point_cloud(file);
    return pcl::make_shared<Cloud>(gpureg::to_pcl<pcl::PointXYZ>(cloud.view()));
  };
  const Cloud::Ptr source = read(argv[1]), target = read(argv[2]);
  const gpureg::RegistrationOptions options{0.05f};

  // The functions of gpureg on views of the clouds. sensor_origin_ becomes the viewpoint.
  const auto result = gpureg::align(gpureg::Context::best(), gpureg::view_of(*source),
                                    gpureg::view_of(*target), options);
  std::cout << explain(result.reason) << "\nconfidence " << result.confidence << "\n";

  // The interface of pcl::Registration, for programs that already call one of PCL's algorithms.
  gpureg::PclRegistration<pcl::PointXYZ> registration(options);
  registration.setInputSource(source);
  registration.setInputTarget(target);
  Cloud moved;
  registration.align(moved);
  if (!registration.hasConverged()) return 1;
  std::cout << "target_from_source\n" << registration.getFinalTransformation() << "\n";
  return 0;
} catch (const gpureg::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 2;
}
