// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace gpureg::cli {

/// Throws IoError where the path cannot become a file: checked before hours of work. Empty paths
/// are accepted.
void check_output(const std::string& path);

/// A file as the command line names it.
struct NamedPath {
  std::string name;  ///< of the option or argument
  std::string path;
};

/// The files of a folder that `name` stands for, as far as they are there: those that the verbs
/// read.
std::vector<NamedPath> truth_files(const std::string& name, const std::string& folder);
std::vector<NamedPath> scene_files(const std::string& name, const std::string& folder);

/// check_output() for each, and throws InvalidArgument where an output is the same file as another
/// or as one of the inputs, however it is spelt. Empty paths are fine, and devices and pipes.
void check_outputs(const std::vector<NamedPath>& outputs, const std::vector<NamedPath>& inputs);

}  // namespace gpureg::cli
