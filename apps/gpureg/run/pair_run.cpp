// SPDX-License-Identifier: BSD-3-Clause
#include "run/pair_run.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "inputs/cloud_file.hpp"
#include "json/fields_json.hpp"
#include "json/json.hpp"
#include "json/json_fields.hpp"
#include "records/result_json.hpp"
#include "run/interrupt.hpp"
#include "run/progress.hpp"
#include "run/spacing.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

/// The scans that take part in a run, with the numbers that they have there: those of `earlier`,
/// where other scans may have come and gone since, which moves numbers that are places.
using Numbers = std::map<std::size_t, int>;

Numbers numbers_of(const PreparedFolder& scene, const Json* earlier) {
  Numbers numbers;
  if (earlier == nullptr) {
    for (std::size_t k = 0; k < scene.scans.size(); ++k) numbers[k] = scene.numbers[k];
    return numbers;
  }
  if (!earlier->is_object()) return numbers;
  std::map<std::string, std::size_t> places;
  for (std::size_t k = 0; k < scene.scans.size(); ++k) places[scene.scans[k].name] = k;
  for (const Json& fragment : earlier->value("fragments", Json::array()))
    if (const auto place = places.find(text_member(fragment, "name")); place != places.end())
      numbers[place->second] = fragment_member(fragment, "number");
  return numbers;
}

// Backend and threads may change between runs: they do not change results. `numbers`: only these
// scans and the pairs of them, for a run that could not use the others.
Json header_of(const RegistrationOptions& options, const std::optional<GravityPrior>& gravity,
               const PreparedFolder& scene, const Pairs& pairs, const Numbers& numbers) {
  std::uint64_t hash = 0, count = 0;
  for (const auto& [i, j] : pairs) {
    const auto a = numbers.find(i), b = numbers.find(j);
    if (a == numbers.end() || b == numbers.end()) continue;
    hash = (hash ^
            (static_cast<std::uint64_t>(a->second) << 32 | static_cast<std::uint64_t>(b->second))) *
           0x9E3779B97F4A7C15ull;
    ++count;
  }
  Json fragments = Json::array();
  for (const auto& [k, number] : numbers)
    fragments.push_back({{"number", number},
                         {"name", scene.scans[k].name},
                         {"hash", scene.hashes[k]},
                         {"viewpoint", to_string(scene.clouds[k].statistics().viewpoint)}});
  Json header = {{"gpureg_journal", 3},
                 {"version", GPUREG_VERSION},
                 {"options", to_json(options)},
                 {"pairs", {{"count", count}, {"hash", hash}}},
                 {"fragments", fragments}};
  if (gravity)
    header["up"] = {gravity->target_up.x(), gravity->target_up.y(), gravity->target_up.z(),
                    gravity->max_angle};
  return header;
}

std::vector<Pair> sources_and_targets(const Pairs& pairs) {
  std::vector<Pair> out;
  for (const auto& [i, j] : pairs) out.push_back({j, i});
  return out;
}

}  // namespace

void choose_voxel_size(MethodOptions& method, const ScanInput& input, const std::string& journal) {
  if (!method.automatic_voxel_size) return;
  if (!journal.empty()) {
    const Json::json_pointer place("/options/prepare/voxel_size");
    if (const Json header = Journal::header(journal);
        header.contains(place) && header[place].is_number()) {
      method.voxel_size = header[place].get<float>();
      return;
    }
  }
  constexpr std::size_t kMost = 8;
  const std::vector<io::ScanFile> scans = input.list(true);
  const std::size_t count = std::min(scans.size(), kMost);
  std::vector<PointCloud> clouds;
  for (std::size_t k = 0; k < count; ++k) try {
      clouds.push_back(read_cloud(scans[k * scans.size() / count].path, 0, MeshNote::none));
    } catch (const IoError&) {
      // One that cannot be read is left out of the run, and named there.
      if (k + 1 == count && clouds.empty()) throw;
    }
  method.choose_voxel_size(views_of(clouds), input.path);
}

PairRun::PairRun(const PreparedFolder& scene, const Pairs& pairs,
                 const RegistrationOptions& options, const std::optional<GravityPrior>& gravity,
                 const std::optional<std::string>& journal, Journal::Mode mode, bool quiet)
    : scene_(scene),
      store_(sources_and_targets(pairs)),
      options_(options),
      gravity_(gravity),
      quiet_(quiet),
      size_(pairs.size()) {
  if (journal) open_journal(*journal, pairs, mode);
}

void PairRun::open_journal(const std::string& path, const Pairs& pairs, Journal::Mode mode) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> places;
  for (std::size_t k = 0; k < pairs.size(); ++k) places[{pairs[k].first, pairs[k].second}] = k;
  std::map<int, std::size_t> scan_of;  // by the numbers of the part of the journal that is read
  const bool found = std::filesystem::exists(path);
  journal_.emplace(
      path,
      [&](const Json* earlier) {
        const Numbers numbers = numbers_of(scene_, earlier);
        if (earlier != nullptr) {
          scan_of.clear();
          for (const auto& [k, number] : numbers) scan_of[number] = k;
        }
        return header_of(options_, gravity_, scene_, pairs, numbers);
      },
      mode,
      [&](int i, int j, RegistrationResult&& result) {
        const auto a = scan_of.find(i), b = scan_of.find(j);
        const auto place = a == scan_of.end() || b == scan_of.end()
                               ? places.end()
                               : places.find({a->second, b->second});
        if (place == places.end() || store_.done(place->second))
          throw InvalidArgument("pair " + std::to_string(i) + " " + std::to_string(j) +
                                (place == places.end() ? " is none of this run" : " stands twice"));
        store_.results[place->second] = std::move(result);
        ++done_;
      });
  resumed_ = done_;
  if (mode != Journal::Mode::resume || quiet_) return;
  if (found)
    std::cerr << "gpureg: " << resumed_ << " of " << size() << " pairs are done already"
              << std::endl;
  else
    std::cerr << "gpureg: there is nothing to resume, as no " << path
              << " of an unfinished run is there; all pairs are aligned" << std::endl;
}

void PairRun::align(const Context& context) {
  std::vector<Pair> left;
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < size(); ++k)
    if (!store_.done(k)) {
      left.push_back(store_.pairs[k]);
      places.push_back(k);
    }
  Progress progress("aligning", "pairs", size(), quiet_, done_);
  BatchCallbacks callbacks;
  callbacks.on_result = [&](std::size_t k, const RegistrationResult& result) {
    if (journal_)
      journal_->add(scene_.numbers[left[k].target], scene_.numbers[left[k].source], result);
    progress.update(++done_);
  };
  callbacks.should_stop = [&] {
    if (journal_) journal_->flush();
    return InterruptGuard::requested();
  };
  std::vector<RegistrationPrior> priors;
  if (gravity_) priors.assign(left.size(), RegistrationPrior{gravity_, std::nullopt});
  std::vector<RegistrationResult> results =
      align_batch(context, scene_.clouds, left, priors, options_, callbacks);
  for (std::size_t k = 0; k < left.size(); ++k) store_.results[places[k]] = std::move(results[k]);
  if (journal_) journal_->flush();
  seconds_ = progress.seconds();
}

double PairRun::rate() const {
  return seconds_ > 0 ? static_cast<double>(in_this_run()) / seconds_ : 0;
}

void PairRun::close_journal() {
  if (!journal_) return;
  if (scene_.unusable.empty()) {
    journal_->remove();
    return;
  }
  journal_->note_outputs();
  if (!quiet_)
    std::cerr
        << "gpureg: once those fragments are repaired or removed, go on with the same command "
           "and --resume"
        << std::endl;
}

std::string unusable_line(const FragmentFolder& scene) {
  std::string line;
  for (const UnusableFragment& fragment : scene.unusable)
    line += (line.empty() ? " " : ", ") + label(fragment.scan);
  return line.empty() ? "" : "unusable  " + line + "\n";
}

Json unusable_json(const FragmentFolder& scene) {
  Json unusable = Json::array();
  for (const UnusableFragment& fragment : scene.unusable)
    unusable.push_back({{"number", fragment.scan.number},
                        {"name", fragment.scan.name},
                        {"file", base_name(fragment.scan.path)},
                        {"reason", fragment.reason}});
  return unusable;
}

Json fragments_json(const PreparedFolder& scene) {
  Json fragments = Json::array();
  for (std::size_t k = 0; k < scene.numbers.size(); ++k) {
    Json fragment = {{"number", scene.numbers[k]},
                     {"name", scene.scans[k].name},
                     {"file", base_name(scene.scans[k].path)}};
    fragment.update(to_json(scene.clouds[k].statistics()));
    fragments.push_back(std::move(fragment));
  }
  return fragments;
}

}  // namespace gpureg::cli
