// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <utility>

#include "gpureg/pruning.hpp"
#include "gpureg/reconstruction/reconstruct.hpp"
#include "gpureg/sets/register_all.hpp"

namespace gpureg::reconstruction {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

constexpr std::uint32_t kUnusable = 0xffffffffu;

/// One call of reconstruct(), step by step.
class MapMaker {
 public:
  MapMaker(const Context& context, const FragmentSet& fragments, const MapInput& input,
           MapOptions options, const MapCallbacks& callbacks)
      : context_(context),
        fragments_(fragments),
        input_(input),
        options_(std::move(options)),
        callbacks_(callbacks) {
    if (options_.graph.threads == 0 && context.backend() == Backend::cpu)
      options_.graph.threads = static_cast<int>(context.threads());
    options_.refinement.threads = options_.graph.threads;
  }

  MapOfSet make() {
    check_input();
    choose_scans();
    out_.odometry = odometry();
    if (callbacks_.on_prepared) callbacks_.on_prepared(out_);
    check_enough();
    if (input_.results)
      take_results();
    else
      align();
    if (callbacks_.on_aligned) callbacks_.on_aligned(out_);
    for (RegistrationResult& result : out_.results) reduce(result);
    place();
    if (options_.with_surfaces || options_.with_refinement) make_surfaces();
    if (options_.with_refinement) refine_poses();
    if (!options_.with_surfaces) out_.surfaces.clear();
    return std::move(out_);
  }

 private:
  bool stopped() const { return callbacks_.should_stop && callbacks_.should_stop(); }
  void poll() const {
    if (stopped()) throw Cancelled("cancelled");
  }
  void tell(MapStep step, std::size_t done, std::size_t total) const {
    if (callbacks_.on_progress) callbacks_.on_progress(step, done, total);
  }

  void check_input() const {
    options_.validate();
    const auto name = [](const char* list, std::size_t k) {
      return std::string(list) + "[" + std::to_string(k) + "]";
    };
    const auto check = [&](const auto& list, const char* of) {
      for (std::size_t k = 0; k < list.size(); ++k)
        for (const std::uint32_t scan : {list[k].source, list[k].target})
          if (scan >= fragments_.size())
            throw InvalidArgument(name(of, k) + " is of scan " + std::to_string(scan) +
                                  ", but there are " + std::to_string(fragments_.size()));
    };
    if (input_.pairs) check(*input_.pairs, "pairs");
    check(input_.odometry, "odometry");
    if (!input_.world_from_scan.empty() && input_.world_from_scan.size() != fragments_.size())
      throw InvalidArgument("world_from_scan: " + std::to_string(input_.world_from_scan.size()) +
                            " poses of " + std::to_string(fragments_.size()) + " scans");
    if (input_.results && (!input_.pairs || input_.results->size() != input_.pairs->size()))
      throw InvalidArgument("results: " + std::to_string(input_.results->size()) + " for " +
                            std::to_string(input_.pairs ? input_.pairs->size() : 0) + " pairs");
  }

  /// Finds which fragments can be used, and prepares them where clouds are needed.
  void choose_scans() {
    const Clock::time_point start = Clock::now();
    place_of_.assign(fragments_.size(), kUnusable);
    if (!input_.results || options_.with_audit) {
      const SetCallbacks callbacks{
          [&](std::size_t done) { tell(MapStep::prepare, done, fragments_.size()); },
          callbacks_.should_stop};
      std::vector<PreparedFragment> all =
          prepare_all(context_, fragments_, options_.registration, callbacks);
      if (all.size() < fragments_.size()) throw Cancelled("cancelled");
      for (std::size_t k = 0; k < all.size(); ++k) {
        if (use(k, all[k].reason)) out_.prepared.push_back(std::move(all[k]));
      }
    } else {
      const bool read = options_.with_refinement || options_.with_surfaces;
      for (std::size_t k = 0; k < fragments_.size(); ++k) {
        poll();
        std::string reason;
        if (read) try {
            fragments_.read(k, options_.registration);
          } catch (const IoError& error) {
            reason = error.what();
          }
        use(k, reason);
      }
    }
    out_.seconds.prepare = since(start);
  }

  bool use(std::size_t k, const std::string& why_not) {
    if (!why_not.empty()) {
      out_.unusable[k] = why_not;
      return false;
    }
    place_of_[k] = static_cast<std::uint32_t>(out_.scans.size());
    out_.scans.push_back(k);
    return true;
  }

  void check_enough() const {
    if (!out_.unusable.empty() && out_.scans.size() < 2)
      throw IoError("fragments: fewer than two can be used: " + out_.unusable.begin()->second);
  }

  bool usable(std::uint32_t source, std::uint32_t target) const {
    return place_of_[source] != kUnusable && place_of_[target] != kUnusable;
  }

  std::vector<Odometry> odometry() const {
    std::vector<Odometry> known;
    if (!input_.world_from_scan.empty()) {
      std::vector<UnalignedIsometry3d> poses;
      for (const std::size_t k : out_.scans) poses.push_back(input_.world_from_scan[k]);
      known = odometry_of_poses(poses);
    }
    for (Odometry edge : input_.odometry) {
      if (!usable(edge.source, edge.target)) continue;
      edge.source = place_of_[edge.source];
      edge.target = place_of_[edge.target];
      known.push_back(std::move(edge));
    }
    return known;
  }

  void take_results() {
    for (std::size_t k = 0; k < input_.pairs->size(); ++k)
      if (const Pair& pair = (*input_.pairs)[k]; usable(pair.source, pair.target)) {
        out_.pairs.push_back({place_of_[pair.source], place_of_[pair.target]});
        out_.results.push_back((*input_.results)[k]);
      }
  }

  std::vector<Pair> chosen_pairs() {
    if (!input_.pairs) return options_.prune > 0 ? likely_pairs() : all_pairs(out_.scans.size());
    std::vector<Pair> pairs;
    for (const Pair& pair : *input_.pairs)
      if (usable(pair.source, pair.target))
        pairs.push_back({place_of_[pair.source], place_of_[pair.target]});
    return pairs;
  }

  /// The most alike ones, and those of odometry.
  std::vector<Pair> likely_pairs() {
    const Clock::time_point start = Clock::now();
    pruning::Options options;
    options.neighbors = options_.prune;
    options.threads = options_.graph.threads;
    std::vector<Pair> pairs = pruning::likely_pairs(clouds_of(out_.prepared), options);
    for (const Odometry& edge : out_.odometry)
      pairs.push_back({std::max(edge.source, edge.target), std::min(edge.source, edge.target)});
    const auto key = [](const Pair& pair) { return std::pair(pair.target, pair.source); };
    std::sort(pairs.begin(), pairs.end(),
              [&](const Pair& a, const Pair& b) { return key(a) < key(b); });
    pairs.erase(std::unique(pairs.begin(), pairs.end(),
                            [&](const Pair& a, const Pair& b) { return key(a) == key(b); }),
                pairs.end());
    out_.seconds.prune = since(start);
    return pairs;
  }

  void align() {
    out_.pairs = chosen_pairs();
    RunIdentity run;
    if (!options_.journal.empty()) {
      run.settings = RunIdentity::settings_of(options_.registration);
      for (const std::size_t k : out_.scans)
        run.clouds.push_back({fragments_.name(k), fragments_.fingerprint(k)});
    }
    out_.journal =
        std::make_unique<PairJournal>(options_.journal, run, out_.pairs, options_.journal_mode);
    PairJournal& journal = *out_.journal;
    const Clock::time_point start = Clock::now();
    tell(MapStep::align, journal.done(), journal.size());
    register_all(context_, clouds_of(out_.prepared), journal, options_.registration, {},
                 {[&](std::size_t done) { tell(MapStep::align, done, journal.size()); },
                  callbacks_.should_stop});
    out_.seconds.align = since(start);
    if (journal.done() < journal.size()) throw Cancelled("cancelled");
    for (std::size_t k = 0; k < journal.size(); ++k) out_.results.push_back(journal.result(k));
    out_.aligned_here = journal.done() - journal.resumed();
  }

  /// What Redwood's information matrix, which files of results have, leaves of the moments: so both
  /// give the same map.
  static void reduce(RegistrationResult& result) {
    if (result.target_moments.count == 0) return;  // as read
    result.source_moments =
        CorrespondenceMoments::from_redwood(result.source_moments.information_redwood());
    result.target_moments = {};
  }

  void place() {
    const Clock::time_point start = Clock::now();
    options_.graph.voxel_size = options_.registration.voxel_size;
    if (options_.with_audit) {
      options_.audit.should_stop = callbacks_.should_stop;
      AuditedReconstruction audited =
          reconstruct(context_, clouds_of(out_.prepared), out_.pairs, out_.results, options_.graph,
                      out_.odometry, options_.registration, options_.audit);
      out_.map = std::move(audited.map);
      out_.audit = std::move(audited.audit);
      out_.places_look_alike = audited.places_look_alike;
    } else {
      out_.map = reconstruct_from_poses(out_.scans.size(), out_.pairs, out_.results, options_.graph,
                                        out_.odometry);
    }
    out_.seconds.graph = since(start);
    poll();
  }

  void make_surfaces() {
    const Clock::time_point start = Clock::now();
    const RegistrationOptions finer = surface_options(options_.registration);
    const std::size_t all = out_.map.placed();
    out_.surfaces.resize(out_.scans.size());
    std::size_t done = 0;
    tell(MapStep::surfaces, 0, all);
    for (std::size_t k = 0; k < out_.scans.size(); ++k) {
      poll();
      if (!out_.map.scans[k].placed) continue;
      const LoadedCloud cloud = fragments_.read(out_.scans[k], finer);
      out_.surfaces[k] = surface_of(context_, cloud.view, options_.registration);
      tell(MapStep::surfaces, ++done, all);
    }
    out_.seconds.surfaces = since(start);
  }

  void refine_poses() {
    const Clock::time_point start = Clock::now();
    RefineOptions& options = options_.refinement;
    options.voxel_size = options_.registration.voxel_size;
    const auto all = static_cast<std::size_t>(options.iterations);
    options.should_stop = [&](int k) {
      tell(MapStep::refine, static_cast<std::size_t>(k), all);
      return stopped();
    };
    out_.refinement = refine(context_, out_.surfaces, out_.map, options);
    out_.seconds.refine = since(start);
    poll();
    tell(MapStep::refine, all, all);
  }

  const Context& context_;
  const FragmentSet& fragments_;
  const MapInput& input_;
  MapOptions options_;
  const MapCallbacks& callbacks_;
  std::vector<std::uint32_t> place_of_;  // of a fragment among the scans
  MapOfSet out_;
};

}  // namespace

void MapOptions::validate() const {
  registration.validate();
  graph.validate();
  audit.validate();
  refinement.validate();
}

MapOfSet reconstruct(const Context& context, const FragmentSet& fragments, const MapInput& input,
                     const MapOptions& options, const MapCallbacks& callbacks) {
  return MapMaker(context, fragments, input, options, callbacks).make();
}

}  // namespace gpureg::reconstruction
