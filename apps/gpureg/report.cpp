// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "before_after.hpp"
#include "command.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "gpureg/io.hpp"
#include "output_path.hpp"
#include "report_page.hpp"
#include "report_pairs.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

constexpr std::size_t kPicturesOfAKind = 2;
constexpr int kPanelWidth = 480, kPanelHeight = 400;

struct ReportOptions {
  std::string result, truth, clouds, output;
};

std::vector<Picture> draw(const std::vector<SamplePair>& samples, const std::string& folder) {
  std::map<int, std::string> files;
  for (const auto& [number, file] : io::list_fragments(folder)) files[number] = file;
  const auto read = [&](int number) {
    const auto found = files.find(number);
    if (found == files.end())
      throw IoError(folder + ": there is no fragment " + std::to_string(number));
    return io::read_point_cloud(found->second);
  };
  std::vector<Picture> pictures;
  for (const SamplePair& sample : samples) {
    const PairRecord& pair = *sample.pair;
    PosedTitle after{std::nullopt, "after: no pose found"};
    if (pair.transform)
      after = {Eigen::Isometry3d(*pair.transform), pair.aligned ? "after" : "best candidate"};
    pictures.push_back(
        {sample.heading, sample.remark,
         encode_png(before_after(read(pair.j), read(pair.i), after, kPanelWidth, kPanelHeight))});
  }
  return pictures;
}

int run(const ReportOptions& o) {
  std::vector<NamedPath> inputs = truth_files("--ground-truth", o.truth);
  for (NamedPath& file : scene_files("--clouds", o.clouds)) inputs.push_back(std::move(file));
  inputs.push_back({"RESULT", o.result});
  check_outputs({{"-o", o.output}}, inputs);
  const ResultFile result = read_result(o.result);
  if (!result.has_scores)
    throw IoError(o.result +
                  ": a report needs RESULT.json of `gpureg batch --json`, this is a log");
  std::optional<evaluation::GroundTruth> truth;
  if (!o.truth.empty()) {
    truth = evaluation::read_ground_truth(o.truth);
    check_belongs(result, o.truth, *truth);
  }
  std::vector<Picture> pictures;
  if (!o.clouds.empty())
    pictures = draw(truth ? samples(judge(*truth, result), kPicturesOfAKind)
                          : samples(result, kPicturesOfAKind),
                    o.clouds);
  files::write_atomically(o.output, report_page(result, truth, pictures));
  std::cout << "written " << o.output << "\n";
  return kOk;
}

}  // namespace

void add_report(CLI::App& app, Action& chosen) {
  const auto o = std::make_shared<ReportOptions>();
  CLI::App* verb = app.add_subcommand("report", "Make one HTML page of a batch: numbers, pictures");
  verb->add_option("RESULT", o->result, "RESULT.json of a batch")->required();
  verb->add_option("--ground-truth", o->truth, "Folder with gt.log and gt.info");
  verb->add_option("--clouds", o->clouds, "Folder with the fragments, for pictures of some pairs");
  verb->add_option("-o,--output", o->output, "HTML file to write")->required();
  verb->callback([o, &chosen] { chosen = [o] { return run(*o); }; });
}

}  // namespace gpureg::cli
