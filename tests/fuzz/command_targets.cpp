// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz/targets.hpp"
#include "io/run_reader.hpp"
#include "records/initial_poses.hpp"
#include "records/journal.hpp"
#include "records/result_file.hpp"

namespace gpureg::fuzz {
namespace {

/// Runs a reader of the command, which may refuse with an IoError or InvalidArgument.
template <typename Read>
void read(std::string_view bytes, const Read& read_file) {
  const test::MemoryFile file(bytes);
  try {
    read_file(file.path());
  } catch (const IoError& error) {
    if (std::string_view(error.what()).find(file.path()) == std::string_view::npos)
      broken("an error names its file");
  } catch (const InvalidArgument&) {
  }
}

void read_result(std::string_view bytes) {
  read(bytes, [](const std::string& path) {
    const cli::ResultFile result = cli::read_result(path);
    result.mean_milliseconds();
    result.mean_prepare_milliseconds();
    for (const cli::PairRecord& pair : result.pairs) cli::result_from_record(pair, nullptr);
  });
}

void read_journal(std::string_view bytes) {
  read(bytes, [](const std::string& path) {
    // The header of the corpus.
    cli::Journal journal(path, cli::Json{{"version", 1}}, cli::Journal::Mode::resume);
    for (const auto& [pair, entry] : journal.entries())
      cli::result_from_record(entry.pair, entry.information);
  });
}

void read_initial_poses(std::string_view bytes) {
  read(bytes, [](const std::string& path) { cli::read_initial_poses(path); });
}

}  // namespace

std::vector<Target> command_targets() {
  return {
      {"result", read_result}, {"journal", read_journal}, {"initial_poses", read_initial_poses}};
}

}  // namespace gpureg::fuzz
