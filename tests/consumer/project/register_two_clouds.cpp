// SPDX-License-Identifier: BSD-3-Clause
#include <gpureg/gpureg.hpp>
#include <gpureg/io.hpp>
#include <iostream>

int main(int argc, char** argv) try {
  if (argc != 3) return 2;
  const gpureg::PointCloud source = gpureg::io::read_point_cloud(argv[1]);
  const gpureg::PointCloud target = gpureg::io::read_point_cloud(argv[2]);
  const auto options = gpureg::RegistrationOptions::from_voxel_size(0.05f);  // metres
  const auto result = gpureg::align(gpureg::Context::best(), source.view(), target.view(), options);
  std::cout << explain(result.reason) << "\n";
  if (!result.aligned()) return 1;
  std::cout << result.target_from_source.matrix()
            << "\n";                    // p_target = target_from_source * p_source
} catch (const gpureg::Error& error) {  // a file that cannot be read, an option that cannot be
  std::cerr << error.what() << "\n";
  return 2;
}
