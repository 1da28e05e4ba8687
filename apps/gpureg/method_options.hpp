// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

#include "gpureg/context.hpp"
#include "gpureg/options.hpp"

namespace gpureg::cli {

/// The options that `register` and `batch` have in common.
struct MethodOptions {
  float voxel_size = PrepareOptions{}.voxel_size;
  std::string preset = "default";
  std::string backend = "auto";
  unsigned threads = 0;
  std::uint32_t hypotheses = HypothesisOptions{}.count;
  std::uint32_t quality = kDefaultQuality;
  std::uint64_t seed = HypothesisOptions{}.seed;

  void add_to(CLI::App& verb);

  /// Throws InvalidArgument naming field and value.
  RegistrationOptions registration() const;

  /// Throws BackendUnavailable, InvalidArgument.
  Context context() const;
};

/// Refuses what is no number of 64 bits without a sign.
CLI::Validator natural_number();

}  // namespace gpureg::cli
