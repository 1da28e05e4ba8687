// SPDX-License-Identifier: BSD-3-Clause
// The C++ side of overhead.py: prepares the fragments of a folder and aligns all pairs, again and
// again on request.
#include <gpureg/gpureg.hpp>
#include <gpureg/io.hpp>

#include <chrono>
#include <cstdlib>
#include <iostream>

// reference FOLDER QUADRUPLES: for each line on standard input, one batch; answers with its
// seconds.
int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const auto context = gpureg::Context::best();
  auto options = gpureg::RegistrationOptions::loopsmart();
  options.quadruples.count = static_cast<std::uint32_t>(std::strtoul(argv[2], nullptr, 10));
  std::vector<gpureg::PreparedCloud> clouds;
  for (const gpureg::io::ScanFile& scan : gpureg::io::list_scans(argv[1]))
    clouds.push_back(gpureg::prepare(context, gpureg::io::read_point_cloud(scan.path).view()));
  std::vector<gpureg::Pair> pairs;
  for (std::uint32_t i = 0; i < clouds.size(); ++i)
    for (std::uint32_t j = i + 1; j < clouds.size(); ++j) pairs.push_back({j, i});
  for (std::string line; std::getline(std::cin, line);) {
    const auto begin = std::chrono::steady_clock::now();
    const auto results = gpureg::align_batch(context, clouds, pairs, options);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    std::cout << seconds.count() << std::endl;
  }
  return 0;
}
