// SPDX-License-Identifier: BSD-3-Clause
#include "run/scaled_run.hpp"

#include <iostream>
#include <map>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "json/json.hpp"
#include "records/pair_json.hpp"
#include "records/result_json.hpp"
#include "run/interrupt.hpp"
#include "run/progress.hpp"

namespace gpureg::cli {

ScaledRun run_scaled(const Context& context, const ScanInput& input, const std::string& pairs,
                     const ScaleRange& range, MethodOptions method, bool infer_viewpoint,
                     bool quiet) {
  ScaledRun run{FragmentFolder(input, quiet), {}, {}, {}, 0, false};
  std::vector<PointCloud> clouds;
  std::vector<PointCloudView> views;
  std::vector<std::string> names;
  std::map<std::size_t, std::string> unreadable;
  for (std::size_t k = 0; k < run.folder.scans.size(); ++k) try {
      // Meshes are sampled by their own size: they have a unit of their own.
      clouds.push_back(run.folder.read(k, 0, quiet ? MeshNote::none : MeshNote::print));
    } catch (const IoError& error) {
      unreadable[k] = error.what();
    }
  run.folder.leave_out(unreadable);
  for (const io::ScanFile& scan : run.folder.scans) names.push_back(scan.path);
  for (const PointCloud& cloud : clouds) {
    views.push_back(cloud.view());
    views.back().infer_viewpoint = infer_viewpoint;
  }
  std::map<std::uint32_t, std::vector<std::size_t>> of_target;
  for (const Pair& pair : choose_pairs(run.folder, pairs, quiet)) {
    of_target[pair.target].push_back(run.pairs.size());
    run.pairs.push_back(pair);
  }
  if (run.pairs.empty()) throw InvalidArgument(input.path + ": a batch needs two scans");
  run.results.resize(run.pairs.size());
  run.voxel_sizes.resize(run.pairs.size());

  Progress progress("aligning", "pairs", run.pairs.size(), quiet);
  std::size_t done = 0;
  // With one voxel size for all, targets share what is prepared of a source.
  std::vector<std::vector<std::size_t>> parts(1);
  if (method.automatic_voxel_size) {
    parts.clear();
    for (const auto& [target, places] : of_target) parts.push_back(places);
  } else {
    for (std::size_t k = 0; k < run.pairs.size(); ++k) parts[0].push_back(k);
  }
  for (const std::vector<std::size_t>& places : parts) {
    const std::uint32_t target = run.pairs[places.front()].target;
    method.choose_voxel_size({views[target]}, names[target]);
    const RegistrationOptions options = method.registration();
    std::vector<Pair> part;
    for (const std::size_t k : places) {
      part.push_back(run.pairs[k]);
      run.voxel_sizes[k] = options.voxel_size;
    }
    ScaledCallbacks callbacks;
    callbacks.on_result = [&](std::size_t, const ScaledResult&) { progress.update(++done); };
    callbacks.should_stop = [] { return InterruptGuard::requested(); };
    std::vector<ScaledResult> results =
        align_scaled_batch(context, views, part, range, options, callbacks, names);
    for (std::size_t k = 0; k < places.size(); ++k) run.results[places[k]] = std::move(results[k]);
    run.interrupted = InterruptGuard::requested();
    if (run.interrupted) break;
  }
  run.seconds = progress.seconds();
  return run;
}

void write_scaled_log(const std::string& path, const ScaledRun& run) {
  std::vector<evaluation::LogEntry> log;
  for (std::size_t k = 0; k < run.pairs.size(); ++k)
    if (run.results[k].aligned())
      log.push_back({run.folder.numbers[run.pairs[k].target],
                     run.folder.numbers[run.pairs[k].source], run.folder.count(),
                     run.results[k].similarity()});
  evaluation::write_log(path, log);
}

Json scaled_pairs_json(const ScaledRun& run) {
  Json out = Json::array();
  for (std::size_t k = 0; k < run.pairs.size(); ++k) {
    const ScaledResult& found = run.results[k];
    if (found.result.status == RegistrationStatus::skipped) continue;
    const io::ScanFile &i = run.folder.scans[run.pairs[k].target],
                       &j = run.folder.scans[run.pairs[k].source];
    Json json = {{"i", i.number}, {"j", j.number}, {"name_i", i.name}, {"name_j", j.name}};
    json.update(pair_to_json(i.number, j.number, found.result));
    json.erase("modes");  // of the scaled source
    json.update(scale_to_json(found, "T_ij"));
    json["voxel_size"] = run.voxel_sizes[k];
    out.push_back(std::move(json));
  }
  return out;
}

}  // namespace gpureg::cli
