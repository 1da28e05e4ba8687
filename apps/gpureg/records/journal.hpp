// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "gpureg/result.hpp"
#include "json/json_fwd.hpp"

namespace gpureg::cli {

/// Journal of a batch beside its output: a line that identifies the run, then one line per pair,
/// each with a checksum. A run that goes on with fragments that the one before could not use adds
/// another line that identifies it. A kill at any moment leaves complete lines and at most one torn
/// line at the end, which a resumed run truncates. The outputs of a resumed run equal those of an
/// uninterrupted one: lines hold results without loss.
class Journal {
 public:
  /// Treatment of an existing journal: fresh refuses one that holds pairs.
  enum class Mode { fresh, resume, restart };

  /// Receives the pair of fragments i and j of a resumed journal; throws InvalidArgument where it
  /// cannot be one of the run.
  using Take = std::function<void(int i, int j, RegistrationResult&& result)>;

  /// Identity of this run, or of its part that an earlier header is about.
  using HeaderOf = std::function<Json(const Json* earlier)>;

  /// Opens or creates the journal. resume: continue an existing journal, refused where it is not of
  /// a part of this run. Throws IoError, also where another process writes the same journal.
  Journal(std::string path, const HeaderOf& header_of, Mode mode, const Take& take);

  /// The identity of the run that a journal is of, null where there is no readable one.
  static Json header(const std::string& path);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Early check, before the header and hours of work: refuses a journal that another process
  /// writes, and with fresh one that holds pairs. Changes nothing. Throws IoError.
  static void check(const std::string& path, Mode mode);

  /// A line of a journal: checksum, text, newline.
  static std::string line_of(const std::string& text);

  /// Whether the outputs are of this run, as far as it was when it was interrupted.
  bool wrote_outputs() const { return wrote_outputs_; }
  void note_outputs();

  /// Adds a pair; flush() hands all pairs added to the system. Throw IoError.
  void add(int i, int j, const RegistrationResult& result);
  void flush();

  /// Deletes the file: the outputs are complete.
  void remove();

 private:
  std::size_t take_up(const HeaderOf& header_of, const Take& take);
  void take_header(const Json& earlier, const HeaderOf& header_of);
  void take_line(const Json& json, const Take& take);

  std::string path_;
  int fd_ = -1;
  std::string pending_;
  std::string earlier_;  // the last header of a resumed journal
  bool wrote_outputs_ = false;
};

}  // namespace gpureg::cli
