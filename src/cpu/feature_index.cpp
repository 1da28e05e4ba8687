// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/feature_index.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

#if defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
#endif

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
  std::uint32_t widest(const std::uint32_t* first, const std::uint32_t* last) {
    std::fill(sum_.begin(), sum_.end(), 0.0f);
    std::fill(squares_.begin(), squares_.end(), 0.0f);
    const float* origin = rows_.values + static_cast<std::size_t>(*first) * rows_.dimension;
    for (const std::uint32_t* i = first; i < last; ++i) {
      const float* row = rows_.values + static_cast<std::size_t>(*i) * rows_.dimension;
      for (std::uint32_t d = 0; d < rows_.dimension; ++d) {
        const float v = row[d] - origin[d];
        sum_[d] += v;
        squares_[d] += v * v;
      }
    }
    std::uint32_t best = 0;
    float most = -1;
    for (std::uint32_t d = 0; d < rows_.dimension; ++d) {
      const float spread = squares_[d] - sum_[d] * sum_[d] / static_cast<float>(last - first);
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

/// Lower bound of the distance to each of 8 boxes: the same chain of operations as a distance, with
/// the distance to the box in each dimension. Rounding is monotone, so the bound holds to the last
/// bit.
void box_bounds(const float* query, const float* boxes, std::size_t dimension, float* out) {
#if defined(__AVX2__) && defined(__FMA__)
  __m256 sum = _mm256_setzero_ps();
  const __m256 zero = _mm256_setzero_ps();
  for (std::size_t d = 0; d < dimension; ++d) {
    const __m256 value = _mm256_set1_ps(query[d]);
    const __m256 below = _mm256_sub_ps(_mm256_loadu_ps(boxes + d * 16), value),
                 above = _mm256_sub_ps(value, _mm256_loadu_ps(boxes + d * 16 + 8));
    const __m256 away = _mm256_max_ps(_mm256_max_ps(below, above), zero);
    sum = _mm256_fmadd_ps(away, away, sum);
  }
  _mm256_storeu_ps(out, sum);
#else
  for (int l = 0; l < 8; ++l) out[l] = 0.0f;
  for (std::size_t d = 0; d < dimension; ++d)
    for (int l = 0; l < 8; ++l) {
      const float below = boxes[d * 16 + l] - query[d], above = query[d] - boxes[d * 16 + 8 + l];
      const float away = std::max(std::max(below, above), 0.0f);
      out[l] = fmaf(away, away, out[l]);
    }
#endif
}

/// Squared distances to the 16 rows of a leaf. False, and no distances, where half of the
/// dimensions already show that all exceed `most`.
bool leaf_distances(const float* query, const float* leaf, std::size_t dimension, float most,
                    float* out) {
  const std::size_t half = dimension / 2;
#if defined(__AVX2__) && defined(__FMA__)
  __m256 a = _mm256_setzero_ps(), b = _mm256_setzero_ps();
  const auto add = [&](std::size_t from, std::size_t to) {
    for (std::size_t d = from; d < to; ++d) {
      const __m256 value = _mm256_set1_ps(query[d]);
      const __m256 x = _mm256_sub_ps(value, _mm256_loadu_ps(leaf + d * 16)),
                   y = _mm256_sub_ps(value, _mm256_loadu_ps(leaf + d * 16 + 8));
      a = _mm256_fmadd_ps(x, x, a);
      b = _mm256_fmadd_ps(y, y, b);
    }
  };
  add(0, half);
  if (_mm256_movemask_ps(_mm256_cmp_ps(_mm256_min_ps(a, b), _mm256_set1_ps(most), _CMP_LE_OQ)) == 0)
    return false;
  add(half, dimension);
  if (_mm256_movemask_ps(_mm256_cmp_ps(_mm256_min_ps(a, b), _mm256_set1_ps(most), _CMP_LE_OQ)) == 0)
    return false;
  _mm256_storeu_ps(out, a);
  _mm256_storeu_ps(out + 8, b);
#else
  const auto add = [&](std::size_t from, std::size_t to) {
    for (std::size_t d = from; d < to; ++d)
      for (std::uint32_t l = 0; l < kLeaf; ++l) {
        const float difference = query[d] - leaf[d * kLeaf + l];
        out[l] = fmaf(difference, difference, out[l]);
      }
  };
  std::fill_n(out, kLeaf, 0.0f);
  add(0, half);
  if (!(*std::min_element(out, out + kLeaf) <= most)) return false;
  add(half, dimension);
#endif
  return true;
}

float distance(const float* a, const float* b, std::size_t dimension) {
  float sum = 0.0f;
  for (std::size_t d = 0; d < dimension; ++d) {
    const float difference = a[d] - b[d];
    sum = fmaf(difference, difference, sum);
  }
  return sum;
}

/// The search of one query.
class Search {
 public:
  explicit Search(const FeatureIndex& index) : index_(index), bound_((index.nodes + 7) / 8 * 8) {}

  std::uint32_t nearest(const float* query, std::uint32_t guess, float guess_distance) {
    query_ = query;
    best_ = guess_distance < kInfinity ? guess_distance : kInfinity;
    best_row_ = guess_distance < kInfinity ? guess : kNoValue;
    const std::size_t block = std::size_t(16) * index_.dimension;
    for (std::size_t b = 0; b * 8 < bound_.size(); ++b)
      box_bounds(query, index_.node_boxes.data() + b * block, index_.dimension, &bound_[b * 8]);
    // The nearest node first: its rows refute most of the other nodes.
    const std::size_t first =
        static_cast<std::size_t>(std::min_element(bound_.begin(), bound_.end()) - bound_.begin());
    visit(first);
    for (std::size_t n = 0; n < index_.nodes; ++n)
      if (n != first && bound_[n] <= best_) visit(n);
    return best_row_;
  }

 private:
  void visit(std::size_t node) {
    float bound[kNode];
    box_bounds(query_, index_.leaf_boxes.data() + node * 16 * index_.dimension, index_.dimension,
               bound);
    const std::size_t first =
        static_cast<std::size_t>(std::min_element(bound, bound + kNode) - bound);
    if (bound[first] <= best_) look(node * kNode + first);
    for (std::size_t l = 0; l < kNode; ++l)
      if (l != first && bound[l] <= best_) look(node * kNode + l);
  }
  void look(std::size_t leaf) {
    float distances[kLeaf];
    if (!leaf_distances(query_, index_.values.data() + leaf * kLeaf * index_.dimension,
                        index_.dimension, best_, distances))
      return;
    for (std::uint32_t l = 0; l < kLeaf; ++l) {
      if (!(distances[l] <= best_)) continue;
      const std::uint32_t row = index_.row[leaf * kLeaf + l];
      // best_row_ stays kNoValue while the best distance is infinite: such rows are not near.
      if (distances[l] == best_ && (best_row_ == kNoValue || row >= best_row_)) continue;
      best_ = distances[l];
      best_row_ = row;
    }
  }

  const FeatureIndex& index_;
  std::vector<float> bound_;
  const float* query_ = nullptr;
  float best_ = kInfinity;
  std::uint32_t best_row_ = kNoValue;
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
  return out;
}

void nearest_features(FeatureRows queries, const FeatureIndex& order, FeatureRows rows,
                      const FeatureIndex& index, std::size_t begin, std::size_t end,
                      std::uint32_t* out) {
  Search search(index);
  std::uint32_t guess = kNoValue;
  for (std::size_t k = begin; k < end; ++k) {
    const float* query =
        queries.values + static_cast<std::size_t>(order.row[k]) * queries.dimension;
    const float far =
        guess == kNoValue
            ? kInfinity
            : distance(query, rows.values + static_cast<std::size_t>(guess) * rows.dimension,
                       rows.dimension);
    guess = index.nodes == 0 ? kNoValue : search.nearest(query, guess, far);
    for (std::uint32_t q = order.row[k]; q != kNoValue; q = order.next_equal[q]) out[q] = guess;
  }
}

}  // namespace gpureg::cpu
