// SPDX-License-Identifier: BSD-3-Clause
#include <sys/stat.h>

#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/io.hpp"
#include "gpureg/sets/register_all.hpp"
#include "inputs/scene.hpp"
#include "json/fields_json.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"
#include "options/knowledge_options.hpp"
#include "options/method_options.hpp"
#include "options/output_path.hpp"
#include "options/resume_options.hpp"
#include "options/scale_option.hpp"
#include "records/fragments_json.hpp"
#include "records/pair_store.hpp"
#include "records/result_json.hpp"
#include "records/scan_table.hpp"
#include "run/interrupt.hpp"
#include "run/progress.hpp"
#include "run/scaled_run.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

struct BatchOptions {
  ScanInput input;
  std::string pairs = "all";
  MethodOptions method;
  ViewpointChoice viewpoint;  // of clouds without cameras: auto or none
  std::string up;
  ScaleChoice scale;
  std::string log, info, json;
  ResumeOptions resume;
  bool quiet = false;

  std::string journal() const { return log + ".journal"; }
};

// A device or pipe (/dev/stdout, say) has no place beside it.
bool can_have_journal(const std::string& path) {
  struct stat status{};
  return ::stat(path.c_str(), &status) != 0 || S_ISREG(status.st_mode);
}

void check_batch_outputs(const BatchOptions& o) {
  std::vector<NamedPath> outputs = {{"-o", o.log}, {"--info", o.info}, {"--json", o.json}};
  if (can_have_journal(o.log)) outputs.push_back({"the journal of -o", o.journal()});
  check_outputs(outputs, {{"SCANS", o.input.path},
                          {"--pairs", o.pairs == "all" ? "" : o.pairs},
                          {"--calibration", o.method.calibration}});
}

/// One run, from the folder to the files.
class Batch {
 public:
  explicit Batch(const BatchOptions& o)
      : o_(o), options_(o.method.registration()), context_(o.method.context()) {}

  int run() {
    if (o_.resume.resume && !can_have_journal(o_.log))
      throw InvalidArgument("--resume needs a file for -o, but " + o_.log + " is none");
    if (can_have_journal(o_.log)) o_.resume.check(o_.journal());
    const InterruptGuard guard;
    scene_ = prepare_folder(context_, o_.input, options_, o_.quiet, o_.viewpoint.text != "none");
    if (scene_.interrupted) {
      std::cerr << "gpureg: interrupted before the first pair, nothing written" << std::endl;
      return kInterrupted;
    }
    o_.method.check_sizes(options_.voxel_size, scene_.sizes, o_.quiet);
    const std::vector<Pair> pairs = choose_pairs(scene_, o_.pairs, o_.quiet);
    if (pairs.empty())
      throw InvalidArgument(o_.input.path + " holds one scan, " + scene_.scans[0].name +
                            "; a batch needs two");
    open_journal(pairs);
    keep_outputs();
    align();
    if (!complete() && kept_.empty()) journal_->set_note(kOutputsWritten);
    write_outputs();
    if (!complete()) return say_interrupted();
    o_.resume.close(*journal_, scene_, o_.quiet);
    return summarise();
  }

 private:
  bool complete() const { return journal_->done() == journal_->size(); }

  void open_journal(const std::vector<Pair>& pairs) {
    const std::string path = can_have_journal(o_.log) ? o_.journal() : "";
    RunIdentity run = scene_.identity;
    run.settings = RunIdentity::settings_of(options_, up_prior(o_.up));
    o_.resume.with(path, [&] { journal_.emplace(path, run, pairs, o_.resume.mode()); });
    if (!o_.quiet) o_.resume.tell(path, journal_->resumed(), journal_->size());
  }

  void align() {
    Progress progress("aligning", "pairs", journal_->size(), o_.quiet, journal_->done());
    register_all(context_, scene_.clouds, *journal_, options_, up_prior(o_.up),
                 {[&](std::size_t done) { progress.update(done); }, InterruptGuard::requested});
    seconds_ = progress.seconds();
  }

  std::size_t in_this_run() const { return journal_->done() - journal_->resumed(); }
  double rate() const {  // pairs per second
    return seconds_ > 0 ? static_cast<double>(in_this_run()) / seconds_ : 0;
  }

  /// Only a complete run replaces the outputs of another run; an interrupted run keeps its own.
  void keep_outputs() {
    if (journal_->note() == kOutputsWritten) return;
    for (const std::string& path : {o_.log, o_.info, o_.json})
      if (std::filesystem::is_regular_file(path)) kept_.insert(path);
  }
  /// A log has numbers alone.
  bool has_table() const { return can_have_journal(o_.log) && !are_numbered(scene_.all()); }
  bool may_write(const std::string& path) const {
    return !path.empty() && (complete() || kept_.count(path) == 0);
  }

  void write_outputs() {
    std::vector<evaluation::LogEntry> log;
    std::vector<evaluation::InformationEntry> information;
    for (std::size_t k = 0; k < journal_->size(); ++k) {
      if (!journal_->done(k)) continue;
      const RegistrationResult result = journal_->result(k);
      if (!result.aligned()) {
        ++reasons_[to_string(result.reason)];
        continue;
      }
      const Pair& pair = journal_->pairs()[k];
      const int i = scene_.numbers[pair.target], j = scene_.numbers[pair.source];
      log.push_back({i, j, scene_.count(), result.target_from_source.matrix()});
      information.push_back({i, j, scene_.count(), result.source_moments.information_redwood()});
    }
    aligned_ = log.size();
    if (may_write(o_.log)) evaluation::write_log(o_.log, log);
    if (may_write(o_.log) && has_table()) write_scan_table(scan_table_of(o_.log), scene_.all());
    if (may_write(o_.info)) evaluation::write_information(o_.info, information);
    if (may_write(o_.json))
      write_pairs(
          o_.json, head(), journal_->pairs(), [&](std::size_t k) { return journal_->result(k); },
          scene_, false);
  }

  /// RESULT.json without its pairs.
  Json head() const {
    Json json;
    json["gpureg"] = "batch";
    json["environment"] = environment(context_);
    json["options"] = to_json(options_);
    json["folder"] = o_.input.path;
    json["recursive"] = o_.input.recursive;
    json["complete"] = complete();
    json["seconds"] = {{"prepare", scene_.seconds},
                       {"align", seconds_},
                       {"pairs_per_second", rate()},
                       {"pairs_in_this_run", in_this_run()}};
    json["peak_memory_mib"] = peak_memory_mib();
    json["fragments"] = fragments_json(scene_, scene_.clouds);
    json["unusable"] = unusable_json(scene_);
    return json;
  }

  int say_interrupted() const {
    std::string kept;
    for (const std::string& path : kept_) kept += (kept.empty() ? "" : ", ") + path;
    std::cerr << "gpureg: interrupted, " << journal_->done() << " of " << journal_->size()
              << " pairs are done and written"
              << (kept.empty() ? "" : " to the journal, " + kept + " left as before")
              << "; go on with the same command and --resume" << std::endl;
    return kInterrupted;
  }

  int summarise() const {
    if (!o_.quiet) {
      std::cout << "voxel size " << o_.method.voxel_size_text() << "\n";
      std::cout << "fragments  " << scene_.numbers.size() << ", prepared in "
                << fixed(scene_.seconds, 2) << " s\n"
                << unusable_line(scene_) << "pairs      " << journal_->size() << ", in "
                << fixed(seconds_, 2) << " s (" << significant(rate(), 3) << " pairs/s, "
                << context_.description() << ")\n"
                << "aligned    " << aligned_ << ", written to " << o_.log << "\n";
      if (has_table())
        std::cout << "names      of the numbers in the log: " << scan_table_of(o_.log) << "\n";
      if (!reasons_.empty())
        std::cout << "not        " << journal_->done() - aligned_ << ": " << counted(reasons_)
                  << "\n";
      std::cout << "memory     " << fixed(peak_memory_mib(), 0) << " MiB at most\n";
    }
    if (!scene_.unusable.empty()) return kIncomplete;
    return aligned_ > 0 ? kOk : kNoAlignment;
  }

  const BatchOptions& o_;
  RegistrationOptions options_;
  Context context_;
  PreparedFolder scene_;
  std::optional<PairJournal> journal_;
  double seconds_ = 0;          // of the alignment
  std::set<std::string> kept_;  // outputs of another run
  std::size_t aligned_ = 0;
  std::map<std::string, std::size_t> reasons_;
};

/// What the search of a scale does not go with.
void check_scale(const BatchOptions& o) {
  o.scale.range();
  for (const auto& [given, name] :
       {std::pair(!o.up.empty(), "--up"), std::pair(!o.info.empty(), "--info"),
        std::pair(o.resume.resume, "--resume"), std::pair(o.resume.restart, "--restart")})
    if (given) throw InvalidArgument(std::string("--scale and ") + name + " do not go together");
}

/// A batch whose scans have scales of their own: without a journal.
int run_with_scale(const BatchOptions& o) {
  const InterruptGuard guard;
  const Context context = o.method.context();
  const ScaledRun run = run_scaled(context, o.input, o.pairs, o.scale.range(), o.method,
                                   o.viewpoint.text != "none", o.quiet);
  std::size_t aligned = 0;
  std::map<std::string, std::size_t> reasons;
  for (const ScaledResult& result : run.results)
    if (result.aligned())
      ++aligned;
    else
      ++reasons[to_string(result.result.reason)];
  if (run.interrupted) {
    std::cerr << "gpureg: interrupted, nothing written" << std::endl;
    return kInterrupted;
  }
  write_scaled_log(o.log, run);
  if (can_have_journal(o.log) && !are_numbered(run.folder.all()))
    write_scan_table(scan_table_of(o.log), run.folder.all());
  if (!o.json.empty()) {
    Json json;
    json["gpureg"] = "batch";
    json["environment"] = environment(context);
    json["options"] = to_json(o.method.registration());
    json["folder"] = o.input.path;
    json["scale"] = o.scale.text;
    json["seconds"] = {{"align", run.seconds}};
    json["pairs"] = scaled_pairs_json(run);
    write_document(o.json, json);
  }
  if (!o.quiet) {
    std::cout << "pairs      " << run.pairs.size() << ", in " << fixed(run.seconds, 2) << " s ("
              << context.description() << ")\n"
              << "aligned    " << aligned << ", written to " << o.log
              << " with their scales in the poses\n";
    if (!reasons.empty())
      std::cout << "not        " << run.pairs.size() - aligned << ": " << counted(reasons) << "\n";
  }
  if (!run.folder.unusable.empty()) return kIncomplete;
  return aligned > 0 ? kOk : kNoAlignment;
}

}  // namespace

void add_batch(CommandLine& line) {
  const auto o = std::make_shared<BatchOptions>();
  Verb verb = line.verb("batch", "Align the scans of a folder, each with each");
  verb.option("SCANS", o->input.path, kScansHelp).required();
  verb.flag("--recursive", o->input.recursive, kRecursiveHelp);
  verb.option("--pairs", o->pairs, kPairsHelp).show_default();
  o->method.add_to(verb);
  o->method.add_calibration_to(verb);
  verb.option("--viewpoint", o->viewpoint.text,
              "Of fragments without a camera. auto: the file, or the origin if the surfaces "
              "agree with it; none: not known")
      .one_of({"auto", "none"})
      .show_default();
  o->scale.add_to(verb);
  verb.option("--up", o->up,
              "Vertical direction x,y,z in all fragments, and perhaps how many degrees it may "
              "be off (without: 10): 0,0,1,5");
  verb.option("-o,--output", o->log,
              "Redwood log of the aligned pairs: T_ij, j into i; the names of the numbers beside "
              "it, in "
              "OUTPUT_scans.csv")
      .required();
  verb.option("--info", o->info, "Redwood information matrices of the same pairs");
  verb.option("--json", o->json, "Everything about every pair tried");
  o->resume.add_to(verb);
  verb.flag("--quiet", o->quiet, "No progress, no summary");
  verb.run([o] {
    o->method.registration();  // reports bad options before the clouds are read
    up_prior(o->up);
    check_batch_outputs(*o);
    check_pairs(o->input, o->pairs);
    if (o->scale.given()) {
      check_scale(*o);
      if (!o->quiet) o->method.note_calibration();
      return run_with_scale(*o);
    }
    o->method.choose_voxel_size(o->input, o->resume.resume ? o->journal() : "");
    if (!o->quiet) o->method.note_calibration();
    return Batch(*o).run();
  });
}

}  // namespace gpureg::cli
