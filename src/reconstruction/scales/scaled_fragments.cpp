// SPDX-License-Identifier: BSD-3-Clause
#include <charconv>
#include <cmath>
#include <utility>

#include "common/validate.hpp"
#include "gpureg/reconstruction/scales.hpp"
#include "scale/ladder.hpp"

namespace gpureg::reconstruction {
namespace {

/// A scaled cloud, and the memory of what scaling leaves as it is.
struct OwnedCloud {
  LoadedCloud read;
  scale::ScaledCloud scaled;

  OwnedCloud(LoadedCloud&& cloud, double factor)
      : read(std::move(cloud)), scaled(read.view, factor) {}
};

}  // namespace

ScaledFragments::ScaledFragments(const FragmentSet& fragments, std::vector<double> scales)
    : fragments_(fragments), scales_(std::move(scales)) {
  if (scales_.size() != fragments_.size())
    throw InvalidArgument("scales: " + std::to_string(scales_.size()) + " of " +
                          std::to_string(fragments_.size()) + " fragments");
  for (std::size_t k = 0; k < scales_.size(); ++k)
    require(std::isfinite(scales_[k]) && scales_[k] > 0,
            ("scales[" + std::to_string(k) + "]").c_str(), scales_[k], "a finite number > 0");
}

LoadedCloud ScaledFragments::read(std::size_t k, const RegistrationOptions& options) const {
  RegistrationOptions own = options;  // the spacing of meshes is in the fragment's unit
  own.voxel_size = static_cast<float>(static_cast<double>(own.voxel_size) / scales_[k]);
  LoadedCloud cloud = fragments_.read(k, own);
  if (scales_[k] == 1) return cloud;
  const auto owned = std::make_shared<OwnedCloud>(std::move(cloud), scales_[k]);
  LoadedCloud out;
  out.view = owned->scaled.view();
  out.owner = owned;
  return out;
}

std::string ScaledFragments::fingerprint(std::size_t k) const {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, scales_[k]).ptr;
  return fragments_.fingerprint(k) + " * " + std::string(text, end);
}

}  // namespace gpureg::reconstruction
