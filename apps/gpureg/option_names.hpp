// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

/// Messages of the library name fields; the user of the command knows options.
namespace gpureg::cli {

/// Where the voxel size of this run comes from: nobody shall read of a size that he did not give.
enum class VoxelSizeOrigin { given, automatic };
void set_voxel_size_origin(VoxelSizeOrigin origin);

/// The message with options in place of the fields that they set: "--voxel-size" for voxel_size,
/// with "(auto)" or "(default)" where it was not given.
std::string in_option_names(std::string message);

}  // namespace gpureg::cli
