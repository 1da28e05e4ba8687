// SPDX-License-Identifier: BSD-3-Clause
#include <gpureg/gpureg.hpp>
#include <gpureg/io.hpp>
#include <iostream>

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const auto source = gpureg::io::read_point_cloud(argv[1]);
  const auto target = gpureg::io::read_point_cloud(argv[2]);
  const auto result = gpureg::align(gpureg::Context::best(), source.view(), target.view());
  std::cout << explain(result.reason) << "\n" << result.target_from_source.matrix() << "\n";
  return result.aligned() ? 0 : 1;
}
