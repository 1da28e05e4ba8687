// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <spawn.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <utility>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "inputs/cloud_file.hpp"
#include "inputs/scan_input.hpp"
#include "json/json_fields.hpp"
#include "json/json_file.hpp"
#include "pages/report_page.hpp"
#include "pictures/before_after.hpp"
#include "text.hpp"
#include "verbs/report.hpp"

extern "C" char** environ;

namespace gpureg::cli {
namespace {

namespace fs = std::filesystem;

struct ViewOptions {
  std::string path;
  bool print = false;
};

std::string map_page_in(const fs::path& folder) {
  const fs::path page = folder / "map.html";
  if (!fs::is_regular_file(page))
    throw InvalidArgument(folder.string() +
                          " has no map.html: `gpureg reconstruct FOLDER -o MAP` makes a map of the "
                          "clouds of a folder, `gpureg view MAP` shows it");
  return page.string();
}

/// The value at a JSON pointer; null if there is none.
Json value_of(const Json& json, const char* pointer) {
  const Json::json_pointer place(pointer);
  return json.contains(place) ? json.at(place) : Json();
}

/// The page of a result of `register --json`.
void write_pair_page(Json document, const std::string& page) {
  const std::string source = text_of(document, "/source/file"),
                    target = text_of(document, "/target/file");
  Json pair = value_of(document, "/result");
  if (!pair.is_object()) throw InvalidArgument("\"result\" is no object");
  pair["T_ij"] = value_of(pair, "/target_from_source");
  pair["i"] = 0, pair["j"] = 1;  // the places of target and source in "fragments"
  document["fragments"] =
      Json::array({value_of(document, "/target/prepare"), value_of(document, "/source/prepare")});

  ReportEntry entry;
  entry.scene = base_name(source) + " onto " + base_name(target);
  entry.result.pairs = {record_from_json(pair)};
  entry.pairs.push_back(pair_row(pair));
  const PairRecord& record = entry.result.pairs.front();
  PosedTitle after{std::nullopt, "after: no pose found"};
  if (record.transform)
    after = {Eigen::Isometry3d(*record.transform), record.aligned ? "after" : "best candidate"};
  const std::string found = record.aligned ? "Aligned" : "Not aligned";
  const std::string why = record.aligned ? "" : ": " + text_of(pair, "/explanation");
  entry.pictures = {{found, entry.scene + ", confidence " + fixed(record.confidence, 2) + why,
                     encode_png(before_after(read_cloud(source, 0, MeshNote::none),
                                             read_cloud(target, 0, MeshNote::none), after))}};
  entry.result.document = std::move(document);
  files::write_atomically(page, report_page({std::move(entry)}));
}

/// The page of what the user names: found, or written beside it.
std::string page_of(const std::string& path) {
  if (fs::is_directory(path)) return map_page_in(path);
  const std::string extension = fs::path(path).extension().string();
  DocumentFile file(path);
  if (extension == ".html" || extension == ".png") return path;
  if (!file.begins_object())
    throw InvalidArgument(path +
                          " is nothing to view: expected a JSON file of `gpureg register` or "
                          "`gpureg batch`, a folder of `gpureg reconstruct`, or a page");
  Json document = file.read("pairs", [](Json&&) {});
  const std::string made_by = text_of(document, "/gpureg");
  if (made_by == "reconstruct") return map_page_in(fs::absolute(path).parent_path());
  const std::string page = path + ".html";
  if (made_by == "register") {
    try {
      write_pair_page(std::move(document), page);
    } catch (const InvalidArgument& error) {
      throw IoError(path + ": " + error.what());
    }
  } else if (document.contains("pairs")) {
    const std::string folder = text_of(document, "/folder");
    const bool there = ScanInput{folder}.exists();
    if (!there) std::cerr << "note: no pictures: there are no scans '" << folder << "'\n";
    write_report(path, there ? folder : "-", page);
  } else {
    throw InvalidArgument(path + " has no page: it is a result of `gpureg " + made_by +
                          "`; expected one of register, batch, consistency or reconstruct");
  }
  return page;
}

bool has_display() {
#ifdef __APPLE__
  return true;
#else
  return std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
#endif
}

/// Opens a file with the program of the desktop, which outlives this one and prints nothing here.
bool open_page(std::string page) {
#ifdef __APPLE__
  std::string program = "open";
#else
  std::string program = "xdg-open";
#endif
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);  // Ctrl-C is not for the browser
  char* arguments[] = {program.data(), page.data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawnp(&child, arguments[0], &actions, &attributes, arguments, environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return failed == 0;
}

int run(const ViewOptions& o) {
  const std::string page = fs::absolute(page_of(o.path)).lexically_normal().string();
  std::cout << page << "\n";
  if (!o.print && has_display() && !open_page(page))
    std::cerr << "gpureg: note: there is no xdg-open: open the page yourself\n";
  return kOk;
}

}  // namespace

void add_view(CommandLine& line) {
  const auto o = std::make_shared<ViewOptions>();
  Verb verb = line.verb("view", "Open the page of a result or a map in the browser");
  verb.option("RESULT", o->path,
              "JSON of `register` or `batch`, whose page RESULT.html is written; the folder of a "
              "map; or an HTML page")
      .required();
  verb.flag("--print", o->print, "Only print the path of the page, as without a display");
  verb.run([o] { return run(*o); });
}

}  // namespace gpureg::cli
