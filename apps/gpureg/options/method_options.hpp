// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "gpureg/context.hpp"
#include "gpureg/options.hpp"
#include "gpureg/point_cloud.hpp"
#include "inputs/scene.hpp"

namespace gpureg::cli {

/// The options that `register` and `batch` have in common.
struct MethodOptions {
  float voxel_size = RegistrationOptions{}.voxel_size;
  bool automatic_voxel_size = true;  ///< to be chosen by the clouds, see choose_voxel_size
  std::string preset = "default";
  std::string backend = "auto";
  unsigned threads = 0;
  std::uint32_t quality = kDefaultQuality;
  std::uint64_t seed = RegistrationOptions{}.seed;
  std::optional<double> min_confidence;  ///< none: the preset's own
  std::vector<std::string> set;          ///< further options, as "prepare.depth_maps=4"
  std::string calibration;               ///< file of `gpureg calibrate`; empty: none

  void add_to(Verb verb);
  void add_calibration_to(Verb verb);

  /// Whether the user gave the option, as "--quality"; add_to() was called.
  bool given(const std::string& option) const { return verb_->given(option); }

  /// Whether the user gave a confidence to report from, by --min-confidence or --set.
  bool sets_confidence() const;
  /// Refuse what would do nothing: these options where the user gave them, and any --set outside
  /// these groups. @param why as "with --pose". @throws InvalidArgument naming the option.
  void refuse(const std::vector<std::string>& options, const std::string& why) const;
  void refuse_set_outside(const std::vector<std::string>& groups, const std::string& why) const;

  /// Throws InvalidArgument naming field and value, or options that do not go together.
  RegistrationOptions registration() const;

  /// Says on stderr where the calibration was made with another voxel size, once that is chosen.
  void note_calibration() const;

  /// Sets an automatic voxel size to the suggestion of the clouds. what: for the message. Without a
  /// suggestion there is nothing to align, in voxels of any size; who asked for it hears why, by an
  /// InvalidArgument.
  void choose_voxel_size(const std::vector<PointCloudView>& clouds, const std::string& what);

  /// The same by some scans of a folder, evenly chosen; the size of an earlier run if it has a
  /// journal, which says it.
  void choose_voxel_size(const ScanInput& input, const std::string& journal = "");

  /// The same by some of so many scans, which read(k) reads.
  void choose_voxel_size(std::size_t scans, const std::function<LoadedCloud(std::size_t)>& read,
                         const std::string& what);

  /// Sets the voxel size of what there is already, as of a map.
  void take_voxel_size(float size) {
    voxel_size = size;
    automatic_voxel_size = false;
  }

  /// The voxel size for people: "0.05", "0.05, chosen from the clouds".
  std::string voxel_size_text() const;

  /// Says on stderr what fragments, prepared by this voxel size, show about it, unless quiet.
  /// @throws InvalidArgument where it is larger than the largest fragment.
  void check_sizes(float used, const PreparedSizes& sizes, bool quiet) const;

  /// Throws BackendUnavailable, InvalidArgument.
  Context context() const;

 private:
  std::optional<Verb> verb_;
};

}  // namespace gpureg::cli
