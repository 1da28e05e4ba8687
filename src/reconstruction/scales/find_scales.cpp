// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <optional>

#include "common/stop_scope.hpp"
#include "common/validate.hpp"
#include "gpureg/reconstruction/scales.hpp"
#include "gpureg/voxel_size.hpp"
#include "math/exponential.hpp"
#include "reconstruction/scales/log_scale_graph.hpp"

namespace gpureg::reconstruction {
namespace {

/// Points of the clouds that stay in memory; more, and they are read again.
constexpr std::size_t kMostPoints = 50'000'000;

/// Clouds that were read, until they are too many.
class Clouds {
 public:
  Clouds(const FragmentSet& fragments, const RegistrationOptions& options)
      : fragments_(fragments), options_(options), readable_(fragments.size(), 1) {}

  /// None: it cannot be read.
  const LoadedCloud* at(std::size_t k, std::size_t keep) {
    if (!readable_[k]) return nullptr;
    const auto known = read_.find(k);
    if (known != read_.end()) return &known->second;
    try {
      LoadedCloud cloud = fragments_.read(k, options_);
      cloud.view.validate();
      if (points_ + cloud.view.size > kMostPoints)
        for (auto other = read_.begin(); other != read_.end();) {
          if (other->first == keep) {
            ++other;
            continue;
          }
          points_ -= other->second.view.size;
          other = read_.erase(other);
        }
      points_ += cloud.view.size;
      return &read_.emplace(k, std::move(cloud)).first->second;
    } catch (const Error&) {  // its map says why
      readable_[k] = 0;
      return nullptr;
    }
  }

 private:
  const FragmentSet& fragments_;
  const RegistrationOptions& options_;
  std::vector<char> readable_;
  std::map<std::size_t, LoadedCloud> read_;
  std::size_t points_ = 0;
};

/// A pair of a cloud that cannot be prepared has no candidates.
SearchedPair searched(const Context& context, std::size_t source, std::size_t target,
                      const PointCloudView& moved, const PointCloudView& fixed,
                      const ScaleRange& range, const RegistrationOptions& options) {
  ScaledResult result;
  try {
    result = align_scaled_auto(context, moved, fixed, range, options);
  } catch (const InvalidArgument&) {  // its map says why
  }
  SearchedPair out{source, target, {}, result.scale_deviation};
  const bool any =
      result.scale_status == ScaleStatus::found || result.scale_status == ScaleStatus::ambiguous;
  for (const ScaleCandidate& candidate : result.candidates)
    if (any && candidate.confidence >= Options().min_edge_confidence)
      out.candidates.push_back(candidate);
  return out;
}

}  // namespace

std::vector<ScanScale> find_scales(const Context& context, const FragmentSet& fragments,
                                   const ScaleRange& range, const RegistrationOptions& options,
                                   const ScaleCallbacks& callbacks) {
  range.validate();
  options.validate();
  if (range.is_known()) throw InvalidArgument("scale: known, expected free or a range");
  require(options.method == RegistrationMethod::compatibility, "method", to_string(options.method),
          "compatibility: only it can search the scale");
  const std::size_t count = fragments.size(), all = count * (count - (count > 0)) / 2;
  Clouds clouds(fragments, options);
  std::vector<SearchedPair> pairs;
  AgreedScales agreed = agreed_scales(count, pairs);
  std::size_t done = 0;
  const StopScope scope([&] { return callbacks.should_stop && callbacks.should_stop(); });
  try {
    for (std::size_t apart = 1; apart < count; ++apart) {
      std::size_t searches = 0;
      for (std::size_t target = 0; target + apart < count; ++target) {
        const std::size_t source = target + apart;
        ++done;
        if (agreed.settled[source] == agreed.settled[target]) continue;
        StopScope::poll_now();
        const LoadedCloud* fixed = clouds.at(target, target);
        const LoadedCloud* moved = fixed != nullptr ? clouds.at(source, target) : nullptr;
        if (moved == nullptr) continue;
        pairs.push_back(
            searched(context, source, target, moved->view, fixed->view, range, options));
        ++searches;
        if (callbacks.on_progress) callbacks.on_progress(done, all);
      }
      if (searches > 0) agreed = agreed_scales(count, pairs);
    }
  } catch (const Stopped&) {
    throw Cancelled("cancelled");
  }
  if (callbacks.on_progress) callbacks.on_progress(all, all);

  // Of parts that meet nowhere, voxels of a size that suits both are the best guess.
  std::map<std::uint32_t, double> unit;
  const auto voxel_of = [&](std::size_t k) -> float {
    const LoadedCloud* cloud = clouds.at(k, k);
    return cloud != nullptr ? suggest_voxel_size({cloud->view}).voxel_size : 0;
  };
  std::optional<float> of_first;
  std::vector<ScanScale> out;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t part = agreed.parts[k];
    if (unit.count(part) == 0) {
      double& own = unit[part] = 1;
      if (part > 0) {
        if (!of_first) of_first = voxel_of(0);
        const float voxel = voxel_of(k);
        if (*of_first > 0 && voxel > 0)
          own = static_cast<double>(*of_first) / static_cast<double>(voxel);
      }
    }
    out.push_back({unit[part] * portable::exp(agreed.log_scales[k]), part});
  }
  return out;
}

}  // namespace gpureg::reconstruction
