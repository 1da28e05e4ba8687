// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

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

/// Gravity prior of `--up x,y,z[,degrees]`, for both clouds.
/// @param text of the option; empty: no prior.
/// @throws InvalidArgument naming option and text.
std::optional<GravityPrior> up_prior(const std::string& text);

}  // namespace gpureg::cli
