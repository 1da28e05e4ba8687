// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <sstream>
#include <utility>

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
    } catch (const IoError&) {
      readable_[k] = 0;
    } catch (const InvalidArgument&) {
      readable_[k] = 0;
    }
    return nullptr;  // the map says why
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

/// All pairs, neighbours first; the later scan is the source.
std::vector<Pair> pairs_by_distance(std::uint32_t scans) {
  std::vector<Pair> out;
  for (std::uint32_t apart = 1; apart < scans; ++apart)
    for (std::uint32_t target = 0; target + apart < scans; ++target)
      out.push_back({target + apart, target});
  return out;
}

std::string shown_range(const ScaleRange& range) {
  std::ostringstream text;
  text.precision(17);
  if (range.is_free())
    text << "free";
  else
    text << range.least << ":" << range.most;
  return text.str();
}

/// Bytes of a searched pair: its deviation, then scale and confidence of each candidate.
std::string bytes_of(const SearchedPair& pair) {
  std::vector<double> values{pair.deviation};
  for (const ScaleCandidate& candidate : pair.candidates) {
    values.push_back(candidate.scale);
    values.push_back(candidate.confidence);
  }
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)};
}

SearchedPair pair_of(const Pair& pair, const std::string& bytes) {
  std::vector<double> values(std::max<std::size_t>(1, bytes.size() / sizeof(double)));
  std::memcpy(values.data(), bytes.data(), bytes.size() / sizeof(double) * sizeof(double));
  SearchedPair out{pair.source, pair.target, {}, values[0]};
  for (std::size_t k = 1; k + 1 < values.size(); k += 2)
    out.candidates.push_back({values[k], values[k + 1]});
  return out;
}

void check(const RegistrationOptions& options, const ScaleSearch& search) {
  search.range.validate();
  options.validate();
  if (search.range.is_known()) throw InvalidArgument("scale: known, expected free or a range");
  require(options.method == RegistrationMethod::compatibility, "method", to_string(options.method),
          "compatibility: only it can search the scale");
}

/// The journal of a search; none without a file. Reads all fragments for their fingerprints.
std::unique_ptr<PairJournal> journal_of(const FragmentSet& fragments, Clouds& clouds,
                                        const std::vector<Pair>& pairs,
                                        const RegistrationOptions& options,
                                        const ScaleSearch& search) {
  if (search.journal.empty()) return nullptr;
  RunIdentity run;
  run.settings = RunIdentity::settings_of(options);
  run.settings.emplace_back("scale", shown_range(search.range));
  for (std::size_t k = 0; k < fragments.size(); ++k) {
    StopScope::poll_now();
    const bool readable = clouds.at(k, k) != nullptr;
    run.clouds.push_back({fragments.name(k), readable ? fragments.fingerprint(k) : "unreadable"});
  }
  return std::make_unique<PairJournal>(search.journal, run, pairs, search.journal_mode);
}

/// Searches pairs until loops settle all scales.
AgreedScales search_pairs(const Context& context, Clouds& clouds, const std::vector<Pair>& all,
                          std::size_t scans, const RegistrationOptions& options,
                          const ScaleSearch& search, FoundScales& out) {
  std::vector<SearchedPair> pairs;
  AgreedScales agreed = agreed_scales(scans, pairs);
  std::size_t known = 0;  // pairs that `agreed` is of
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Pair pair = all[k];
    // Scans so far apart for the first time.
    if (k > 0 && pair.target == 0 && pairs.size() > known) {
      agreed = agreed_scales(scans, pairs);
      known = pairs.size();
    }
    if (agreed.settled[pair.source] == agreed.settled[pair.target]) continue;
    if (out.journal && out.journal->done(k)) {
      pairs.push_back(pair_of(pair, out.journal->bytes(k)));
      continue;
    }
    StopScope::poll_now();
    const LoadedCloud* fixed = clouds.at(pair.target, pair.target);
    const LoadedCloud* moved = fixed != nullptr ? clouds.at(pair.source, pair.target) : nullptr;
    if (moved == nullptr) continue;
    pairs.push_back(searched(context, pair.source, pair.target, moved->view, fixed->view,
                             search.range, options));
    ++out.searched;
    if (out.journal) {
      out.journal->add_bytes(k, bytes_of(pairs.back()));
      out.journal->flush();
    }
    if (search.on_progress) search.on_progress(k + 1, all.size());
  }
  if (search.on_progress) search.on_progress(all.size(), all.size());
  return pairs.size() > known ? agreed_scales(scans, pairs) : agreed;
}

}  // namespace

FoundScales find_scales(const Context& context, const FragmentSet& fragments,
                        const RegistrationOptions& options, const ScaleSearch& search) {
  check(options, search);
  const std::size_t count = fragments.size();
  const std::vector<Pair> all = pairs_by_distance(static_cast<std::uint32_t>(count));
  Clouds clouds(fragments, options);
  FoundScales found;
  AgreedScales agreed;
  const StopScope scope([&] { return search.should_stop && search.should_stop(); });
  try {
    found.journal = journal_of(fragments, clouds, all, options, search);
    agreed = search_pairs(context, clouds, all, count, options, search, found);
  } catch (const Stopped&) {
    throw Cancelled("cancelled");
  }

  // Of parts that meet nowhere, voxels of a size that suits both are the best guess.
  std::map<std::uint32_t, double> unit;
  const auto voxel_of = [&](std::size_t k) -> float {
    const LoadedCloud* cloud = clouds.at(k, k);
    return cloud != nullptr ? suggest_voxel_size({cloud->view}).voxel_size : 0;
  };
  std::optional<float> of_first;
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
    found.scans.push_back({unit[part] * portable::exp(agreed.log_scales[k]), part});
  }
  return found;
}

}  // namespace gpureg::reconstruction
