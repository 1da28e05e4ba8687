// SPDX-License-Identifier: BSD-3-Clause
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "command.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/io.hpp"
#include "interrupt.hpp"
#include "journal.hpp"
#include "json_file.hpp"
#include "method_options.hpp"
#include "options_json.hpp"
#include "output_path.hpp"
#include "progress.hpp"
#include "result_json.hpp"
#include "scene.hpp"
#include "spacing.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

struct BatchOptions {
  std::string folder, pairs = "all";
  MethodOptions method;
  std::string log, info, json;
  bool resume = false, restart = false, quiet = false;

  std::string journal() const { return log + ".journal"; }
  Journal::Mode journal_mode() const {
    if (resume) return Journal::Mode::resume;
    return restart ? Journal::Mode::restart : Journal::Mode::fresh;
  }
};

// A device or pipe (/dev/stdout, say) has no place beside it.
bool can_have_journal(const std::string& path) {
  struct stat status{};
  return ::stat(path.c_str(), &status) != 0 || S_ISREG(status.st_mode);
}

void check_outputs(const BatchOptions& o) {
  std::vector<NamedPath> inputs = scene_files("DIR", o.folder);
  if (o.pairs != "all") inputs.push_back({"--pairs", o.pairs});
  std::vector<NamedPath> outputs = {{"-o", o.log}, {"--info", o.info}, {"--json", o.json}};
  if (can_have_journal(o.log)) outputs.push_back({"the journal of -o", o.journal()});
  check_outputs(outputs, inputs);
}

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;  // indices i < j into the scene

// Backend and threads may change between runs: they do not change results.
Json header_of(const BatchOptions& o, const Scene& scene, const Pairs& pairs) {
  std::uint64_t hash = pairs.size();
  for (const auto& [i, j] : pairs)
    hash = (hash ^ (static_cast<std::uint64_t>(i) << 32 | j)) * 0x9E3779B97F4A7C15ull;
  Json fragments = Json::array();
  for (std::size_t k = 0; k < scene.numbers.size(); ++k)
    fragments.push_back({{"number", scene.numbers[k]}, {"hash", scene.hashes[k]}});
  return {{"gpureg_journal", 1},
          {"version", GPUREG_VERSION},
          {"options", to_json(o.method.registration())},
          {"pairs", {{"count", pairs.size()}, {"hash", hash}}},
          {"fragments", fragments}};
}

/// The voxel size of a folder is that of some of its fragments, evenly chosen: it is the same for a
/// run that is resumed.
void choose_voxel_size(BatchOptions& o) {
  if (!o.method.automatic_voxel_size) return;
  constexpr std::size_t kMost = 8;
  const auto files = io::list_fragments(o.folder);
  const std::size_t count = std::min(files.size(), kMost);
  std::vector<PointCloud> clouds;
  for (std::size_t k = 0; k < count; ++k)
    clouds.push_back(io::read_point_cloud(files[k * files.size() / count].second));
  std::vector<PointCloudView> views;
  for (const PointCloud& cloud : clouds) views.push_back(cloud.view());
  o.method.choose_voxel_size(views, o.folder);
}

/// One run, from the folder to the files.
class Batch {
 public:
  explicit Batch(const BatchOptions& o)
      : o_(o), options_(o.method.registration()), context_(o.method.context()) {}

  int run() {
    if (o_.resume && !can_have_journal(o_.log))
      throw InvalidArgument("--resume needs a file for -o, but " + o_.log + " is none");
    if (can_have_journal(o_.log)) Journal::check(o_.journal(), o_.journal_mode());
    const InterruptGuard guard;
    scene_ = prepare_scene(context_, o_.folder, options_.prepare, o_.quiet);
    if (scene_.interrupted) {
      std::cerr << "gpureg: interrupted before the first pair, nothing written" << std::endl;
      return kInterrupted;
    }
    check_voxel_size(options_.prepare.voxel_size, scene_.extent, "the largest fragment");
    pairs_ = choose_pairs(scene_, o_.pairs, o_.quiet);
    if (pairs_.empty())
      throw InvalidArgument(o_.pairs == "all" ? o_.folder + " holds one fragment; a batch needs two"
                                              : o_.pairs + " lists no pair");
    open_journal();
    keep_outputs();
    align_all();
    const bool complete = done_.size() == pairs_.size();
    if (!complete && journal_ && kept_.empty()) journal_->note_outputs();
    write_outputs();
    if (!complete) return say_interrupted();
    if (journal_) journal_->remove();
    return summarise();
  }

 private:
  void open_journal() {
    if (!can_have_journal(o_.log)) return;
    const bool found = std::filesystem::exists(o_.journal());
    journal_.emplace(o_.journal(), header_of(o_, scene_, pairs_), o_.journal_mode());
    done_ = journal_->entries();
    resumed_ = done_.size();
    if (!o_.resume || o_.quiet) return;
    if (found)
      std::cerr << "gpureg: " << resumed_ << " of " << pairs_.size() << " pairs are done already"
                << std::endl;
    else
      std::cerr << "gpureg: there is nothing to resume, as no " << o_.journal()
                << " of an unfinished run is there; all pairs are aligned" << std::endl;
  }

  /// Only a complete run replaces the outputs of another run; an interrupted run keeps its own.
  void keep_outputs() {
    if (journal_ && journal_->wrote_outputs()) return;
    for (const std::string& path : {o_.log, o_.info, o_.json})
      if (std::filesystem::is_regular_file(path)) kept_.insert(path);
  }
  bool may_write(const std::string& path) const {
    return !path.empty() && (done_.size() == pairs_.size() || kept_.count(path) == 0);
  }

  void align_all() {
    std::vector<Pair> left;
    for (const auto& [i, j] : pairs_)
      if (done_.count({scene_.numbers[i], scene_.numbers[j]}) == 0) left.push_back({j, i});
    Progress progress("aligning", "pairs", pairs_.size(), o_.quiet, done_.size());
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
    align_batch(context_, scene_.clouds, left, options_, callbacks);
    if (journal_) journal_->flush();
    seconds_ = progress.seconds();
  }

  void write_outputs() {
    std::vector<evaluation::LogEntry> log;
    std::vector<evaluation::InformationEntry> information;
    Json records = Json::array();
    for (const auto& [a, b] : pairs_) {
      const auto found = done_.find({scene_.numbers[a], scene_.numbers[b]});
      if (found == done_.end()) continue;
      const auto& [pair, matrix] = found->second;
      records.push_back(pair.json);
      if (!pair.aligned) {
        ++reasons_[pair.reason];
        continue;
      }
      log.push_back({pair.i, pair.j, scene_.count(), *pair.transform});
      information.push_back({pair.i, pair.j, scene_.count(), information_from_json(matrix)});
    }
    aligned_ = log.size();
    if (may_write(o_.log)) evaluation::write_log(o_.log, log);
    if (may_write(o_.info)) evaluation::write_information(o_.info, information);
    if (may_write(o_.json)) write_document(o_.json, document(std::move(records)));
  }

  Json document(Json records) const {
    Json json;
    json["gpureg"] = "batch";
    json["environment"] = environment(context_);
    json["options"] = to_json(options_);
    json["folder"] = o_.folder;
    json["complete"] = done_.size() == pairs_.size();
    json["seconds"] = {{"prepare", scene_.seconds},
                       {"align", seconds_},
                       {"pairs_per_second", rate()},
                       {"pairs_in_this_run", done_.size() - resumed_}};
    json["peak_memory_mib"] = peak_memory_mib();
    Json fragments = Json::array();
    for (std::size_t k = 0; k < scene_.numbers.size(); ++k) {
      Json fragment = {{"number", scene_.numbers[k]}, {"file", base_name(scene_.files[k])}};
      fragment.update(to_json(scene_.clouds[k].statistics()));
      fragments.push_back(std::move(fragment));
    }
    json["fragments"] = std::move(fragments);
    json["pairs"] = std::move(records);
    return json;
  }

  double rate() const {
    return seconds_ > 0 ? static_cast<double>(done_.size() - resumed_) / seconds_ : 0;
  }

  int say_interrupted() const {
    std::string kept;
    for (const std::string& path : kept_) kept += (kept.empty() ? "" : ", ") + path;
    std::cerr << "gpureg: interrupted, " << done_.size() << " of " << pairs_.size()
              << " pairs are done and written"
              << (kept.empty() ? "" : " to the journal, " + kept + " left as before")
              << "; go on with the same command and --resume" << std::endl;
    return kInterrupted;
  }

  int summarise() const {
    if (!o_.quiet) {
      if (o_.method.automatic_voxel_size)
        std::cout << "voxel size " << significant(static_cast<double>(o_.method.voxel_size), 3)
                  << "\n";
      std::cout << "fragments  " << scene_.numbers.size() << ", prepared in "
                << fixed(scene_.seconds, 2) << " s\n"
                << "pairs      " << pairs_.size() << ", in " << fixed(seconds_, 2) << " s ("
                << significant(rate(), 3) << " pairs/s, " << context_.description() << ")\n"
                << "aligned    " << aligned_ << ", written to " << o_.log << "\n";
      for (const auto& [reason, count] : reasons_)
        std::cout << "not        " << count << ", " << reason << "\n";
      std::cout << "memory     " << fixed(peak_memory_mib(), 0) << " MiB at most\n";
    }
    return aligned_ > 0 ? kOk : kNoAlignment;
  }

  const BatchOptions& o_;
  RegistrationOptions options_;
  Context context_;
  Scene scene_;
  Pairs pairs_;
  std::optional<Journal> journal_;
  Journal::Entries done_;
  std::set<std::string> kept_;  // outputs of another run
  std::size_t resumed_ = 0, aligned_ = 0;
  std::map<std::string, std::size_t> reasons_;
  double seconds_ = 0;
};

}  // namespace

void add_batch(CLI::App& app, Action& chosen) {
  const auto o = std::make_shared<BatchOptions>();
  CLI::App* verb = app.add_subcommand("batch", "Align the fragments cloud_bin_<i> of a folder");
  verb->add_option("DIR", o->folder, "Folder with cloud_bin_<i>.ply|pcd, and perhaps cameras.txt")
      ->required();
  verb->add_option("--pairs", o->pairs, "all, or a file with one pair `i j` a line")
      ->capture_default_str();
  o->method.add_to(*verb);
  verb->add_option("-o,--output", o->log, "Redwood log of the aligned pairs: T_ij, j into i")
      ->required();
  verb->add_option("--info", o->info, "Redwood information matrices of the same pairs");
  verb->add_option("--json", o->json, "Everything about every pair tried");
  CLI::Option* resume = verb->add_flag("--resume", o->resume,
                                       "Go on where an interrupted run of this output stopped");
  verb->add_flag("--restart", o->restart, "Discard what an interrupted run of this output did")
      ->excludes(resume);
  verb->add_flag("--quiet", o->quiet, "No progress, no summary");
  verb->callback([o, &chosen] {
    chosen = [o] {
      o->method.registration();  // reports bad options before the clouds are read
      check_outputs(*o);
      choose_voxel_size(*o);
      return Batch(*o).run();
    };
  });
}

}  // namespace gpureg::cli
