// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gpureg/error.hpp"
#include "gpureg/prior.hpp"
#include "gpureg/registration.hpp"

/// Component `sets`: the pairs of a set of clouds, in a file that survives every interruption.
namespace gpureg {

/// A cloud of a run.
struct CloudIdentity {
  std::string name;         ///< unique
  std::string fingerprint;  ///< tells whether it is the one of before, as a hash of its file
};

/// What a run of pairs is of. Other clouds or other options make another run.
struct RunIdentity {
  /// name, value: "options.seed", "1"
  std::vector<std::pair<std::string, std::string>> settings;
  std::vector<CloudIdentity> clouds;  ///< by index

  /// The settings of a run: every option by its name, the prior of all pairs, and the version of
  /// gpureg, as another one may give other bits.
  static std::vector<std::pair<std::string, std::string>> settings_of(
      const RegistrationOptions& options, const std::optional<GravityPrior>& gravity = {});
};

/// A journal that cannot be read: a changed bit, or a file of another kind or version.
class DamagedJournal : public IoError {
 public:
  using IoError::IoError;
};

/// A journal of other clouds, options or pairs; what() names the first difference.
class OtherRun : public InvalidArgument {
 public:
  using InvalidArgument::InvalidArgument;
};

/// A journal that holds results, where a fresh one was asked for.
class UnfinishedRun : public IoError {
 public:
  using IoError::IoError;
};

/// The results of the pairs of a set in one file, each with a checksum, added as they come. A kill
/// at any moment leaves whole results and at most a torn one at the end, which the next run cuts
/// off. Results are kept without loss, so that a resumed run gives the bytes of an uninterrupted
/// one. Memory holds some bytes per pair, not the results. One process at a time writes a journal.
/// Not thread-safe.
class PairJournal {
 public:
  /// Treatment of an existing file: fresh refuses one that holds results, resume takes them up,
  /// restart discards them.
  enum class Mode { fresh, resume, restart };

  /// Opens or creates the file of a run.
  ///
  /// resume: the clouds that have results must be there under the same names, whatever their
  /// indices are now, and with the same fingerprints; others may have come, gone or changed. The
  /// settings must be the same, and every pair with a result one of `pairs`.
  /// @param path empty: no file, for runs that need not go on; memory then holds the results.
  /// @param pairs distinct; indices into run.clouds.
  /// @throws IoError naming the file: OtherRun, DamagedJournal or UnfinishedRun, it cannot be
  ///   written, or another process writes it.
  PairJournal(const std::string& path, const RunIdentity& run, const std::vector<Pair>& pairs,
              Mode mode);
  ~PairJournal();
  PairJournal(PairJournal&&) = delete;

  /// The first refusals of the constructor, before the clouds are read: another process writes the
  /// file; with fresh, it holds results. Changes nothing.
  static void check(const std::string& path, Mode mode);

  /// A setting of the run that a file is of; empty if there is none, or no such file.
  static std::string setting(const std::string& path, const std::string& name);

  const std::vector<Pair>& pairs() const { return pairs_; }
  std::size_t size() const { return places_.size(); }  ///< of all pairs
  std::size_t done() const { return done_; }
  std::size_t resumed() const { return resumed_; }  ///< of these, by earlier runs
  bool done(std::size_t k) const { return places_[k].size > 0; }

  /// The result of pair k, read from the file; skipped if it is not done.
  /// @throws IoError naming the file (also as DamagedJournal).
  RegistrationResult result(std::size_t k);

  /// Adds the result of pair k, which is not done; flush() hands all that were added to the system.
  /// @throws IoError naming the file; it ends with the last whole result.
  void add(std::size_t k, const RegistrationResult& result);
  void flush();

  /// Bytes of the caller's instead of a result: of a run whose settings say so, with a file. What
  /// is done is not empty.
  void add_bytes(std::size_t k, const std::string& bytes);
  std::string bytes(std::size_t k);

  /// A number that the caller noted last, about what the outputs of the run are; none: nothing
  /// noted yet.
  const std::optional<std::uint64_t>& note() const { return note_; }
  void set_note(std::uint64_t note);

  /// Deletes the file: the outputs are complete.
  void remove();

 private:
  struct Place {
    std::uint64_t at = 0;
    std::uint32_t size = 0;  // 0: not done
  };
  static constexpr std::uint32_t kNone = 0xffffffffu;

  void take_up(const RunIdentity& run);
  void begin(const RunIdentity& run);
  void append(std::uint32_t kind, const std::string& payload);

  std::string path_;
  int fd_ = -1;
  std::uint64_t end_ = 0;  // of the file, with what is pending
  std::string pending_;
  std::uint32_t clouds_in_file_ = 0;
  std::vector<std::uint32_t> number_of_;  // numbers of clouds in the file, by index
  std::vector<Pair> pairs_;
  std::vector<Place> places_;
  std::vector<RegistrationResult> kept_;  // without a file
  std::size_t done_ = 0, resumed_ = 0;
  std::optional<std::uint64_t> note_;
};

/// Results of a finished or unfinished journal, without the run that it is of.
struct JournalContents {
  std::vector<std::pair<std::string, std::string>> settings;
  std::vector<CloudIdentity> clouds;
  std::vector<Pair> pairs;  ///< indices into clouds
  std::vector<RegistrationResult> results;
};

/// @throws IoError naming the file (also as DamagedJournal).
JournalContents read_journal(const std::string& path);

/// Whether a file begins as a journal does.
bool is_journal(const std::string& path);

}  // namespace gpureg
