// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/saving/saved_state.hpp"

#include <cstring>
#include <type_traits>

#include "gpureg/error.hpp"
#include "loop_closure/saving/check_state.hpp"

namespace gpureg::loop_closure {
namespace {

// Layout: kMagic, version, size and checksum of the payload, payload. All numbers little-endian, as
// every processor that the library runs on.
constexpr char kMagic[8] = {'g', 'p', 'u', 'r', 'e', 'g', 'L', 'C'};
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kHeader = sizeof kMagic + sizeof kVersion + 2 * sizeof(std::uint64_t);

/// FNV-1a.
std::uint64_t checksum(const char* data, std::size_t size) {
  std::uint64_t hash = 14695981039346656037ull;
  for (std::size_t k = 0; k < size; ++k)
    hash = (hash ^ static_cast<unsigned char>(data[k])) * 1099511628211ull;
  return hash;
}

/// Appends values.
class Writer {
 public:
  static constexpr bool kReads = false;
  template <typename T>
  void value(T& v) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    bytes.append(reinterpret_cast<const char*>(&v), sizeof v);
  }
  template <typename T>
  std::uint64_t count(T& list) {
    std::uint64_t n = list.size();
    value(n);
    return n;
  }
  std::string bytes;
};

/// Reads them back in the same order.
class Reader {
 public:
  static constexpr bool kReads = true;
  Reader(const char* data, std::size_t size, const std::string& path)
      : data_(data), size_(size), path_(path) {}
  template <typename T>
  void value(T& v) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    if (size_ - at_ < sizeof v) fail();
    std::memcpy(&v, data_ + at_, sizeof v);
    at_ += sizeof v;
  }
  /// Every element takes a byte or more.
  template <typename T>
  std::uint64_t count(T&) {
    std::uint64_t n = 0;
    value(n);
    if (n > size_ - at_) fail();
    return n;
  }
  bool at_end() const { return at_ == size_; }
  [[noreturn]] void fail() const {
    throw IoError(path_ + ": its content contradicts itself; the file is damaged");
  }

 private:
  const char* data_;
  std::size_t size_, at_ = 0;
  const std::string& path_;
};

// One function for both directions: what is written is what is read.

template <typename File>
void flag(File& file, bool& v) {
  std::uint8_t byte = v ? 1 : 0;
  file.value(byte);
  v = byte != 0;
}

template <typename File, typename Matrix>
void matrix(File& file, Matrix& m) {
  for (int k = 0; k < m.size(); ++k) file.value(m.data()[k]);
}

template <typename File>
void pose(File& file, UnalignedIsometry3d& p) {
  matrix(file, p.matrix());
}

/// An optional value; `with` reads or writes it.
template <typename File, typename T, typename With>
void maybe(File& file, std::optional<T>& v, const With& with) {
  bool has = v.has_value();
  flag(file, has);
  if (!has) {
    v.reset();
    return;
  }
  if (!v) v.emplace();
  with(*v);
}

template <typename File, typename T, typename With>
void list(File& file, std::vector<T>& values, const With& with) {
  const std::uint64_t n = file.count(values);
  for (std::uint64_t k = 0; k < n; ++k) {
    if constexpr (File::kReads) values.emplace_back();
    with(values[static_cast<std::size_t>(k)]);
  }
}

template <typename File>
void prior(File& file, RegistrationPrior& p) {
  maybe(file, p.gravity, [&](GravityPrior& gravity) {
    matrix(file, gravity.source_up);
    matrix(file, gravity.target_up);
    file.value(gravity.max_angle);
  });
  maybe(file, p.pose, [&](PosePrior& known) {
    pose(file, known.target_from_source);
    file.value(known.max_rotation);
    file.value(known.max_translation);
  });
}

template <typename File>
void node(File& file, FragmentId& id, Node& n) {
  file.value(id);
  file.value(n.session);
  file.value(n.time);
  flag(file, n.has_cloud);
  file.value(n.fingerprint);
  maybe(file, n.up, [&](Eigen::Vector3d& up) { matrix(file, up); });
  pose(file, n.estimate);
  maybe(file, n.given, [&](UnalignedIsometry3d& given) { pose(file, given); });
  file.value(n.order);
  file.value(n.within_frame);
  file.value(n.between_frames);
  flag(file, n.placed);
  flag(file, n.look_within);
  flag(file, n.look_between);
  flag(file, n.look_back);
}

template <typename File>
void loop(File& file, Loop& l) {
  file.value(l.source);
  file.value(l.target);
  flag(file, l.from_host);
  file.value(l.state);
  file.value(l.reason);
  pose(file, l.target_from_source);
  matrix(file, l.information);
  file.value(l.confidence);
  file.value(l.weight);
  file.value(l.drift_ratio);
}

template <typename File>
void record(File& file, LoopRecord& r) {
  loop(file, r.loop);
  file.value(r.source);
  file.value(r.target);
  list(file, r.modes, [&](Mode& mode) {
    pose(file, mode.target_from_source);
    matrix(file, mode.information);
    file.value(mode.confidence);
    file.value(mode.drift_ratio);
  });
  file.value(r.mode);
  maybe(file, r.reported, [&](Loop& l) { loop(file, l); });
  file.value(r.number);
  flag(file, r.gated);
  flag(file, r.expanded);
}

template <typename File>
void all(File& file, State& state) {
  file.value(state.voxel_size);
  if constexpr (File::kReads) {
    const std::uint64_t n = file.count(state.nodes);
    for (std::uint64_t k = 0; k < n; ++k) {
      FragmentId id = 0;
      Node read;
      node(file, id, read);
      if (!state.nodes.emplace(id, std::move(read)).second) file.fail();
    }
    const std::uint64_t pairs = file.count(state.known);
    for (std::uint64_t k = 0; k < pairs; ++k) {
      FragmentPair pair;
      file.value(pair.first);
      file.value(pair.second);
      state.known.insert(pair);
    }
    const std::uint64_t sessions = file.count(state.connected);
    for (std::uint64_t k = 0; k < sessions; ++k) {
      std::int64_t session = 0;
      file.value(session);
      state.connected.insert(session);
    }
  } else {
    file.count(state.nodes);
    for (auto& [id, n] : state.nodes) {
      FragmentId copy = id;
      node(file, copy, n);
    }
    file.count(state.known);
    for (FragmentPair pair : state.known) {
      file.value(pair.first);
      file.value(pair.second);
    }
    file.count(state.connected);
    for (std::int64_t session : state.connected) file.value(session);
  }
  list(file, state.odometry, [&](Odometry& edge) {
    file.value(edge.source);
    file.value(edge.target);
    pose(file, edge.target_from_source);
    matrix(file, edge.information);
    flag(file, edge.modelled);
    file.value(edge.length);
    file.value(edge.steps);
    flag(file, edge.implied);
  });
  list(file, state.loops, [&](LoopRecord& r) { record(file, r); });
  list(file, state.queue, [&](Proposal& p) {
    file.value(p.source);
    file.value(p.target);
    file.value(p.kind);
    file.value(p.value);
    file.value(p.order);
    std::optional<RegistrationPrior> given;
    if (p.prior) given = *p.prior;
    maybe(file, given, [&](RegistrationPrior& q) { prior(file, q); });
    if (given) p.prior = std::make_shared<const RegistrationPrior>(*given);
  });
  file.value(state.arrivals);
  flag(file, state.graph_changed);
  flag(file, state.poses_changed);
}

template <typename T>
T number_at(const std::string& content, std::size_t at) {
  T v;
  std::memcpy(&v, content.data() + at, sizeof v);
  return v;
}

}  // namespace

std::string to_bytes(const State& state) {
  Writer file;
  all(file, const_cast<State&>(state));  // the writer only reads it
  const std::uint64_t size = file.bytes.size();
  const std::uint64_t sum = checksum(file.bytes.data(), file.bytes.size());
  std::string out(kMagic, sizeof kMagic);
  out.append(reinterpret_cast<const char*>(&kVersion), sizeof kVersion);
  out.append(reinterpret_cast<const char*>(&size), sizeof size);
  out.append(reinterpret_cast<const char*>(&sum), sizeof sum);
  return out + file.bytes;
}

State from_bytes(const std::string& content, const std::string& path) {
  if (content.size() < sizeof kMagic || std::memcmp(content.data(), kMagic, sizeof kMagic) != 0)
    throw IoError(path + " is no saved state of a LoopCloser");
  if (content.size() < kHeader) throw IoError(path + " is truncated");
  const auto version = number_at<std::uint32_t>(content, sizeof kMagic);
  if (version != kVersion)
    throw IoError(path + " has version " + std::to_string(version) + ", this library reads " +
                  std::to_string(kVersion));
  const auto size = number_at<std::uint64_t>(content, sizeof kMagic + sizeof kVersion);
  const auto sum = number_at<std::uint64_t>(content, sizeof kMagic + sizeof kVersion + sizeof size);
  if (size > content.size() - kHeader) throw IoError(path + " is truncated");
  if (size < content.size() - kHeader) throw IoError(path + " is longer than its header says");
  if (sum != checksum(content.data() + kHeader, static_cast<std::size_t>(size)))
    throw IoError(path + " is damaged: its checksum does not match");
  Reader file(content.data() + kHeader, static_cast<std::size_t>(size), path);
  State state;
  all(file, state);
  if (!file.at_end()) file.fail();
  try {
    check_state(state);
  } catch (const InvalidArgument& error) {
    throw IoError(path + ": " + error.what() + "; the file is damaged");
  }
  return state;
}

}  // namespace gpureg::loop_closure
