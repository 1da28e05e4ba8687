// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/sets/pair_journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <utility>

#include "files/envelope.hpp"
#include "sets/journal_file.hpp"
#include "sets/result_bytes.hpp"

namespace gpureg {
namespace {

using namespace sets;
using Settings = std::vector<std::pair<std::string, std::string>>;

constexpr std::size_t kPairHead = 2 * sizeof(std::uint32_t);

/// Closes a file at the end of a scope.
struct File {
  int fd;
  explicit File(const std::string& path) : fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~File() {
    if (fd >= 0) ::close(fd);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
};

void lock_file(int fd, const std::string& path) {
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    throw IoError(path + " is in use: another run writes the same result");
}

std::string text_of(const Settings& settings) {
  std::string text;
  for (const auto& [name, value] : settings) text += name + "=" + value + "\n";
  return text;
}

Settings settings_in(const std::string& text) {
  Settings out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string line = text.substr(at, end - at);
    const std::size_t equals = std::min(line.find('='), line.size());
    out.emplace_back(line.substr(0, equals), line.substr(std::min(equals + 1, line.size())));
    at = end + 1;
  }
  return out;
}

CloudIdentity cloud_in(const std::string& payload) {
  const std::size_t zero = std::min(payload.find('\0'), payload.size());
  return {payload.substr(0, zero), payload.substr(std::min(zero + 1, payload.size()))};
}

void check_settings(const Settings& before, const Settings& now) {
  for (const auto& [name, value] : now) {
    const auto same = std::find_if(before.begin(), before.end(),
                                   [&n = name](const auto& other) { return other.first == n; });
    if (same == before.end()) throw OtherRun(name + " was not given");
    if (same->second == value) continue;
    throw OtherRun(name + " was " + same->second + ", now " + value + "; give the same options");
  }
}

/// What is in a file, pair by pair.
struct Scan {
  Settings settings;
  std::vector<CloudIdentity> clouds;
  struct Found {
    std::uint32_t target, source;  // numbers of clouds
    std::uint64_t at;              // of the bytes of the result
    std::uint32_t size;
  };
  std::vector<Found> pairs;
  std::optional<std::uint64_t> note;
  std::uint64_t end = 0;
};

Scan scan_of(int fd, const std::string& path) {
  Scan scan;
  RecordReader reader(fd, path);
  while (reader.next()) {
    files::PayloadReader payload(reader.payload(), path);
    switch (reader.kind()) {
      case kSettings:
        scan.settings = settings_in(reader.payload());
        break;
      case kCloud:
        scan.clouds.push_back(cloud_in(reader.payload()));
        break;
      case kPair: {
        std::uint32_t numbers[2];
        if (payload.left() < sizeof numbers) reader.damaged("a pair has no clouds");
        payload.values(numbers, 2);
        if (std::max(numbers[0], numbers[1]) >= scan.clouds.size())
          reader.damaged("a pair is of no cloud");
        scan.pairs.push_back({numbers[0], numbers[1], reader.payload_at() + kPairHead,
                              static_cast<std::uint32_t>(payload.left())});
        break;
      }
      case kNote: {
        std::uint64_t note = 0;
        if (payload.left() != sizeof note) reader.damaged("a note is no number");
        payload.values(&note, 1);
        scan.note = note;
        break;
      }
      default:
        reader.damaged("another version of gpureg wrote it");
    }
  }
  scan.end = reader.end();
  return scan;
}

RegistrationResult result_in(int fd, const std::string& path, std::uint64_t at,
                             std::uint32_t size) {
  try {
    return result_of(read_part(fd, path, at, size), path);
  } catch (const DamagedJournal&) {
    throw;
  } catch (const IoError& error) {
    throw DamagedJournal(error.what());
  }
}

// Settings alone hold no work that could be lost.
void refuse_unfinished(int fd, const std::string& path) {
  bool unfinished = true;  // of another kind: not to be discarded without a word
  try {
    unfinished = !scan_of(fd, path).pairs.empty();
  } catch (const DamagedJournal&) {
  }
  if (unfinished) throw UnfinishedRun(path + " is of an unfinished run");
}

}  // namespace

void PairJournal::check(const std::string& path, Mode mode) {
  const File file(path);
  if (file.fd < 0) return;  // no journal, or an error that the constructor reports
  lock_file(file.fd, path);
  if (mode == Mode::fresh) refuse_unfinished(file.fd, path);
}

std::string PairJournal::setting(const std::string& path, const std::string& name) {
  const File file(path);
  if (file.fd < 0) return "";
  try {
    RecordReader reader(file.fd, path);
    if (!reader.next() || reader.kind() != kSettings) return "";
    for (const auto& [setting, value] : settings_in(reader.payload()))
      if (setting == name) return value;
  } catch (const DamagedJournal&) {  // the constructor says so
  }
  return "";
}

PairJournal::PairJournal(const std::string& path, const RunIdentity& run,
                         const std::vector<Pair>& pairs, Mode mode)
    : path_(path), pairs_(pairs), places_(pairs.size()) {
  if (path_.empty()) {
    kept_.resize(pairs.size());
    return;
  }
  fd_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (fd_ < 0) fail(path_, "write", errno);
  try {
    lock_file(fd_, path_);
    if (mode == Mode::fresh) refuse_unfinished(fd_, path_);
    if (mode == Mode::resume) take_up(run);
    if (::ftruncate(fd_, static_cast<off_t>(end_)) != 0) fail(path_, "write", errno);
    begin(run);
    flush();
  } catch (...) {
    ::close(fd_);
    throw;
  }
}

PairJournal::~PairJournal() {
  if (fd_ >= 0) ::close(fd_);
}

void PairJournal::take_up(const RunIdentity& run) {
  const Scan scan = scan_of(fd_, path_);
  if (scan.settings.empty()) return;  // torn before anything was done
  check_settings(scan.settings, run.settings);
  std::map<std::string, std::uint32_t> index;
  for (std::uint32_t k = 0; k < run.clouds.size(); ++k) index[run.clouds[k].name] = k;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> place;
  for (std::size_t k = 0; k < pairs_.size(); ++k) place[{pairs_[k].target, pairs_[k].source}] = k;
  const auto now = [&](std::uint32_t number) {
    const CloudIdentity& cloud = scan.clouds[number];
    const auto found = index.find(cloud.name);
    if (found == index.end()) throw OtherRun(cloud.name + " is not there any more; put it back");
    if (run.clouds[found->second].fingerprint != cloud.fingerprint)
      throw OtherRun(cloud.name + " is another cloud than before; put it back");
    return found->second;
  };
  for (const Scan::Found& pair : scan.pairs) {
    const std::uint32_t target = now(pair.target), source = now(pair.source);
    const std::string names =
        "pair " + scan.clouds[pair.target].name + " " + scan.clouds[pair.source].name;
    const auto found = place.find({target, source});
    if (found == place.end()) throw OtherRun(names + " is none of this run; give the same pairs");
    if (done(found->second))
      throw DamagedJournal(path_ + " is damaged: " + names + " is there twice");
    places_[found->second] = {pair.at, pair.size};
    ++done_;
  }
  resumed_ = done_;
  note_ = scan.note;
  end_ = scan.end;
  clouds_in_file_ = static_cast<std::uint32_t>(scan.clouds.size());
  number_of_.assign(run.clouds.size(), kNone);
  for (std::uint32_t number = 0; number < scan.clouds.size(); ++number)
    if (const auto found = index.find(scan.clouds[number].name);
        found != index.end() &&
        run.clouds[found->second].fingerprint == scan.clouds[number].fingerprint)
      number_of_[found->second] = number;
}

/// The settings of a new file, and the clouds that the file does not have.
void PairJournal::begin(const RunIdentity& run) {
  if (end_ == 0) {
    pending_ = journal_head();
    end_ = pending_.size();
    append(kSettings, text_of(run.settings));
    number_of_.assign(run.clouds.size(), kNone);
  }
  for (std::size_t k = 0; k < run.clouds.size(); ++k) {
    if (number_of_[k] != kNone) continue;
    append(kCloud, run.clouds[k].name + '\0' + run.clouds[k].fingerprint);
    number_of_[k] = clouds_in_file_++;
  }
}

void PairJournal::append(std::uint32_t kind, const std::string& payload) {
  const std::string record = record_of(kind, payload);
  pending_ += record;
  end_ += record.size();
}

RegistrationResult PairJournal::result(std::size_t k) {
  if (!done(k)) return {};
  if (fd_ < 0) return kept_[k];
  if (!pending_.empty()) flush();
  return result_in(fd_, path_, places_[k].at, places_[k].size);
}

std::string PairJournal::bytes(std::size_t k) {
  if (!done(k)) return {};
  if (!pending_.empty()) flush();
  return read_part(fd_, path_, places_[k].at, places_[k].size);
}

void PairJournal::add(std::size_t k, const RegistrationResult& result) {
  if (fd_ >= 0) return add_bytes(k, bytes_of(result));
  ++done_;
  kept_[k] = result;
  places_[k].size = 1;
}

void PairJournal::add_bytes(std::size_t k, const std::string& bytes) {
  ++done_;
  const std::uint32_t numbers[] = {number_of_[pairs_[k].target], number_of_[pairs_[k].source]};
  append(kPair, std::string(files::bytes_of(numbers, 2)) + bytes);
  places_[k] = {end_ - sizeof(std::uint64_t) - bytes.size(),
                static_cast<std::uint32_t>(bytes.size())};
}

void PairJournal::set_note(std::uint64_t note) {
  if (fd_ >= 0 && note_ != note) append(kNote, std::string(files::bytes_of(&note, 1)));
  note_ = note;
  flush();
}

void PairJournal::flush() {
  const std::uint64_t begin = end_ - pending_.size();
  std::size_t written = 0;
  while (written < pending_.size()) {
    const ssize_t n = ::pwrite(fd_, pending_.data() + written, pending_.size() - written,
                               static_cast<off_t>(begin + written));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      // The written part may end in the middle of a record; nothing may follow it.
      const int error = errno;
      pending_.clear();
      fail(path_, "write", error);
    }
    written += static_cast<std::size_t>(n);
  }
  pending_.clear();
}

void PairJournal::remove() {
  if (fd_ >= 0 && ::unlink(path_.c_str()) != 0) fail(path_, "delete", errno);
}

JournalContents read_journal(const std::string& path) {
  const File file(path);
  if (file.fd < 0) fail(path, "read", errno);
  Scan scan = scan_of(file.fd, path);
  JournalContents out{std::move(scan.settings), std::move(scan.clouds), {}, {}};
  for (const Scan::Found& pair : scan.pairs) {
    out.pairs.push_back({pair.source, pair.target});
    out.results.push_back(result_in(file.fd, path, pair.at, pair.size));
  }
  return out;
}

bool is_journal(const std::string& path) {
  const File file(path);
  char begin[kJournalMagic.size()];
  return file.fd >= 0 && ::pread(file.fd, begin, sizeof begin, 0) == sizeof begin &&
         std::string_view(begin, sizeof begin) == kJournalMagic;
}

}  // namespace gpureg
