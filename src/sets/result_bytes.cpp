// SPDX-License-Identifier: BSD-3-Clause
#include "sets/result_bytes.hpp"

#include <type_traits>

#include "common/rigid.hpp"
#include "fields/evidence.hpp"
#include "fields/statistics.hpp"
#include "files/envelope.hpp"

namespace gpureg::sets {
namespace {

// More than any options give: memory stays bounded.
constexpr std::uint32_t kMostModes = 4096;

struct Writer {
  std::string out;

  template <typename T>
  void number(const T& value) {
    out += files::bytes_of(&value, 1);
  }
  template <typename T>
  std::uint32_t size(const std::vector<T>& list) {
    const auto count = static_cast<std::uint32_t>(list.size());
    number(count);
    return count;
  }
};

struct Reader {
  files::PayloadReader in;

  template <typename T>
  void number(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t byte = 0;
      in.values(&byte, 1);
      if (byte > 1) in.fail();
      value = byte != 0;
    } else {
      in.values(&value, 1);
    }
  }
  template <typename T>
  std::uint32_t size(std::vector<T>& list) {
    std::uint32_t count = 0;
    number(count);
    if (count > kMostModes) in.fail();
    list.resize(count);
    return count;
  }
};

template <typename Archive, typename Matrix>
void matrix(Archive& archive, Matrix& m) {
  for (Eigen::Index k = 0; k < m.size(); ++k) archive.number(m.data()[k]);
}

template <typename E>
constexpr E last();
template <>
constexpr RegistrationStatus last() {
  return RegistrationStatus::aligned_up_to_symmetry;
}
template <>
constexpr RegistrationReason last() {
  return kLastRegistrationReason;
}
template <>
constexpr ViewpointSource last() {
  return ViewpointSource::model;
}

template <typename Archive, typename E>
void enumerator(Archive& archive, E& value) {
  archive.number(value);
  if constexpr (std::is_same_v<Archive, Reader>)
    if (value > last<E>()) archive.in.fail();
}

template <typename Archive, typename T>
void all_fields(Archive& archive, T& object) {
  using Plain = std::remove_const_t<T>;
  fields::each<Plain>([&](const std::string&, auto member, const fields::Field&) {
    archive.number(object.*member);
  });
}

template <typename Archive, typename Moments>
void moments(Archive& archive, Moments& m) {
  archive.number(m.count);
  matrix(archive, m.sum);
  matrix(archive, m.outer);
}

/// Every member of a result, in the order of the file.
template <typename Archive, typename Result>
void visit(Archive& archive, Result& r) {
  enumerator(archive, r.status);
  enumerator(archive, r.reason);
  matrix(archive, r.target_from_source.matrix());
  archive.number(r.confidence);
  archive.number(r.inlier_ratio);
  archive.number(r.inlier_rmse);
  archive.number(r.voxel_size);
  moments(archive, r.source_moments);
  moments(archive, r.target_moments);
  archive.size(r.modes);
  for (auto& mode : r.modes) {
    matrix(archive, mode.target_from_source.matrix());
    archive.number(mode.confidence);
    archive.number(mode.overlap_confidence);
    all_fields(archive, mode.evidence);
    archive.number(mode.rank_before_refinement);
    archive.number(mode.equivalent);
  }
  all_fields(archive, r.statistics);
  archive.number(r.flat);
  enumerator(archive, r.source_viewpoint);
  enumerator(archive, r.target_viewpoint);
  all_fields(archive, r.timings);
}

void check_pose(const UnalignedIsometry3d& pose, const std::string& path) {
  const std::string why = why_not_rigid(pose.matrix());
  if (!why.empty()) throw IoError(path + ": a pose is no rigid motion: " + why);
}

}  // namespace

std::string bytes_of(const RegistrationResult& result) {
  Writer writer;
  visit(writer, result);
  return std::move(writer.out);
}

RegistrationResult result_of(std::string_view bytes, const std::string& path) {
  Reader reader{{bytes, path}};
  RegistrationResult result;
  visit(reader, result);
  if (reader.in.left() > 0) reader.in.fail();
  if (result.has_pose()) check_pose(result.target_from_source, path);
  for (const RegistrationMode& mode : result.modes) check_pose(mode.target_from_source, path);
  return result;
}

}  // namespace gpureg::sets
