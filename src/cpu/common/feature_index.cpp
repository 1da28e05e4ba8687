// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/common/feature_index.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace gpureg::cpu {
namespace {

constexpr std::uint32_t kLeaf = FeatureIndex::kLeaf, kNode = FeatureIndex::kNode,
                        kNodeRows = FeatureIndex::kNodeRows;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Orders rows so that halves, down to the leaves, are separated along the dimension of their
/// largest spread.
class Splitter {
 public:
  explicit Splitter(FeatureRows rows)
      : rows_(rows), sum_(rows.dimension), squares_(rows.dimension), key_(rows.size) {}

  void split(std::uint32_t* first, std::uint32_t* last) {
    const std::uint32_t n = static_cast<std::uint32_t>(last - first);
    if (n <= kLeaf) return;
    const std::uint32_t unit = n > kNodeRows ? kNodeRows : kLeaf, units = (n + unit - 1) / unit;
    std::uint32_t* middle = first + units / 2 * unit;
    const std::uint32_t d = widest(first, last);
    for (const std::uint32_t* i = first; i < last; ++i)
      key_[*i] = rows_.values[static_cast<std::size_t>(*i) * rows_.dimension + d];
    std::nth_element(first, middle, last, [&](std::uint32_t a, std::uint32_t b) {
      return key_[a] < key_[b] || (!(key_[b] < key_[a]) && a < b);
    });
    split(first, middle);
    split(middle, last);
  }

 private:
  /// Dimension of the largest variance, of some of the rows if there are many.
  std::uint32_t widest(const std::uint32_t* first, const std::uint32_t* last) {
    constexpr std::ptrdiff_t kSome = 128;
    const std::ptrdiff_t step = std::max<std::ptrdiff_t>(1, (last - first) / kSome),
                         count = (last - first + step - 1) / step;
    std::fill(sum_.begin(), sum_.end(), 0.0f);
    std::fill(squares_.begin(), squares_.end(), 0.0f);
    const float* origin = rows_.values + static_cast<std::size_t>(*first) * rows_.dimension;
    for (std::ptrdiff_t k = 0; k < count; ++k) {
      const float* row = rows_.values + static_cast<std::size_t>(first[k * step]) * rows_.dimension;
      for (std::uint32_t d = 0; d < rows_.dimension; ++d) {
        const float v = row[d] - origin[d];
        sum_[d] += v;
        squares_[d] += v * v;
      }
    }
    std::uint32_t best = 0;
    float most = -1;
    for (std::uint32_t d = 0; d < rows_.dimension; ++d) {
      const float spread = squares_[d] - sum_[d] * sum_[d] / static_cast<float>(count);
      if (spread > most) {
        most = spread;
        best = d;
      }
    }
    return best;
  }

  FeatureRows rows_;
  std::vector<float> sum_, squares_, key_;
};

/// Equal rows by a hash table of the first of each.
class EqualRows {
 public:
  explicit EqualRows(FeatureRows rows) : rows_(rows) {
    std::size_t places = 8;
    while (places < 2 * std::size_t(rows.size)) places *= 2;
    first_.assign(places, kNoValue);
  }
  /// The first row that equals row i; i itself where there is none before.
  std::uint32_t first(std::uint32_t i) {
    const float* row = values(i);
    for (std::size_t place = hash(row);; ++place) {
      std::uint32_t& there = first_[place & (first_.size() - 1)];
      if (there == kNoValue) there = i;
      // As distances see it: 0 equals -0.
      if (there == i || std::equal(row, row + rows_.dimension, values(there))) return there;
    }
  }

 private:
  const float* values(std::uint32_t i) const {
    return rows_.values + static_cast<std::size_t>(i) * rows_.dimension;
  }
  std::size_t hash(const float* row) const {
    std::uint64_t h = 0;
    for (std::uint32_t d = 0; d < rows_.dimension; ++d) {
      const float v = row[d] + 0.0f;  // 0 for -0
      std::uint32_t bits;
      std::memcpy(&bits, &v, sizeof bits);
      h = (h ^ bits) * 0x9e3779b97f4a7c15u;
      h ^= h >> 29;
    }
    return static_cast<std::size_t>(h);
  }

  FeatureRows rows_;
  std::vector<std::uint32_t> first_;
};

}  // namespace

FeatureIndex index_features(FeatureRows rows) {
  FeatureIndex out;
  out.dimension = rows.dimension;
  out.next_equal.assign(rows.size, kNoValue);
  EqualRows equal(rows);
  for (std::uint32_t i = 0; i < rows.size; ++i) {
    if (!rows.valid[i]) continue;
    const std::uint32_t first = equal.first(i);
    if (first == i) {
      out.row.push_back(i);
    } else {
      out.next_equal[i] = out.next_equal[first];
      out.next_equal[first] = i;
    }
  }
  out.rows = static_cast<std::uint32_t>(out.row.size());
  Splitter(rows).split(out.row.data(), out.row.data() + out.rows);
  out.nodes = (out.rows + kNodeRows - 1) / kNodeRows;
  out.row.resize(std::size_t(out.nodes) * kNodeRows, kNoValue);
  out.values.assign(out.row.size() * rows.dimension, kInfinity);
  out.leaf_boxes.resize(std::size_t(out.nodes) * 16 * rows.dimension);
  out.node_boxes.resize(std::size_t((out.nodes + 7) / 8) * 16 * rows.dimension);
  for (auto* boxes : {&out.leaf_boxes, &out.node_boxes})
    for (std::size_t k = 0; k < boxes->size(); ++k)
      (*boxes)[k] = k % 16 < 8 ? kInfinity : -kInfinity;  // empty
  for (std::size_t k = 0; k < out.rows; ++k) {
    const float* row = rows.values + static_cast<std::size_t>(out.row[k]) * rows.dimension;
    const std::size_t leaf = k / kLeaf, node = leaf / kNode;
    float* values = out.values.data() + leaf * kLeaf * rows.dimension + k % kLeaf;
    float* leaf_box = out.leaf_boxes.data() + node * 16 * rows.dimension + leaf % kNode;
    float* node_box = out.node_boxes.data() + node / 8 * 16 * rows.dimension + node % 8;
    for (std::size_t d = 0; d < rows.dimension; ++d) {
      values[d * kLeaf] = row[d];
      for (float* box : {leaf_box + d * 16, node_box + d * 16}) {
        box[0] = std::min(box[0], row[d]);
        box[8] = std::max(box[8], row[d]);
      }
    }
  }
  out.bytes = byte_rows(out.values, rows.dimension);
  return out;
}

const FeatureIndex& KeptIndex::of(FeatureRows rows) const {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!index_) index_ = std::make_shared<const FeatureIndex>(index_features(rows));
  return *index_;
}

}  // namespace gpureg::cpu
