// SPDX-License-Identifier: BSD-3-Clause
// Prints the bytes of results of 20 generated pairs, one fact per line; with a file it compares
// them with its lines. No test library, so that it builds for any processor.
//   gpureg_golden [--cuda]         prints; --cuda: of the first device
//   gpureg_golden [--cuda] FILE [THREADS]    compares; exits with 1 where a line differs
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "gpureg/reconstruction.hpp"
#include "gpureg/registration.hpp"
#include "gpureg/verification.hpp"
#include "gpureg/voxel_size.hpp"
#include "portability/golden_maps.hpp"
#include "portability/scans.hpp"

namespace gpureg {
namespace {

using test::hash_of;
using test::hex;
using test::pose_text;
using test::Report;

void add_map(const Context& context, const std::vector<PreparedCloud>& clouds,
             const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results,
             float voxel_size, Report& report) {
  reconstruction::Options options{voxel_size};
  reconstruction::Reconstruction map =
      reconstruction::reconstruct_from_poses(clouds.size(), pairs, results, options);
  const auto poses = [&](const std::string& name) {
    for (std::size_t k = 0; k < map.scans.size(); ++k)
      report.line(name + " scan " + std::to_string(k) + " confidence " +
                  hex(map.scans[k].confidence) +
                  (map.scans[k].placed ? pose_text(map.scans[k].island_from_scan) : " left out"));
  };
  poses("map");
  for (const reconstruction::Edge& edge : map.edges)
    report.line("map edge " + std::to_string(edge.source) + " " + std::to_string(edge.target) +
                " confidence " + hex(edge.confidence) + " weight " + hex(edge.weight));
  std::vector<reconstruction::Surface> surfaces;
  for (const PreparedCloud& cloud : clouds)
    surfaces.push_back({cloud.points(), cloud.normals(), {}});
  const reconstruction::RefineReport refined =
      reconstruction::refine(context, surfaces, map, reconstruction::RefineOptions{voxel_size});
  report.line("map rmse " + hex(refined.initial_rmse) + " " + hex(refined.final_rmse));
  poses("refined map");
}

Report results_of(const Context& context) {
  Report report;
  const std::vector<PointCloud> scans = test::portable_scans();
  std::vector<PointCloudView> views;
  for (std::size_t k = 0; k < scans.size(); ++k) {
    report.line("scan " + std::to_string(k) + " " + std::to_string(scans[k].points.size()) + " " +
                hash_of(scans[k].points));
    views.push_back(scans[k].view());
  }
  const VoxelSizeSuggestion suggested = suggest_voxel_size(views);
  report.line("voxel size " + hex(static_cast<double>(suggested.voxel_size)) + " spacing " +
              hex(suggested.spacing) + " noise " + hex(suggested.noise));

  constexpr float kVoxelSize = 0.1f;
  RegistrationOptions options{kVoxelSize};
  const std::vector<PreparedCloud> clouds = prepare_batch(context, views, options);
  report.clouds(clouds);
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < clouds.size(); ++i)
    for (std::uint32_t j = i + 1; j < clouds.size(); ++j)
      if (i != 5) pairs.push_back({j, i});
  const std::vector<RegistrationResult> results = align_batch(context, clouds, pairs, options);
  report.pairs("pair", pairs, results);

  RegistrationPrior prior;
  prior.pose = PosePrior{results[0].target_from_source, 17, 0.7};
  const RegistrationResult guided =
      align(context, clouds[pairs[0].source], clouds[pairs[0].target], options, prior);
  report.pairs("with prior", {pairs[0]}, {guided});

  VerificationOptions verification;
  verification.refine = true;
  for (const PoseVerification& v :
       verify_poses(context, clouds[pairs[0].source], clouds[pairs[0].target],
                    {results[0].target_from_source}, options, verification))
    report.line("verified confidence " + hex(v.confidence) + pose_text(v.target_from_source) +
                " evidence" + test::evidence_text(v.evidence));

  RegistrationOptions quadruples = RegistrationOptions::loopsmart(kVoxelSize);
  quadruples.quadruples = 20'000;
  const std::vector<Pair> two{pairs[0], pairs[1]};
  report.pairs("quadruples", two, align_batch(context, clouds, two, quadruples));

  add_map(context, clouds, pairs, results, kVoxelSize, report);
  const test::AlignedSet set{scans, clouds, pairs, results, options};
  test::add_audits(context, set, report);
  test::add_places(context, set, report);
  test::add_risk(set, report);
  return report;
}

int compare(const std::vector<std::string>& here, const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    std::cerr << "error: cannot read " << path << "\n";
    return 2;
  }
  std::size_t differing = 0, k = 0;
  std::string expected;
  for (; std::getline(file, expected); ++k) {
    if (k < here.size() && here[k] == expected) continue;
    if (differing++ == 0)
      std::cerr << path << ":" << k + 1 << " differs\n  expected " << expected << "\n  here     "
                << (k < here.size() ? here[k] : "nothing") << "\n";
  }
  if (here.size() > k) differing += here.size() - k;
  std::cout << here.size() << " lines, " << differing << " differ\n";
  return differing == 0 && k > 0 ? 0 : 1;
}

}  // namespace
}  // namespace gpureg

int main(int count, char** arguments) {
  const bool cuda = count > 1 && std::strcmp(arguments[1], "--cuda") == 0;
  const int file = cuda ? 2 : 1;
  const unsigned threads =
      file + 1 < count ? static_cast<unsigned>(std::strtoul(arguments[file + 1], nullptr, 10)) : 2;
  const gpureg::Report report =
      gpureg::results_of(cuda ? gpureg::Context::cuda() : gpureg::Context::cpu(threads));
  if (file < count) return gpureg::compare(report.lines(), arguments[file]);
  for (const std::string& line : report.lines()) std::cout << line << "\n";
  return 0;
}
