// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "gpureg/io.hpp"
#include "inputs/cloud_file.hpp"
#include "inputs/scan_input.hpp"
#include "json/json_fields.hpp"
#include "options/output_path.hpp"
#include "pages/report_page.hpp"
#include "pages/report_pairs.hpp"
#include "pictures/before_after.hpp"
#include "text.hpp"
#include "verbs/report.hpp"

namespace gpureg::cli {
namespace {

constexpr std::size_t kPicturesOfAKind = 2;   // with ground truth
constexpr std::size_t kPicturesByScore = 12;  // without; a page of some 6 MB
constexpr const char* kNoPictures = "-";
constexpr int kPanelWidth = 480, kPanelHeight = 400;

struct ReportOptions {
  std::vector<std::string> results, names, truths, clouds;
  std::string output;
};

// The value for result k: one value holds for all results. Empty where the option was not given.
std::string value_for(std::size_t k, const std::vector<std::string>& values) {
  if (values.empty()) return "";
  return values.size() == 1 ? values.front() : values[k];
}

void check_count(const char* option, const std::vector<std::string>& values, std::size_t results) {
  if (values.size() > 1 && values.size() != results)
    throw InvalidArgument(std::string(option) + " was given " + std::to_string(values.size()) +
                          " times for " + std::to_string(results) +
                          " results; give it once for all or once for each, in the same order");
}

std::vector<Picture> draw(const ResultFile& result, const std::vector<SamplePair>& samples,
                          const ScanInput& input) {
  const std::vector<io::ScanFile> scans = input.list(true);
  const auto read = [&](int number) {
    const auto name = result.names.find(number);
    const auto found = std::find_if(scans.begin(), scans.end(), [&](const io::ScanFile& scan) {
      return name == result.names.end() ? scan.number == number : scan.name == name->second;
    });
    if (found == scans.end())
      throw IoError(input.path + ": there is no " + result.title_of(number));
    return read_cloud(found->path, 0, MeshNote::none);
  };
  std::vector<Picture> pictures;
  for (const SamplePair& sample : samples) {
    const PairRecord& pair = *sample.pair;
    PosedTitle after{std::nullopt, "after: no pose found"};
    if (pair.transform)
      after = {Eigen::Isometry3d(*pair.transform), pair.aligned ? "after" : "best candidate"};
    pictures.push_back(
        {sample.heading, sample.caption,
         encode_png(before_after(read(pair.j), read(pair.i), after, kPanelWidth, kPanelHeight))});
  }
  return pictures;
}

ReportEntry read_entry(const ReportOptions& o, std::size_t k) {
  ReportEntry entry;
  entry.name = o.names.empty() ? o.results[k] : o.names[k];
  entry.result =
      read_result(o.results[k], [&](const Json& pair) { entry.pairs.push_back(pair_row(pair)); });
  if (!entry.result.has_scores)
    throw IoError(o.results[k] +
                  ": a report needs RESULT.json of `gpureg batch --json`, this is a log");
  entry.scene = base_name(text_of(entry.result.document, "/folder"));
  if (const std::string folder = value_for(k, o.truths); !folder.empty()) {
    entry.truth = evaluation::read_ground_truth(folder);
    check_belongs(entry.result, folder, *entry.truth);
    entry.evaluation = evaluation::evaluate(*entry.truth, entry.result.reports, true);
    if (o.results.size() > 1) entry.scene = base_name(folder);
  }
  return entry;
}

void add_pictures(const std::string& folder, ReportEntry& entry) {
  if (folder.empty() || folder == kNoPictures) return;
  const bool recursive = text_of(entry.result.document, "/recursive") == "true" &&
                         std::filesystem::is_directory(folder);
  entry.pictures =
      draw(entry.result,
           entry.truth
               ? samples(entry.result, evaluate_pairs(*entry.truth, entry.result), kPicturesOfAKind)
               : samples(entry.result, kPicturesByScore),
           {folder, recursive});
}

void make(const ReportOptions& o) {
  check_count("--ground-truth", o.truths, o.results.size());
  check_count("--clouds", o.clouds, o.results.size());
  if (!o.names.empty() && o.names.size() != o.results.size())
    throw InvalidArgument("--name was given " + std::to_string(o.names.size()) + " times for " +
                          std::to_string(o.results.size()) + " results");
  std::vector<NamedPath> inputs;
  for (const std::string& folder : o.truths) inputs.push_back({"--ground-truth", folder});
  for (const std::string& folder : o.clouds)
    if (folder != kNoPictures) inputs.push_back({"--clouds", folder});
  for (const std::string& result : o.results) inputs.push_back({"RESULT", result});
  check_outputs({{"-o", o.output}}, inputs);
  std::vector<ReportEntry> entries;
  for (std::size_t k = 0; k < o.results.size(); ++k) entries.push_back(read_entry(o, k));
  for (std::size_t k = 0; k < entries.size(); ++k) add_pictures(value_for(k, o.clouds), entries[k]);
  files::write_atomically(o.output, report_page(std::move(entries)));
}

}  // namespace

void write_report(const std::string& result, const std::string& clouds, const std::string& page) {
  make({{result}, {}, {}, {clouds}, page});
}

void add_report(CommandLine& line) {
  const auto o = std::make_shared<ReportOptions>();
  Verb verb =
      line.verb("report", "Make one HTML page of batches: numbers, plots, pictures, a comparison");
  verb.option("RESULT", o->results, "RESULT.json of a batch; several are compared").required();
  // One value at a time, so that a RESULT may follow an option.
  const auto add = [&](const char* name, std::vector<std::string>& values, const char* text) {
    verb.option(name, values, text).one_at_a_time();
  };
  add("--ground-truth", o->truths,
      "Folder with gt.log and gt.info; of several results: once for all or once for each");
  add("--clouds", o->clouds,
      "The scans, for pictures of some pairs, as the batch was given them; once for all or once "
      "for "
      "each, - for none");
  add("--name", o->names, "Name of a result in a comparison, once for each; default: its path");
  verb.option("-o,--output", o->output, "HTML file to write").required();
  verb.run([o] {
    make(*o);
    std::cout << "written " << o->output << "\n";
    return kOk;
  });
}

}  // namespace gpureg::cli
