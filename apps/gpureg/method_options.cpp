// SPDX-License-Identifier: BSD-3-Clause
#include "method_options.hpp"

#include <cerrno>
#include <cstdlib>

namespace gpureg::cli {

namespace {

// CLI11 takes -4 for an unsigned number and wraps it around.
std::string check_natural(const std::string& text) {
  const bool digits = !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
  errno = 0;
  if (digits) std::strtoull(text.c_str(), nullptr, 10);
  return digits && errno == 0 ? "" : text + " is no whole number from 0 to 2^64 - 1";
}

}  // namespace

CLI::Validator natural_number() { return CLI::Validator(&check_natural, "", "natural number"); }

void MethodOptions::add_to(CLI::App& verb) {
  verb.add_option("--voxel-size", voxel_size,
                  "Edge of the downsampling voxel in metres; every other length follows from it")
      ->capture_default_str();
  verb.add_option("--preset", preset, "default: poses from compatible matches, judged by evidence; loopsmart: the paper's algorithm")
      ->check(CLI::IsMember({"default", "loopsmart"}))
      ->capture_default_str();
  verb.add_option("--backend", backend, "auto: CUDA where there is a device, else the CPU")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->capture_default_str();
  verb.add_option("--threads", threads, "Threads of the CPU backend; 0: all")
      ->check(natural_number())
      ->capture_default_str();
  verb.add_option("--hypotheses", hypotheses,
                  "Quadruples of matches that the preset loopsmart tries per pair")
      ->check(natural_number())
      ->capture_default_str();
  verb.add_option("--quality", quality, "From 0, the fastest, to 10, which finds the most; of the preset default")
      ->check(CLI::Range(0u, kHighestQuality))
      ->capture_default_str();
  verb.add_option("--seed", seed, "Same seed, same result, on any machine")
      ->check(natural_number())
      ->capture_default_str();
}

RegistrationOptions MethodOptions::registration() const {
  RegistrationOptions options = preset == "loopsmart"
                                    ? RegistrationOptions::loopsmart(voxel_size)
                                    : RegistrationOptions::from_voxel_size(voxel_size, quality);
  options.hypothesis.count = hypotheses;
  options.hypothesis.seed = seed;
  options.validate();
  return options;
}

Context MethodOptions::context() const {
  if (backend == "cpu") return Context::cpu(threads);
  if (backend == "cuda") return Context::cuda();
  const Context best = Context::best();
  return best.backend() == Backend::cpu && threads > 0 ? Context::cpu(threads) : best;
}

}  // namespace gpureg::cli
