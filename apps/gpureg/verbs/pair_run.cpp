// SPDX-License-Identifier: BSD-3-Clause
#include "verbs/pair_run.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>

#include "gpureg/io.hpp"
#include "records/cloud_file.hpp"
#include "records/fields_json.hpp"
#include "records/result_json.hpp"
#include "text.hpp"
#include "verbs/interrupt.hpp"
#include "verbs/progress.hpp"

namespace gpureg::cli {
namespace {

// Backend and threads may change between runs: they do not change results.
Json header_of(const RegistrationOptions& options, const std::optional<GravityPrior>& gravity,
               const Scene& scene, const Pairs& pairs) {
  std::uint64_t hash = pairs.size();
  for (const auto& [i, j] : pairs)
    hash = (hash ^ (static_cast<std::uint64_t>(i) << 32 | j)) * 0x9E3779B97F4A7C15ull;
  Json fragments = Json::array();
  for (std::size_t k = 0; k < scene.numbers.size(); ++k)
    fragments.push_back({{"number", scene.numbers[k]},
                         {"hash", scene.hashes[k]},
                         {"viewpoint", to_string(scene.clouds[k].statistics().viewpoint)}});
  Json header = {{"gpureg_journal", 1},
                 {"version", GPUREG_VERSION},
                 {"options", to_json(options)},
                 {"pairs", {{"count", pairs.size()}, {"hash", hash}}},
                 {"fragments", fragments}};
  if (gravity)
    header["up"] = {gravity->target_up.x(), gravity->target_up.y(), gravity->target_up.z(),
                    gravity->max_angle};
  return header;
}

}  // namespace

void choose_voxel_size(MethodOptions& method, const std::string& folder) {
  if (!method.automatic_voxel_size) return;
  constexpr std::size_t kMost = 8;
  const auto files = io::list_fragments(folder);
  const std::size_t count = std::min(files.size(), kMost);
  std::vector<PointCloud> clouds;
  for (std::size_t k = 0; k < count; ++k)
    clouds.push_back(read_cloud(files[k * files.size() / count].second, 0, MeshNote::none));
  std::vector<PointCloudView> views;
  for (const PointCloud& cloud : clouds) views.push_back(cloud.view());
  method.choose_voxel_size(views, folder);
}

PairRun::PairRun(const Scene& scene, Pairs pairs, const RegistrationOptions& options,
                 const std::optional<GravityPrior>& gravity,
                 const std::optional<std::string>& journal, Journal::Mode mode, bool quiet)
    : scene_(scene), pairs_(std::move(pairs)), options_(options), gravity_(gravity), quiet_(quiet) {
  if (!journal) return;
  const bool found = std::filesystem::exists(*journal);
  journal_.emplace(*journal, header_of(options, gravity, scene, pairs_), mode);
  done_ = journal_->entries();
  resumed_ = done_.size();
  if (mode != Journal::Mode::resume || quiet) return;
  if (found)
    std::cerr << "gpureg: " << resumed_ << " of " << pairs_.size() << " pairs are done already"
              << std::endl;
  else
    std::cerr << "gpureg: there is nothing to resume, as no " << *journal
              << " of an unfinished run is there; all pairs are aligned" << std::endl;
}

void PairRun::align(const Context& context) {
  std::vector<Pair> left;
  for (const auto& [i, j] : pairs_)
    if (done_.count({scene_.numbers[i], scene_.numbers[j]}) == 0) left.push_back({j, i});
  Progress progress("aligning", "pairs", pairs_.size(), quiet_, done_.size());
  BatchCallbacks callbacks;
  callbacks.on_result = [&](std::size_t k, const RegistrationResult& result) {
    const int i = scene_.numbers[left[k].target], j = scene_.numbers[left[k].source];
    const PairRecord record = PairRecord::from_result(i, j, result);
    const Json information = to_json(result.source_moments.information_redwood());
    if (journal_) journal_->add(record, information);
    done_.emplace(std::make_pair(i, j), Journal::Entry{record, information});
    progress.update(done_.size());
  };
  callbacks.should_stop = [&] {
    if (journal_) journal_->flush();
    return InterruptGuard::requested();
  };
  std::vector<RegistrationPrior> priors;
  if (gravity_) priors.assign(left.size(), RegistrationPrior{gravity_, std::nullopt});
  align_batch(context, scene_.clouds, left, priors, options_, callbacks);
  if (journal_) journal_->flush();
  seconds_ = progress.seconds();
}

double PairRun::rate() const {
  return seconds_ > 0 ? static_cast<double>(in_this_run()) / seconds_ : 0;
}

Json fragments_json(const Scene& scene) {
  Json fragments = Json::array();
  for (std::size_t k = 0; k < scene.numbers.size(); ++k) {
    Json fragment = {{"number", scene.numbers[k]}, {"file", base_name(scene.files[k])}};
    fragment.update(to_json(scene.clouds[k].statistics()));
    fragments.push_back(std::move(fragment));
  }
  return fragments;
}

}  // namespace gpureg::cli
