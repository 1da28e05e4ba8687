// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "io/clouds/foreign.hpp"
#include "io/extension.hpp"
#include "io/scans/folder.hpp"
#include "io/scans/list_file.hpp"
#include "io/scans/names.hpp"
#include "io/scans/parts.hpp"
#include "io/scans/pattern.hpp"

namespace gpureg::io {
namespace {

namespace fs = std::filesystem;
using scans::Contents;
using scans::Found;
using Notes = std::vector<std::string>;

constexpr std::string_view kPrefix = "cloud_bin_";
/// Longer numbers are dates and times.
constexpr int kMostNumber = 999999;

/// Files that this library reads and writes beside clouds: not worth a note.
constexpr std::string_view kOwnFiles[] = {"cameras.txt", "poses.txt",  "trajectory.txt",
                                          "pairs.txt",   "gt.log",     "gt.info",
                                          "gt_all.log",  "gt_all.info"};

/// Number of a name like cloud_bin_12.ply; none for other names.
std::optional<int> fragment_number(const std::string& name) {
  if (name.rfind(kPrefix, 0) != 0 || !scans::is_cloud_extension(extension_of(name))) return {};
  const auto found = scans::numbered(scans::stem_of(name));
  if (!found || found->before != kPrefix) return {};
  return found->number;
}

/// The scans cloud_bin_<i> of a folder; none: it has none.
std::vector<ScanFile> fragments_of(const Contents& contents) {
  std::map<int, ScanFile> fragments;
  for (const Found& cloud : contents.clouds) {
    const auto number = fragment_number(cloud.name);
    if (!number) continue;
    // The files of results have the number of fragments, an int, beside their numbers.
    if (*number == std::numeric_limits<int>::max())
      throw IoError("the number of the fragment " + cloud.path +
                    " is too large, expected at most 2147483646");
    const auto [first, is_new] =
        fragments.emplace(*number, ScanFile{*number, cloud.path, cloud.name});
    if (!is_new)
      throw IoError("fragment " + std::to_string(*number) +
                    " is twice in its folder: " + first->second.path + " and " + cloud.path);
  }
  std::vector<ScanFile> out;
  for (auto& [number, scan] : fragments) out.push_back(std::move(scan));
  return out;
}

/// "#2" of the second of several scans of a file.
std::string mark_of(std::size_t part, std::size_t parts) {
  return parts > 1 ? "#" + std::to_string(part) : std::string();
}

/// Whether all names differ by a number alone, which then is theirs: scan_1.ply, scan_12.ply.
bool have_numbers(const std::vector<ScanFile>& scans) {
  std::string_view before;
  int last = -1;
  for (const ScanFile& scan : scans) {
    const auto found = scans::numbered(scans::stem_of(scan.name));
    if (!found || (last >= 0 && found->before != before) || found->number <= last ||
        found->number > kMostNumber)
      return false;
    before = found->before;
    last = found->number;
  }
  return true;
}

/// Scans of files in this order; a file with several gives several.
std::vector<ScanFile> scans_of(const std::vector<Found>& files) {
  std::vector<ScanFile> out;
  for (const Found& file : files) {
    const std::size_t parts = scans::parts_of(file.path);
    for (std::size_t part = 1; part <= parts; ++part)
      out.push_back({static_cast<int>(out.size()), file.path + mark_of(part, parts),
                     scans::printable(file.name) + mark_of(part, parts)});
  }
  if (!have_numbers(out)) return out;
  for (ScanFile& scan : out) scan.number = scans::numbered(scans::stem_of(scan.name))->number;
  return out;
}

void note_skipped(const std::string& where, const Contents& contents, Notes* notes) {
  if (notes == nullptr) return;
  std::vector<std::string> others;
  std::copy_if(contents.others.begin(), contents.others.end(), std::back_inserter(others),
               [](const std::string& name) {
                 return std::find(std::begin(kOwnFiles), std::end(kOwnFiles), name) ==
                        std::end(kOwnFiles);
               });
  const auto note = [&](const std::vector<std::string>& names, const char* one,
                        const char* several) {
    if (!names.empty())
      notes->push_back(std::to_string(names.size()) + (names.size() == 1 ? one : several) +
                       " skipped in " + where + ": " + scans::listed(names));
  };
  note(others, " file that is no cloud is", " files that are no clouds are");
  note(contents.broken, " link to nothing is", " links to nothing are");
  note(contents.maps, " output of `gpureg reconstruct` is", " outputs of `gpureg reconstruct` are");
}

std::vector<ScanFile> of_folder(const std::string& folder, bool recursive, Notes* notes) {
  Contents contents = scans::contents_of(folder, recursive);
  if (!recursive) {
    if (std::vector<ScanFile> fragments = fragments_of(contents); !fragments.empty()) {
      std::vector<std::string> others;
      for (const Found& cloud : contents.clouds)
        // Text beside fragments is a list or a table, as gt_overlap.txt.
        if (!fragment_number(cloud.name) && extension_of(cloud.name) != ".txt" &&
            extension_of(cloud.name) != ".csv")
          others.push_back(cloud.name);
      if (notes != nullptr && !others.empty())
        notes->push_back("beside cloud_bin_<i>, " + std::to_string(others.size()) +
                         (others.size() == 1 ? " other cloud of " : " other clouds of ") + folder +
                         (others.size() == 1 ? " is" : " are") +
                         " left out: " + scans::listed(others));
      return fragments;
    }
    std::error_code ignored;
    if (fs::exists(fs::path(folder) / "reconstruction.json", ignored))
      throw IoError(folder +
                    " is the output of `gpureg reconstruct`, expected the folder of its scans");
  }
  if (contents.clouds.empty()) throw IoError(scans::explain_no_cloud(folder, contents));
  scans::drop_doubles(folder, contents);
  note_skipped(folder, contents, notes);
  return scans_of(contents.clouds);
}

/// Names without folders where they differ, else from the folder on that all have in common.
void shorten_names(std::vector<Found>& files) {
  std::set<std::string> names;
  for (const Found& file : files) names.insert(fs::path(file.path).filename().string());
  std::size_t common = 0;
  if (names.size() < files.size()) {
    const std::string& first = files.front().path;
    common = first.rfind('/') + 1;
    for (const Found& file : files) {
      const auto stop =
          std::mismatch(first.begin(), first.end(), file.path.begin(), file.path.end());
      const auto same = static_cast<std::size_t>(stop.first - first.begin());
      common = std::min(common, same == 0 ? 0 : first.rfind('/', same - 1) + 1);
    }
  }
  for (Found& file : files)
    file.name = names.size() < files.size() ? file.path.substr(common)
                                            : fs::path(file.path).filename().string();
}

std::vector<ScanFile> of_list(const std::string& path) {
  const std::vector<scans::Listed> lines = scans::read_list(path);
  if (lines.empty()) throw IoError(path + " lists no cloud, expected a path a line");
  std::vector<Found> files;
  for (const scans::Listed& line : lines) files.push_back({line.path, ""});
  shorten_names(files);
  std::vector<ScanFile> out;
  std::map<std::string, std::size_t> line_of_path, line_of_name;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const scans::Listed& line = lines[k];
    const auto check = [&](std::map<std::string, std::size_t>& seen, const std::string& text,
                           const std::string& why) {
      const auto [first, is_new] = seen.insert({text, line.line});
      if (!is_new)
        throw IoError(path + ":" + std::to_string(line.line) + ": " + why +
                      std::to_string(first->second));
    };
    const ScanPath named = scan_path(line.path);
    const std::size_t parts = named.part > 0 ? 1 : scans::parts_of(line.path);
    std::error_code ignored;
    const std::string where = fs::canonical(named.file, ignored).string();
    for (std::size_t part = 1; part <= parts; ++part) {
      const std::string name =
          (line.name.empty() ? scans::printable(files[k].name) : line.name) + mark_of(part, parts);
      check(line_of_path, where + "#" + std::to_string(std::max(named.part, part)),
            "repeats line ");
      check(line_of_name, name, "has the name " + name + " of line ");
      out.push_back({static_cast<int>(out.size()), line.path + mark_of(part, parts), name});
    }
  }
  return out;
}

std::vector<ScanFile> of_pattern(const std::string& pattern, Notes* notes) {
  Contents contents;
  bool folders = false;
  for (const std::string& path : scans::matches(pattern)) {
    std::error_code ignored;
    if (fs::is_directory(path, ignored))
      folders = true;
    else if (scans::is_cloud_file(path))
      contents.clouds.push_back({path, ""});
    else
      contents.others.push_back(path);
  }
  if (contents.clouds.empty()) {
    if (!contents.others.empty())
      throw IoError("no cloud matches " + pattern + ", but " + scans::listed(contents.others) +
                    "; expected " + scans::kFormats);
    throw IoError("no file matches " + pattern +
                  (folders ? ", but folders do: '" + pattern + "/*' for what is in them" : ""));
  }
  shorten_names(contents.clouds);
  std::sort(contents.clouds.begin(), contents.clouds.end(),
            [](const Found& a, const Found& b) { return scans::natural_less(a.name, b.name); });
  note_skipped(pattern, contents, notes);
  return scans_of(contents.clouds);
}

std::vector<ScanFile> of_file(const std::string& path) {
  if (!scans::is_cloud_file(path)) {
    constexpr std::size_t kStart = 4096;
    const std::string format = foreign_format(path, files::read_start(path, kStart));
    if (!format.empty()) throw IoError(path + " is " + format);
    return of_list(path);
  }
  std::vector<ScanFile> out = scans_of({{path, fs::path(path).filename().string()}});
  if (out.size() == 1)
    throw IoError(
        path +
        " is one cloud, expected a folder of clouds, a list of them (a text with one path "
        "a line), or a pattern in quotes as 'scans/*.ply'");
  return out;
}

}  // namespace

std::vector<ScanFile> list_scans(const std::string& path, bool recursive, Notes* notes) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) return of_folder(path, recursive, notes);
  if (recursive)
    throw IoError(path +
                  " is no folder: only a folder is searched with --recursive (Python: "
                  "recursive=True)");
  if (fs::exists(status)) return of_file(path);
  if (scans::is_pattern(path)) return of_pattern(path, notes);
  throw IoError("cannot read " + path + ": " +
                (fs::is_symlink(fs::symlink_status(path, error)) ? "it is a link to nothing"
                                                                 : "No such file or directory"));
}

}  // namespace gpureg::io
