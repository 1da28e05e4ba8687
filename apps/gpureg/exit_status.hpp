// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace gpureg::cli {

/// Exit status of the command. Errors are exceptions up to run_program(), which turns them into
/// kBadInput.
enum ExitStatus {
  kOk = 0,
  kNoAlignment = 1,
  kBadInput = 2,
  kIncomplete = 3,  ///< done and written without fragments that could not be used
  kInterrupted = 130
};

}  // namespace gpureg::cli
