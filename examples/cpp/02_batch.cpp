// SPDX-License-Identifier: BSD-3-Clause
// Many clouds: prepares each cloud once, then aligns all pairs of them in one call.
//
//   02_batch CLOUD.ply CLOUD.ply [CLOUD.ply ...]
//
// Exit status: 0 every pair was tried, 2 an error.
#include <cstdint>
#include <cstdio>
#include <gpureg/gpureg.hpp>
#include <gpureg/io.hpp>
#include <string>
#include <vector>

int main(int argc, char** argv) try {
  if (argc < 3) {
    std::fprintf(stderr, "usage: 02_batch CLOUD.ply CLOUD.ply [CLOUD.ply ...]\n");
    return 2;
  }
  const std::vector<std::string> files(argv + 1, argv + argc);
  std::vector<gpureg::PointCloud> clouds;
  for (const std::string& file : files) clouds.push_back(gpureg::io::read_point_cloud(file));
  // A view points into its cloud, so all clouds are read before the first view is made.
  std::vector<gpureg::PointCloudView> views;
  for (const gpureg::PointCloud& cloud : clouds) views.push_back(cloud.view());

  const gpureg::Context context = gpureg::Context::best();
  const gpureg::RegistrationOptions options{0.05f};
  // Errors name the file that they are about.
  const auto prepared = gpureg::prepare_batch(context, views, options, files);

  std::vector<gpureg::Pair> pairs;
  for (std::uint32_t target = 0; target < prepared.size(); ++target)
    for (std::uint32_t source = target + 1; source < prepared.size(); ++source)
      pairs.push_back({source, target});

  // Called once per pair, in the order of the pairs.
  gpureg::BatchCallbacks callbacks;
  callbacks.on_result = [&](std::size_t k, const gpureg::RegistrationResult& result) {
    std::printf("%u into %u: %s, confidence %.3f\n", pairs[k].source, pairs[k].target,
                to_string(result.status), result.confidence);
  };
  const auto results = gpureg::align_batch(context, prepared, pairs, options, callbacks);

  std::size_t aligned = 0;
  for (const auto& result : results) aligned += result.aligned();
  std::printf("%zu of %zu pairs aligned\n", aligned, results.size());
  return 0;
} catch (const gpureg::Error& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 2;
}
