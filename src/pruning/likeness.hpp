// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "gpureg/pruning.hpp"

namespace gpureg::pruning {

/// Two clouds, the lower number first.
using Edge = std::pair<std::uint32_t, std::uint32_t>;

struct Likeness {
  Edge edge;
  float value = 0;  ///< in standard deviations above that of unrelated clouds
};

/// Clouds that are like one cloud, the most alike first.
struct Partner {
  float value = 0;
  std::uint32_t cloud = 0;
};
using Partners = std::vector<std::vector<Partner>>;

/// Compares clouds with each other. Results do not depend on the number of threads.
class LikenessModel {
 public:
  /// The clouds must stay alive.
  LikenessModel(const std::vector<Summary>& clouds, std::size_t threads);

  /// The `most` clouds whose descriptors are the most similar to that of each.
  Partners similar(std::size_t most) const;
  /// By descriptors and key points. edges: ascending.
  std::vector<Likeness> compare(const std::vector<Edge>& edges) const;

 private:
  /// What the likeness of unrelated clouds is, estimated from a few pairs of each cloud.
  struct Scale {
    std::vector<double> means;
    double deviation = 1;
    double normalized(double value, const Edge& edge) const {
      return (value - (means[edge.first] + means[edge.second]) / 2) / deviation;
    }
  };
  std::vector<double> similarities(const std::vector<Edge>& edges) const;
  std::vector<double> agreements(const std::vector<Edge>& edges) const;
  Scale scale_of(const std::vector<Edge>& edges, const std::vector<double>& values) const;

  const std::vector<Summary>& clouds_;
  std::size_t threads_;
  Scale descriptors_, key_points_;
};

/// Adds to the likeness of two clouds that of the best third cloud which is like both: the lower of
/// its two in `through`. @return the pairs of each of n clouds with its `most` best partners,
/// ascending.
std::vector<Likeness> with_third_clouds(const std::vector<Likeness>& known,
                                        const std::vector<Likeness>& through, std::size_t n,
                                        std::size_t most, std::size_t threads);

/// The partners of each of n clouds, the most alike first.
Partners partners_of(const std::vector<Likeness>& pairs, std::size_t n);

/// Each pair of partners once, ascending.
std::vector<Likeness> pairs_of(const Partners& partners);

std::vector<Edge> edges_of(const std::vector<Likeness>& pairs);

/// The most alike pairs of n clouds: `neighbors` for each cloud on average, and for each at least a
/// quarter of that.
std::vector<Edge> choose(const std::vector<Likeness>& pairs, std::size_t n, std::size_t neighbors);

}  // namespace gpureg::pruning
