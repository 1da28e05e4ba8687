// SPDX-License-Identifier: BSD-3-Clause
#include "pruning/likeness.hpp"

#include <algorithm>
#include <cmath>

#include "common/for_each_on.hpp"
#include "pruning/agreement.hpp"

namespace gpureg::pruning {
namespace {

/// Pairs of each cloud from which the likeness of unrelated clouds is estimated.
constexpr std::size_t kBackground = 32;
/// Descriptors that are multiplied with one row at a time.
constexpr std::size_t kBlock = 64;
/// Every cloud keeps at least one in so many of the neighbours that are asked for.
constexpr std::size_t kOwnShare = 4;
/// Weight of the likeness that two clouds have to their neighbours: of clouds that are like many
/// others, a likeness says less (Conneau et al. 2018: CSLS, with a weight of 1).
constexpr double kNeighborWeight = 0.75;

double dot(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t d = 0; d < a.size(); ++d)
    sum += static_cast<double>(a[d]) * static_cast<double>(b[d]);
  return sum;
}

/// Each cloud with others that are evenly spread over the set.
std::vector<Edge> background(std::size_t n) {
  std::vector<Edge> edges;
  const std::size_t count = std::min(kBackground, n - 1);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t j = (i + 1 + k * (n - 1) / count) % n;
      edges.emplace_back(std::minmax(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)));
    }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

void keep_best(std::vector<Partner>& partners, std::size_t most) {
  const auto last = partners.begin() + static_cast<std::ptrdiff_t>(std::min(most, partners.size()));
  std::partial_sort(partners.begin(), last, partners.end(), [](const Partner& a, const Partner& b) {
    return a.value != b.value ? a.value > b.value : a.cloud < b.cloud;
  });
  partners.erase(last, partners.end());
}

}  // namespace

LikenessModel::LikenessModel(const std::vector<Summary>& clouds, std::size_t threads)
    : clouds_(clouds), threads_(threads) {
  if (clouds.size() < 2) return;
  const std::vector<Edge> edges = background(clouds.size());
  descriptors_ = scale_of(edges, similarities(edges));
  key_points_ = scale_of(edges, agreements(edges));
}

LikenessModel::Scale LikenessModel::scale_of(const std::vector<Edge>& edges,
                                             const std::vector<double>& values) const {
  Scale out;
  out.means.assign(clouds_.size(), 0);
  std::vector<double> counts(clouds_.size(), 0);
  for (std::size_t k = 0; k < edges.size(); ++k)
    for (const std::uint32_t cloud : {edges[k].first, edges[k].second}) {
      out.means[cloud] += values[k];
      ++counts[cloud];
    }
  for (std::size_t k = 0; k < counts.size(); ++k) out.means[k] /= counts[k];
  double squares = 0;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const double rest = out.normalized(values[k], edges[k]);
    squares += rest * rest;
  }
  if (squares > 0) out.deviation = std::sqrt(squares / static_cast<double>(edges.size()));
  return out;
}

std::vector<double> LikenessModel::similarities(const std::vector<Edge>& edges) const {
  std::vector<double> out(edges.size());
  for_each_on(
      threads_, edges.size(), [] { return 0; },
      [&](std::size_t k, int) {
        out[k] = dot(clouds_[edges[k].first].descriptor, clouds_[edges[k].second].descriptor);
      });
  return out;
}

std::vector<double> LikenessModel::agreements(const std::vector<Edge>& edges) const {
  std::vector<std::size_t> begins;
  for (std::size_t k = 0; k < edges.size(); ++k)
    if (k == 0 || edges[k].first != edges[k - 1].first) begins.push_back(k);
  std::vector<double> out(edges.size());
  for_each_on(
      threads_, begins.size(), [] { return Agreement(); },
      [&](std::size_t part, Agreement& agreement) {
        const std::size_t begin = begins[part];
        const std::size_t end = part + 1 < begins.size() ? begins[part + 1] : edges.size();
        agreement.set_target(clouds_[edges[begin].first]);
        for (std::size_t k = begin; k < end; ++k) out[k] = agreement.with(clouds_[edges[k].second]);
      });
  return out;
}

Partners LikenessModel::similar(std::size_t most) const {
  const std::size_t n = clouds_.size();
  Partners out(n);
  if (n < 2) return out;
  const std::size_t dimension = clouds_.front().descriptor.size();
  for_each_on(
      threads_, (n + kBlock - 1) / kBlock, [] { return std::vector<float>(); },
      [&](std::size_t block, std::vector<float>& rows) {
        // A block of descriptors side by side: sums of any vector width have the same order.
        const std::size_t begin = block * kBlock, count = std::min(kBlock, n - begin);
        rows.assign(dimension * kBlock, 0.0f);
        for (std::size_t k = 0; k < count; ++k)
          for (std::size_t d = 0; d < dimension; ++d)
            rows[d * kBlock + k] = clouds_[begin + k].descriptor[d];
        for (std::size_t j = 0; j < n; ++j) {
          float sums[kBlock] = {};
          for (std::size_t d = 0; d < dimension; ++d) {
            const float value = clouds_[j].descriptor[d];
            const float* row = rows.data() + d * kBlock;
            for (std::size_t k = 0; k < kBlock; ++k) sums[k] += value * row[k];
          }
          for (std::size_t k = 0; k < count; ++k) {
            const auto self = static_cast<std::uint32_t>(begin + k);
            const auto other = static_cast<std::uint32_t>(j);
            if (self == other) continue;
            const double value = descriptors_.normalized(sums[k], {self, other});
            out[self].push_back({static_cast<float>(value), other});
          }
        }
        for (std::size_t k = 0; k < count; ++k) {
          keep_best(out[begin + k], most);
          out[begin + k].shrink_to_fit();
        }
      });
  return out;
}

std::vector<Likeness> LikenessModel::compare(const std::vector<Edge>& edges) const {
  const std::vector<double> similar = similarities(edges), agreed = agreements(edges);
  std::vector<Likeness> out(edges.size());
  for (std::size_t k = 0; k < edges.size(); ++k)
    out[k] = {edges[k], static_cast<float>(descriptors_.normalized(similar[k], edges[k]) +
                                           key_points_.normalized(agreed[k], edges[k]))};
  return out;
}

Partners partners_of(const std::vector<Likeness>& pairs, std::size_t n) {
  Partners out(n);
  for (const Likeness& pair : pairs) {
    out[pair.edge.first].push_back({pair.value, pair.edge.second});
    out[pair.edge.second].push_back({pair.value, pair.edge.first});
  }
  for (std::vector<Partner>& partners : out) keep_best(partners, partners.size());
  return out;
}

std::vector<Likeness> pairs_of(const Partners& partners) {
  std::vector<Likeness> out;
  for (std::size_t k = 0; k < partners.size(); ++k)
    for (const Partner& partner : partners[k])
      out.push_back({std::minmax(static_cast<std::uint32_t>(k), partner.cloud), partner.value});
  const auto before = [](const Likeness& a, const Likeness& b) { return a.edge < b.edge; };
  const auto same = [](const Likeness& a, const Likeness& b) { return a.edge == b.edge; };
  std::stable_sort(out.begin(), out.end(), before);
  out.erase(std::unique(out.begin(), out.end(), same), out.end());
  return out;
}

std::vector<Edge> edges_of(const std::vector<Likeness>& pairs) {
  std::vector<Edge> edges;
  for (const Likeness& pair : pairs) edges.push_back(pair.edge);
  return edges;
}

std::vector<Likeness> with_third_clouds(const std::vector<Likeness>& known,
                                        const std::vector<Likeness>& through, std::size_t n,
                                        std::size_t most, std::size_t threads) {
  const Partners direct = partners_of(known, n), steps = partners_of(through, n);
  Partners out(n);
  for_each_on(
      threads, n, [&] { return std::vector<float>(n); },
      [&](std::size_t self, std::vector<float>& best) {
        std::fill(best.begin(), best.end(), 0.0f);
        for (const Partner& third : steps[self]) {
          if (third.value <= 0) break;
          for (const Partner& far : steps[third.cloud])
            best[far.cloud] = std::max(best[far.cloud], std::min(third.value, far.value));
        }
        best[self] = 0;
        for (const Partner& partner : direct[self]) {
          out[self].push_back({partner.value + best[partner.cloud], partner.cloud});
          best[partner.cloud] = 0;
        }
        for (std::size_t cloud = 0; cloud < n; ++cloud)
          if (best[cloud] > 0)
            out[self].push_back({best[cloud], static_cast<std::uint32_t>(cloud)});
        keep_best(out[self], most);
      });
  return pairs_of(out);
}

std::vector<Edge> choose(const std::vector<Likeness>& pairs, std::size_t n, std::size_t neighbors) {
  const Partners partners = partners_of(pairs, n);
  std::vector<double> typical(n, 0);
  std::vector<Edge> chosen;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t near = std::min(neighbors, partners[k].size());
    for (std::size_t p = 0; p < near; ++p) {
      typical[k] += static_cast<double>(partners[k][p].value) / static_cast<double>(near);
      if (kOwnShare * p < neighbors)
        chosen.push_back(std::minmax(static_cast<std::uint32_t>(k), partners[k][p].cloud));
    }
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  std::vector<std::pair<double, Edge>> others;
  for (const auto& [edge, value] : pairs)
    if (!std::binary_search(chosen.begin(), chosen.end(), edge))
      others.emplace_back(kNeighborWeight * (typical[edge.first] + typical[edge.second]) / 2 -
                              static_cast<double>(value),
                          edge);
  std::sort(others.begin(), others.end());
  const std::size_t most = (n * neighbors + 1) / 2;
  for (std::size_t k = 0; k < others.size() && chosen.size() < most; ++k)
    chosen.push_back(others[k].second);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace gpureg::pruning
