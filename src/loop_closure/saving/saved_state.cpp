// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/saving/saved_state.hpp"

#include <type_traits>

#include "files/envelope.hpp"
#include "gpureg/error.hpp"
#include "loop_closure/saving/check_state.hpp"

namespace gpureg::loop_closure {
namespace {

constexpr files::BinaryKind kKind{"gpuregLC", 2, "saved state of a LoopCloser"};

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
class Reader : public files::PayloadReader {
 public:
  static constexpr bool kReads = true;
  using PayloadReader::PayloadReader;
  template <typename T>
  void value(T& v) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    values(&v, 1);
  }
  /// Every element takes a byte or more.
  template <typename T>
  std::uint64_t count(T&) {
    std::uint64_t n = 0;
    value(n);
    if (n > left()) fail();
    return n;
  }
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

}  // namespace

std::string to_bytes(const State& state) {
  Writer file;
  all(file, const_cast<State&>(state));  // the writer only reads it
  files::Envelope envelope;
  envelope.add(file.bytes);
  return envelope.header(kKind) + file.bytes;
}

State from_bytes(const std::string& content, const std::string& path) {
  Reader file(files::payload_of(content, kKind, path), path);
  State state;
  all(file, state);
  if (file.left() > 0) file.fail();
  try {
    check_state(state);
  } catch (const InvalidArgument& error) {
    throw IoError(path + ": " + error.what() + "; the file is damaged");
  }
  return state;
}

}  // namespace gpureg::loop_closure
