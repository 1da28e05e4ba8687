// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gpureg/registration.hpp"
#include "gpureg/sets/fragment_set.hpp"
#include "gpureg/sets/pair_journal.hpp"

/// Component `sets`: all pairs of a set, without losing work.
namespace gpureg {

/// Every pair of a set, each with the later fragment as its source.
std::vector<Pair> all_pairs(std::size_t fragments);

/// What a run of a set is of. Reads the fragments for their fingerprints.
RunIdentity identity_of(const FragmentSet& fragments, const RegistrationOptions& options = {});

/// Aligns the pairs of a journal that it lacks, of clouds in memory.
/// @param clouds by the indices of the pairs.
/// @param gravity a prior of all pairs.
/// @param callbacks on_progress receives the number of pairs that are done. should_stop ends the
///   call before the next chunk; what is done is in the journal.
/// @throws Error as align_batch() and PairJournal::add().
void register_all(const Context& context, const std::vector<PreparedCloud>& clouds,
                  PairJournal& journal, const RegistrationOptions& options = {},
                  const std::optional<GravityPrior>& gravity = {},
                  const SetCallbacks& callbacks = {});

/// Bytes that prepared fragments may take, unless said otherwise.
inline constexpr std::size_t kFragmentMemory = std::size_t(4) << 30;

/// Aligns pairs of a set whose fragments do not all fit into memory: those used last stay prepared.
/// One for each context, used by one thread.
class FragmentAligner {
 public:
  /// @param memory bytes that prepared fragments may take.
  FragmentAligner(Context context, const FragmentSet& fragments, RegistrationOptions options,
                  std::size_t memory = kFragmentMemory);
  ~FragmentAligner();

  /// Receives the results of pairs in their order, without those of fragments that cannot be used.
  using Take = std::function<void(std::size_t k, const RegistrationResult& result)>;

  /// @param pairs indices of fragments. Neighbours should share fragments, see in_tiles().
  /// @param should_stop polled often; may be empty.
  /// @return false: stopped. Take has received what was done.
  bool align(const std::vector<Pair>& pairs, const Take& take,
             const std::function<bool()>& should_stop = {});

  /// Fragments that could not be used so far, and why.
  const std::map<std::size_t, std::string>& unusable() const;
  std::size_t prepared() const;  ///< preparations so far
  std::size_t bytes() const;     ///< of the fragments that are prepared

 private:
  class State;
  std::unique_ptr<State> state_;
};

/// The order in which pairs are best aligned: tiles of 64 fragments by 64, whose clouds fit into
/// memory together.
/// @return indices of pairs.
std::vector<std::size_t> in_tiles(const std::vector<Pair>& pairs);

/// What register_all() says of a run.
struct RegisterAllReport {
  std::map<std::size_t, std::string> unusable;  ///< fragments without a result, and why
  bool complete = true;                         ///< false: should_stop ended the call
};

/// Aligns the pairs of a journal that it lacks, on several contexts, one thread each. Results do
/// not depend on their number.
/// @param go_on called ten times a second in the calling thread, with the number of pairs that are
///   done and that of preparations so far; false ends the call as soon as the chunks that began are
///   done. What is done is in the journal. May be empty.
/// @throws Error as above, of the thread that failed first, or what go_on throws, when no thread
///   runs any more.
RegisterAllReport register_all(
    const std::vector<Context>& contexts, const FragmentSet& fragments, PairJournal& journal,
    const RegistrationOptions& options = {}, std::size_t memory = kFragmentMemory,
    const std::function<bool(std::size_t done, std::size_t prepared)>& go_on = {});

}  // namespace gpureg
