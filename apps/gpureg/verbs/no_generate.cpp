// SPDX-License-Identifier: BSD-3-Clause
#include "command.hpp"
#include "gpureg/error.hpp"

namespace gpureg::cli {

// The verb exists in every build, so that a script gets the reason for its absence.
void add_generate(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("generate", "Not in this build: it was made without Embree");
  verb->allow_extras();
  verb->callback([&chosen] {
    chosen = []() -> int {
      throw BackendUnavailable("generate is not in this build, which was made without Embree");
    };
  });
}

}  // namespace gpureg::cli
