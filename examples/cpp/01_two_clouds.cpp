// SPDX-License-Identifier: BSD-3-Clause
// Two clouds: reads them, aligns them, and prints the pose with its confidence.
//
//   01_two_clouds SOURCE.ply TARGET.ply
//
// Exit status: 0 aligned, 1 not aligned, 2 an error.
#include <gpureg/gpureg.hpp>
#include <gpureg/io.hpp>
#include <iostream>

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: 01_two_clouds SOURCE.ply TARGET.ply\n";
    return 2;
  }
  const gpureg::PointCloud source = gpureg::io::read_point_cloud(argv[1]);
  const gpureg::PointCloud target = gpureg::io::read_point_cloud(argv[2]);

  // The GPU where there is one, else all cores of the CPU. The result is the same.
  const gpureg::Context context = gpureg::Context::best();
  // Metres. Every other length follows from the voxel size.
  const gpureg::RegistrationOptions options{0.05f};

  const auto result = gpureg::align(context, source.view(), target.view(), options);
  std::cout << context.description() << ": " << explain(result.reason) << "\n"
            << "confidence " << result.confidence << "\n";
  if (!result.aligned()) return 1;

  // p_target = target_from_source * p_source
  std::cout << "target_from_source\n" << result.target_from_source.matrix() << "\n";
  return 0;
} catch (const gpureg::Error& error) {  // a file that cannot be read, an option out of range
  std::cerr << "error: " << error.what() << "\n";
  return 2;
}
