// SPDX-License-Identifier: BSD-3-Clause
#include "spacing/slabs.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "common/radix_sort.hpp"
#include "spacing/sorted_rows.hpp"

namespace gpureg {
namespace {

/// Mean number of rows in a slab, and the largest number of slabs.
constexpr std::size_t kRowsPerSlab = 8, kMostSlabs = std::size_t(1) << 14;
/// Rows that tell how far a cloud reaches. One in so many of them lies in each of the outermost
/// slabs: a few far points do not widen the others.
constexpr std::size_t kReachSample = 1024, kOutermost = 100;
/// More rows are not compared one by one with each row.
constexpr std::size_t kCrowd = std::size_t(1) << 14;
/// Of more places in one slab the slab is sorted.
constexpr std::size_t kManyPlaces = 16;
/// Rows that a row is compared with at once.
constexpr std::size_t kLanes = 8;
/// Least number of rows between two decisions about the end of a search.
constexpr std::size_t kTogetherRows = 4 * kLanes;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Vec3 row_at(const RawCloud& rows, std::size_t i) {
  const float* p = rows.points + i * rows.point_stride;
  return {p[0], p[1], p[2]};
}

/// Number of the slab of an x; does not decrease with x.
struct SlabOf {
  float low = 0, scale = 0;
  std::size_t slabs = 1;

  explicit SlabOf(const RawCloud& rows) {
    std::vector<float> x;
    const std::size_t count = std::min(kReachSample, rows.size);
    for (std::size_t s = 0; s < count; ++s)
      if (const Vec3 p = row_at(rows, s * rows.size / count); all_finite(p)) x.push_back(p.x);
    if (x.empty()) return;
    std::sort(x.begin(), x.end());
    const std::size_t cut = x.size() / kOutermost;
    low = x[cut];
    const std::size_t most = std::min(rows.size / kRowsPerSlab, kMostSlabs);
    scale = static_cast<float>(most) / (x[x.size() - 1 - cut] - low);
    if (most > 1 && scale > 0 && scale < kInfinity) slabs = most;
  }
  std::uint32_t operator()(float x) const {
    if (slabs == 1) return 0;
    const float at = std::max(0.0f, (x - low) * scale);
    return static_cast<std::uint32_t>(std::min(at, static_cast<float>(slabs - 1)));
  }
};

/// Sorts like x, then y.
std::uint64_t key_of(float x, float y) {
  return std::uint64_t(sortable_bits(x)) << 32 | sortable_bits(y);
}

/// Moves the keys that keep(key) holds for to the front, without a branch for each key, which the
/// processor could only guess. @return their end.
template <typename Keep>
std::uint64_t* move_to_front(std::uint64_t* first, std::uint64_t* last, std::uint64_t* scratch,
                             const Keep& keep) {
  std::size_t others = 0;
  for (const std::uint64_t* key = first; key != last; ++key) {
    const std::uint64_t here = *key;
    *first = here;
    scratch[others] = here;
    const bool kept = keep(here);
    first += kept;
    others += !kept;
  }
  std::copy(scratch, scratch + others, first);
  return first;
}

/// Moves to a place the key that a sort would move there, lesser ones before it and greater ones
/// behind it.
void put_in_place(std::uint64_t* first, std::uint64_t* last, std::uint64_t* place,
                  std::uint64_t* scratch) {
  constexpr std::ptrdiff_t kFew = 16;
  while (last - first > kFew) {
    const std::uint64_t a = *first, b = first[(last - first) / 2], c = last[-1];
    const std::uint64_t pivot = std::max(std::min(a, b), std::min(std::max(a, b), c));
    std::uint64_t* end =
        move_to_front(first, last, scratch, [&](std::uint64_t key) { return key < pivot; });
    if (place < end) {
      last = end;
      continue;
    }
    if (end == first) {  // the least key may be that of many rows
      end = move_to_front(first, last, scratch, [&](std::uint64_t key) { return key == pivot; });
      if (place < end) return;
    }
    first = end;
  }
  std::sort(first, last);
}

/// The same for several places of `keys`, ascending.
void put_in_place(std::uint64_t* keys, std::size_t first, std::size_t last,
                  Span<const std::size_t> places, std::uint64_t* scratch) {
  if (places.size == 0) return;
  const std::size_t middle = places.size / 2, place = places[middle];
  put_in_place(keys + first, keys + last, keys + place, scratch);
  put_in_place(keys, first, place, {places.data, middle}, scratch);
  put_in_place(keys, place + 1, last, {places.data + middle + 1, places.size - middle - 1},
               scratch);
}

/// The axis along which the middle half of the rows extends most.
Eigen::Index widest_axis(const std::vector<Eigen::Vector3f>& rows) {
  const std::size_t count = std::min(kReachSample, rows.size());
  Eigen::Vector3f spread;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<float> along(count);
    for (std::size_t k = 0; k < count; ++k) along[k] = rows[k * rows.size() / count][axis];
    std::sort(along.begin(), along.end());
    spread[axis] = along[count * 3 / 4] - along[count / 4];
  }
  Eigen::Index axis = 0;
  spread.maxCoeff(&axis);
  return axis;
}

}  // namespace

CrowdedSlab::CrowdedSlab(std::vector<Eigen::Vector3f> rows)
    : axis_(widest_axis(rows)), rows_(std::move(rows)) {
  sort_rows(rows_, axis_);
  rows_.erase(std::unique(rows_.begin(), rows_.end()), rows_.end());
}

float CrowdedSlab::nearest_squared(Vec3 p, float nearest) const {
  const Eigen::Vector3f from(p.x, p.y, p.z);
  const auto visit = [&](const Eigen::Vector3f& row) {
    const float dx = row.x() - p.x, dy = row.y() - p.y, dz = row.z() - p.z;
    const float along = row[axis_] - from[axis_], squared = dx * dx + dy * dy + dz * dz;
    if (squared > 0) nearest = std::min(nearest, squared);
    return along * along < nearest;
  };
  const auto middle =
      std::lower_bound(rows_.begin(), rows_.end(), from[axis_],
                       [&](const Eigen::Vector3f& row, float value) { return row[axis_] < value; });
  for (auto row = middle; row != rows_.end() && visit(*row);) ++row;
  for (auto row = middle; row != rows_.begin() && visit(*(row - 1));) --row;
  return nearest;
}

Slabs::Slabs(const RawCloud& rows) {
  constexpr auto kNone = std::numeric_limits<std::uint16_t>::max();
  static_assert(kMostSlabs <= kNone);
  const SlabOf slab_of(rows);
  const std::unique_ptr<std::uint16_t[]> slab(new std::uint16_t[rows.size]);
  std::vector<std::uint32_t> next(slab_of.slabs + 1, 0);
  for (std::size_t i = 0; i < rows.size; ++i) {
    const Vec3 p = row_at(rows, i);
    slab[i] = all_finite(p) ? static_cast<std::uint16_t>(slab_of(p.x)) : kNone;
    if (slab[i] != kNone) ++next[slab[i] + 1u];
  }
  for (std::size_t b = 1; b < next.size(); ++b) next[b] += next[b - 1];
  begin_ = next;
  const std::size_t stride = size() + kLanes;
  values_.reset(new float[3 * stride]);
  float *x = values_.get(), *y = x + stride, *z = y + stride;
  for (std::size_t i = 0; i < rows.size; ++i) {
    if (slab[i] == kNone) continue;
    const Vec3 p = row_at(rows, i);
    const std::size_t at = next[slab[i]]++;
    x[at] = p.x;
    y[at] = p.y;
    z[at] = p.z;
  }
  for (float* of : {x, y, z}) std::fill(of + size(), of + stride, kInfinity);
  x_ = x, y_ = y, z_ = z;
  for (std::size_t b = 0; b < slabs(); ++b)
    if (is_crowded(b)) crowded_.emplace(b, rows_of(b));
}

bool Slabs::is_crowded(std::size_t slab) const { return begin_[slab + 1] - begin_[slab] > kCrowd; }

std::vector<Eigen::Vector3f> Slabs::rows_of(std::size_t slab) const {
  std::vector<Eigen::Vector3f> rows;
  rows.reserve(begin_[slab + 1] - begin_[slab]);
  for (std::size_t k = begin_[slab]; k < begin_[slab + 1]; ++k)
    rows.emplace_back(x_[k], y_[k], z_[k]);
  return rows;
}

std::vector<Slabs::Row> Slabs::evenly_spaced(std::size_t most) const {
  const std::size_t count = std::min(most, size());
  std::vector<Row> out;
  out.reserve(count);
  std::vector<std::uint64_t> keys, scratch;
  std::vector<std::size_t> places;
  for (std::size_t slab = 0, s = 0; s < count; ++slab) {
    const std::size_t begin = begin_[slab], end = begin_[slab + 1];
    places.clear();
    for (; s < count && s * size() / count < end; ++s) places.push_back(s * size() / count - begin);
    if (places.empty()) continue;
    if (places.size() > kManyPlaces) {
      std::vector<Eigen::Vector3f> rows = rows_of(slab);
      sort_by_coordinates(rows.begin(), rows.end());
      for (const std::size_t place : places)
        out.push_back({{rows[place].x(), rows[place].y(), rows[place].z()}, slab});
      continue;
    }
    keys.resize(end - begin);
    scratch.resize(end - begin);
    for (std::size_t k = begin; k < end; ++k) keys[k - begin] = key_of(x_[k], y_[k]);
    put_in_place(keys.data(), 0, keys.size(), span_of(places), scratch.data());
    for (const std::size_t place : places) out.push_back({row_of(slab, keys, place), slab});
  }
  return out;
}

/// @param keys of the rows of the slab, that of the place where it belongs.
Vec3 Slabs::row_of(std::size_t slab, const std::vector<std::uint64_t>& keys,
                   std::size_t place) const {
  const auto low_bits = static_cast<std::uint32_t>(keys[place]);
  std::vector<Vec3> equal;
  for (std::size_t k = begin_[slab]; k < begin_[slab + 1]; ++k)
    if (sortable_bits(y_[k]) == low_bits && key_of(x_[k], y_[k]) == keys[place])
      equal.push_back({x_[k], y_[k], z_[k]});
  if (equal.size() == 1) return equal.front();
  const auto at =
      std::count(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(place), keys[place]);
  std::nth_element(equal.begin(), equal.begin() + at, equal.end(),
                   [](const Vec3& a, const Vec3& b) { return a.z < b.z; });
  return equal[static_cast<std::size_t>(at)];
}

// The last group may reach into the next slab: more rows do no harm.
float Slabs::nearest_of(std::size_t begin, std::size_t end, Vec3 p, float nearest) const {
  float lanes[kLanes];
  std::fill(lanes, lanes + kLanes, nearest);
  for (std::size_t k = begin; k < end; k += kLanes) {
    const float *x = x_ + k, *y = y_ + k, *z = z_ + k;
#pragma omp simd
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float dx = x[l] - p.x, dy = y[l] - p.y, dz = z[l] - p.z;
      const float squared = dx * dx + dy * dy + dz * dz;
      const float other = squared > 0 ? squared : kInfinity;
      lanes[l] = other < lanes[l] ? other : lanes[l];
    }
  }
  return *std::min_element(lanes, lanes + kLanes);
}

float Slabs::nearest_squared(const Row& row) const {
  const Vec3 p = row.position;
  float nearest = kInfinity;
  // A row nearer than d is less than d away along x, and the rows beyond a slab are farther along x
  // than its own.
  const auto is_far = [&](float along_x) { return along_x > 0 && along_x * along_x >= nearest; };
  const auto visit = [&](std::size_t first, std::size_t last) {
    nearest = last == first + 1 && is_crowded(first)
                  ? crowded_.at(first).nearest_squared(p, nearest)
                  : nearest_of(begin_[first], begin_[last], p, nearest);
  };
  for (std::size_t first = row.slab, last = first; first < slabs(); first = last) {
    const std::size_t most = begin_[first] + kTogetherRows;
    do ++last;
    while (last < slabs() && begin_[last] < most && !is_crowded(last));
    if (begin_[last] == begin_[first]) continue;
    visit(first, last);
    if (is_far(x_[begin_[last] - 1] - p.x)) break;
  }
  for (std::size_t first = row.slab, last = first; first > 0; last = first) {
    do --first;
    while (first > 0 && begin_[first] + kTogetherRows > begin_[last] && !is_crowded(first - 1));
    if (begin_[last] == begin_[first]) continue;
    visit(first, last);
    if (is_far(p.x - x_[begin_[first]])) break;
  }
  return nearest;
}

}  // namespace gpureg
