// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "gpureg/point_cloud.hpp"
#include "gpureg/prepared_cloud.hpp"
#include "gpureg/prior.hpp"

namespace gpureg::cli {

/// What the user knows about the viewpoints of a cloud: "x,y,z", "none" or "auto".
struct ViewpointChoice {
  std::string text = "auto";

  /// @throws InvalidArgument naming option and text.
  void check(const char* option) const;
  /// Puts a given viewpoint into the cloud; "none" and "model" remove those of the file.
  void apply(PointCloud& cloud) const;
  /// @throws InvalidArgument naming option and file, with a remedy, for a model without normals.
  void check_cloud(const char* option, const PointCloud& cloud, const std::string& file) const;
  /// Says on stderr where a given viewpoint lies on a surface of the cloud, as no sensor does.
  void note_place(const char* option, const PreparedCloud& cloud, const std::string& file) const;
  /// View of a cloud that apply() has seen.
  PointCloudView view(const PointCloud& cloud) const;

 private:
  bool is_word() const;  ///< text is no place
};

/// The vertical direction: --up of both clouds, --source-up and --target-up of one.
struct UpChoice {
  std::string up, source_up, target_up;

  /// @param clouds, source, target what the help calls them.
  void add_to(Verb& verb, const std::string& clouds, const std::string& source,
              const std::string& target);
  bool empty() const { return up.empty() && source_up.empty() && target_up.empty(); }
  /// @return none without any. @throws InvalidArgument naming option and text.
  std::optional<GravityPrior> prior() const;
};

/// Gravity prior of `--up x,y,z[,degrees]`, for both clouds.
/// @param text of the option; empty: no prior.
/// @throws InvalidArgument naming option and text.
std::optional<GravityPrior> up_prior(const std::string& text);

}  // namespace gpureg::cli
