// SPDX-License-Identifier: BSD-3-Clause
// Prints the bytes of results of real scans, for a comparison of two builds by diff.
//   gpureg_scene_bytes FOLDER NUMBER NUMBER...   all pairs of these fragments of the folder
#include <exception>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "gpureg/io.hpp"
#include "portability/report.hpp"

namespace {

int run(const std::string& folder, const std::vector<std::string>& numbers) {
  using namespace gpureg;
  const auto cameras = io::read_cameras(folder + "/cameras.txt");
  std::vector<PointCloud> scans;
  for (const std::string& number : numbers) {
    scans.push_back(io::read_point_cloud(folder + "/cloud_bin_" + number + ".ply"));
    const auto found = cameras.find(std::stoi(number));
    if (found != cameras.end()) scans.back().set_viewpoints(found->second);
  }
  const Context context = Context::cpu();
  const auto options = RegistrationOptions{0.05f};
  std::vector<PointCloudView> views;
  for (const PointCloud& scan : scans) views.push_back(scan.view());
  const std::vector<PreparedCloud> clouds = prepare_batch(context, views, options);
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < clouds.size(); ++i)
    for (std::uint32_t j = i + 1; j < clouds.size(); ++j) pairs.push_back({j, i});
  test::Report report;
  report.clouds(clouds);
  report.pairs("pair", pairs, align_batch(context, clouds, pairs, options));
  for (const std::string& line : report.lines()) std::cout << line << "\n";
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 4) {
    std::cerr << "usage: gpureg_scene_bytes FOLDER NUMBER NUMBER...\n";
    return 2;
  }
  try {
    return run(arguments[1], std::vector<std::string>(arguments + 2, arguments + count));
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << "\n";
    return 2;
  }
}
