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

/// What a verb does with its paths before it works: each input must be there and readable, each
/// output must be writable (check_output), and no output may be the same file as another one or as
/// an input, however it is spelt. Empty paths are fine, and devices and pipes.
/// @param inputs files and folders. Of a folder count the files that belong to a scene, its truth
/// or
///   a map; of the output of `reconstruct` also those of its scans.
/// @throws IoError, InvalidArgument naming option and path.
void check_outputs(const std::vector<NamedPath>& outputs, const std::vector<NamedPath>& inputs);

}  // namespace gpureg::cli
