// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include "cpu/common/feature_index.hpp"
#include "cpu/common/wide_vectors.hpp"

#if defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
#endif

namespace gpureg::cpu {
namespace {

constexpr std::uint32_t kLeaf = FeatureIndex::kLeaf, kNode = FeatureIndex::kNode;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Lower bounds of the distances to the boxes of `Blocks` blocks of 8: the same chain of operations
/// as a distance, with the distance to the box in each dimension. Rounding is monotone, so the
/// bound holds to the last bit. Chains of several blocks side by side hide the latency of one.
template <int Blocks>
void box_bounds(const float* query, const float* const* boxes, std::size_t dimension, float* out) {
#if defined(__AVX2__) && defined(__FMA__)
  __m256 sum[Blocks];
  for (auto& s : sum) s = _mm256_setzero_ps();
  for (std::size_t d = 0; d < dimension; ++d) {
    const __m256 value = _mm256_set1_ps(query[d]);
    for (int b = 0; b < Blocks; ++b) {
      // The nearest value of the box; an empty box ends at -infinity.
      const __m256 near = _mm256_min_ps(_mm256_max_ps(value, _mm256_loadu_ps(boxes[b] + d * 16)),
                                        _mm256_loadu_ps(boxes[b] + d * 16 + 8));
      const __m256 away = _mm256_sub_ps(value, near);
      sum[b] = _mm256_fmadd_ps(away, away, sum[b]);
    }
  }
  for (int b = 0; b < Blocks; ++b) _mm256_storeu_ps(out + 8 * b, sum[b]);
#else
  for (int b = 0; b < Blocks; ++b, out += 8) {
    for (int l = 0; l < 8; ++l) out[l] = 0.0f;
    for (std::size_t d = 0; d < dimension; ++d)
      for (int l = 0; l < 8; ++l) {
        const float below = boxes[b][d * 16 + l] - query[d],
                    above = query[d] - boxes[b][d * 16 + 8 + l];
        const float away = std::max(std::max(below, above), 0.0f);
        out[l] = fmaf(away, away, out[l]);
      }
  }
#endif
}

/// Squared distances to the 16 rows of each of two leaves, each a chain of fmaf in ascending order
/// of the dimensions. Returns a mask of the nearest rows, all at the same distance. 0, and no
/// distances, where that exceeds `most`; half of the dimensions may show it already.
std::uint64_t leaf_distances(const float* query, const float* const* leaf, std::size_t dimension,
                             float most, float (*out)[kLeaf]) {
  const std::size_t half = dimension / 2;
#if defined(__AVX2__) && defined(__FMA__)
  __m256 sum[4];
  for (auto& s : sum) s = _mm256_setzero_ps();
  const auto add = [&](std::size_t from, std::size_t to) {
    for (std::size_t d = from; d < to; ++d) {
      const __m256 value = _mm256_set1_ps(query[d]);
      for (int k = 0; k < 4; ++k) {
        const __m256 x = _mm256_sub_ps(value, _mm256_loadu_ps(leaf[k / 2] + d * kLeaf + k % 2 * 8));
        sum[k] = _mm256_fmadd_ps(x, x, sum[k]);
      }
    }
  };
  const auto least = [&] {
    const __m256 four = _mm256_min_ps(_mm256_min_ps(sum[0], sum[1]), _mm256_min_ps(sum[2], sum[3]));
    const __m128 two = _mm_min_ps(_mm256_castps256_ps128(four), _mm256_extractf128_ps(four, 1));
    const __m128 one = _mm_min_ps(two, _mm_movehl_ps(two, two));
    return _mm_cvtss_f32(_mm_min_ss(one, _mm_shuffle_ps(one, one, 1)));
  };
  add(0, half);
  if (!(least() <= most)) return 0;
  add(half, dimension);
  const float nearest = least();
  if (!(nearest <= most)) return 0;
  std::uint64_t mask = 0;
  for (int k = 0; k < 4; ++k) {
    _mm256_storeu_ps(out[k / 2] + k % 2 * 8, sum[k]);
    mask |= static_cast<std::uint64_t>(
                _mm256_movemask_ps(_mm256_cmp_ps(sum[k], _mm256_set1_ps(nearest), _CMP_EQ_OQ)))
            << 8 * k;
  }
  return mask;
#else
  const auto add = [&](std::size_t from, std::size_t to) {
    for (std::size_t d = from; d < to; ++d)
      for (int k = 0; k < 2; ++k)
        for (std::uint32_t l = 0; l < kLeaf; ++l) {
          const float difference = query[d] - leaf[k][d * kLeaf + l];
          out[k][l] = fmaf(difference, difference, out[k][l]);
        }
  };
  for (int k = 0; k < 2; ++k) std::fill_n(out[k], kLeaf, 0.0f);
  add(0, half);
  if (!(*std::min_element(out[0], out[0] + 2 * kLeaf) <= most)) return 0;
  add(half, dimension);
  const float nearest = *std::min_element(out[0], out[0] + 2 * kLeaf);
  if (!(nearest <= most)) return 0;
  std::uint64_t mask = 0;
  for (std::uint32_t l = 0; l < 2 * kLeaf; ++l)
    mask |= static_cast<std::uint64_t>(out[l / kLeaf][l % kLeaf] == nearest) << l;
  return mask;
#endif
}

#ifdef GPUREG_WIDE_TARGET
/// The same for four leaves.
GPUREG_WIDE_TARGET std::uint64_t leaf_distances_wide(const float* query, const float* const* leaf,
                                                     std::size_t dimension, float most,
                                                     float (*out)[kLeaf]) {
  __m512 a = _mm512_setzero_ps(), b = a, c = a, e = a;
  const std::size_t half = dimension / 2;
  float nearest = most;
  for (std::size_t d = 0; d < dimension; ++d) {
    const __m512 value = _mm512_set1_ps(query[d]);
    const __m512 x = _mm512_sub_ps(value, _mm512_loadu_ps(leaf[0] + d * kLeaf)),
                 y = _mm512_sub_ps(value, _mm512_loadu_ps(leaf[1] + d * kLeaf)),
                 z = _mm512_sub_ps(value, _mm512_loadu_ps(leaf[2] + d * kLeaf)),
                 w = _mm512_sub_ps(value, _mm512_loadu_ps(leaf[3] + d * kLeaf));
    a = _mm512_fmadd_ps(x, x, a);
    b = _mm512_fmadd_ps(y, y, b);
    c = _mm512_fmadd_ps(z, z, c);
    e = _mm512_fmadd_ps(w, w, e);
    if (d + 1 != half && d + 1 != dimension) continue;
    nearest = _mm512_reduce_min_ps(_mm512_min_ps(_mm512_min_ps(a, b), _mm512_min_ps(c, e)));
    if (!(nearest <= most)) return 0;
  }
  _mm512_storeu_ps(out[0], a);
  _mm512_storeu_ps(out[1], b);
  _mm512_storeu_ps(out[2], c);
  _mm512_storeu_ps(out[3], e);
  const __m512 least = _mm512_set1_ps(nearest);
  return static_cast<std::uint64_t>(_mm512_cmp_ps_mask(a, least, _CMP_EQ_OQ)) |
         static_cast<std::uint64_t>(_mm512_cmp_ps_mask(b, least, _CMP_EQ_OQ)) << 16 |
         static_cast<std::uint64_t>(_mm512_cmp_ps_mask(c, least, _CMP_EQ_OQ)) << 32 |
         static_cast<std::uint64_t>(_mm512_cmp_ps_mask(e, least, _CMP_EQ_OQ)) << 48;
}
#endif

float distance(const float* a, const float* b, std::size_t dimension) {
  float sum = 0.0f;
  for (std::size_t d = 0; d < dimension; ++d) {
    const float difference = a[d] - b[d];
    sum = fmaf(difference, difference, sum);
  }
  return sum;
}

/// The search of one query. The nearest row, and of equally near ones the first, does not depend on
/// the order in which leaves are read.
class Search {
 public:
  Search(const FeatureIndex& index, bool wide)
      : index_(index), wide_(wide), bound_((index.nodes + 7) / 8 * 8) {}

  std::uint32_t nearest(const float* query, std::uint32_t guess, float guess_distance) {
    begin_query(query, guess, guess_distance);
    const float* boxes = index_.node_boxes.data();
    const std::size_t block = std::size_t(16) * index_.dimension, blocks = bound_.size() / 8;
    std::size_t b = 0;
    for (; b + 2 <= blocks; b += 2) {
      const float* two[] = {boxes + b * block, boxes + (b + 1) * block};
      box_bounds<2>(query, two, index_.dimension, &bound_[b * 8]);
    }
    if (b < blocks) {
      const float* one[] = {boxes + b * block};
      box_bounds<1>(query, one, index_.dimension, &bound_[b * 8]);
    }
    // The nearest node first: its rows refute most of the other nodes.
    const std::size_t first =
        static_cast<std::size_t>(std::min_element(bound_.begin(), bound_.end()) - bound_.begin());
    visit_first(first);
    std::size_t waiting = index_.nodes;
    for (std::size_t n = 0; n < index_.nodes; ++n) {
      if (n == first || !(bound_[n] <= best_)) continue;
      if (waiting == index_.nodes) {
        waiting = n;
        continue;
      }
      const std::size_t two[] = {waiting, n};
      visit<2>(two);
      waiting = index_.nodes;
    }
    if (waiting != index_.nodes && bound_[waiting] <= best_) visit<1>(&waiting);
    return best_row_;
  }

  /// The same for up to ByteRows::kQueries queries; the index has valid bytes.
  void nearest_by_bytes(const float* const* queries, std::size_t count, std::uint32_t* out) {
    leaves_.find(index_.bytes, queries, count);
    for (std::size_t q = 0; q < count; ++q) {
      begin_query(queries[q], kNoValue, kInfinity);
      // The neighbours of the nearest leaf are similar, and seen at no cost.
      const std::size_t near = leaves_.nearest_leaf(q) / kTogether * kTogether;
      std::size_t leaf[kTogether];
      for (int k = 0; k < kTogether; ++k) leaf[k] = near + static_cast<std::size_t>(k);
      look(leaf, kTogether);
      int waiting = 0;
      for (const std::uint32_t l : leaves_.leaves_within(q, std::sqrt(best_))) {
        if (l - near < kTogether) continue;
        leaf[waiting++] = l;
        if (waiting < kTogether) continue;
        look(leaf, waiting);
        waiting = 0;
      }
      if (waiting > 0) look(leaf, waiting);
      out[q] = best_row_;
    }
  }

 private:
  static constexpr int kTogether = 4;  // leaves at a time, if the vectors are wide

  void begin_query(const float* query, std::uint32_t guess, float guess_distance) {
    query_ = query;
    best_ = guess_distance < kInfinity ? guess_distance : kInfinity;
    best_row_ = guess_distance < kInfinity ? guess : kNoValue;
  }
  void visit_first(std::size_t node) {
    float bound[kNode];
    const float* boxes = index_.leaf_boxes.data() + node * 16 * index_.dimension;
    box_bounds<1>(query_, &boxes, index_.dimension, bound);
    const std::size_t first =
        static_cast<std::size_t>(std::min_element(bound, bound + kNode) - bound);
    std::size_t leaf = node * kNode + first;
    if (bound[first] <= best_) look(&leaf, 1);
    bound[first] = kInfinity;
    look_within(bound, &node, 1);
  }
  template <int Nodes>
  void visit(const std::size_t* node) {
    float bound[Nodes * kNode];
    const float* boxes[Nodes];
    for (int n = 0; n < Nodes; ++n)
      boxes[n] = index_.leaf_boxes.data() + node[n] * 16 * index_.dimension;
    box_bounds<Nodes>(query_, boxes, index_.dimension, bound);
    look_within(bound, node, Nodes);
  }
  /// The leaves of the nodes with a bound within the best distance.
  void look_within(const float* bound, const std::size_t* node, std::size_t nodes) {
    std::size_t leaf[kTogether];
    const int together = wide_ ? kTogether : 2;
    int count = 0;
    for (std::size_t l = 0; l < nodes * kNode; ++l) {
      // Rows at an infinite distance are not near.
      if (!(bound[l] <= best_) || bound[l] == kInfinity) continue;
      leaf[count++] = node[l / kNode] * kNode + l % kNode;
      if (count < together) continue;
      look(leaf, count);
      count = 0;
    }
    if (count > 0) look(leaf, count);
  }
  void look(const std::size_t* leaf, int count) {
    float distances[kTogether][kLeaf];
    const float* values[kTogether];
    // A missing leaf repeats the last one.
    for (int k = 0; k < kTogether; ++k)
      values[k] = index_.values.data() + leaf[std::min(k, count - 1)] * kLeaf * index_.dimension;
#ifdef GPUREG_WIDE_TARGET
    std::uint64_t near =
        wide_ ? leaf_distances_wide(query_, values, index_.dimension, best_, distances)
              : leaf_distances(query_, values, index_.dimension, best_, distances);
#else
    std::uint64_t near = leaf_distances(query_, values, index_.dimension, best_, distances);
#endif
    if (count < kTogether) near &= (std::uint64_t(1) << count * kLeaf) - 1;
    for (; near != 0; near &= near - 1) {
      const auto place = static_cast<std::size_t>(__builtin_ctzll(near));
      const float d = distances[place / kLeaf][place % kLeaf];
      const std::uint32_t row = index_.row[leaf[place / kLeaf] * kLeaf + place % kLeaf];
      // best_row_ stays kNoValue while the best distance is infinite: such rows are not near.
      if (!(d <= best_) || (d == best_ && (best_row_ == kNoValue || row >= best_row_))) continue;
      best_ = d;
      best_row_ = row;
    }
  }

  const FeatureIndex& index_;
  const bool wide_;
  std::vector<float> bound_;
  LeafBounds leaves_;
  const float* query_ = nullptr;
  float best_ = kInfinity;
  std::uint32_t best_row_ = kNoValue;
};

}  // namespace

void nearest_features(FeatureRows queries, const FeatureIndex& order,
                      const std::vector<std::uint32_t>& places, FeatureRows rows,
                      const FeatureIndex& index, std::size_t begin, std::size_t end,
                      std::uint32_t* out, SearchVectors most) {
  Search search(index, most >= SearchVectors::kWide && has_wide_vectors());
  const bool bytes = most == SearchVectors::kBytes && index.bytes.valid;
  const auto query = [&](std::size_t k) {
    return queries.values + static_cast<std::size_t>(order.row[places[k]]) * queries.dimension;
  };
  const auto answer = [&](std::size_t k, std::uint32_t row) {
    for (std::uint32_t q = order.row[places[k]]; q != kNoValue; q = order.next_equal[q])
      out[q] = row;
  };
  for (std::size_t k = begin; bytes && k < end; k += ByteRows::kQueries) {
    const std::size_t count = std::min(ByteRows::kQueries, end - k);
    const float* some[ByteRows::kQueries];
    std::uint32_t found[ByteRows::kQueries];
    for (std::size_t q = 0; q < count; ++q) some[q] = query(k + q);
    search.nearest_by_bytes(some, count, found);
    for (std::size_t q = 0; q < count; ++q) answer(k + q, found[q]);
  }
  std::uint32_t guess = kNoValue;
  for (std::size_t k = begin; !bytes && k < end; ++k) {
    const float far =
        guess == kNoValue
            ? kInfinity
            : distance(query(k), rows.values + static_cast<std::size_t>(guess) * rows.dimension,
                       rows.dimension);
    guess = index.nodes == 0 ? kNoValue : search.nearest(query(k), guess, far);
    answer(k, guess);
  }
}

}  // namespace gpureg::cpu
