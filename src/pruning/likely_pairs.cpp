// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "common/host_threads.hpp"
#include "common/validate.hpp"
#include "gpureg/pruning.hpp"
#include "pruning/unit_features.hpp"

namespace gpureg::pruning {
namespace {

/// Rows of one product of matrices: a fixed number, so that sums do not depend on the threads.
constexpr Eigen::Index kTile = 128;
/// Clouds that words are learnt from, and features of each.
constexpr std::size_t kSampledClouds = 256, kSampledFeatures = 400;

std::size_t thread_count(int threads, std::size_t most) {
  const std::size_t wanted = threads > 0
                                 ? static_cast<std::size_t>(threads)
                                 : std::max<std::size_t>(1, std::thread::hardware_concurrency());
  return std::max<std::size_t>(1, std::min(wanted, most));
}

FeatureView view_of(const std::vector<float>& features, std::size_t dimension) {
  return {features.data(), dimension > 0 ? features.size() / dimension : 0, dimension};
}

/// Evenly chosen rows.
std::vector<float> some_of(const std::vector<float>& features, std::size_t dimension) {
  const std::size_t rows = dimension > 0 ? features.size() / dimension : 0;
  const std::size_t step = std::max<std::size_t>(1, rows / kSampledFeatures);
  std::vector<float> out;
  for (std::size_t k = 0; k < rows; k += step)
    out.insert(out.end(), features.begin() + static_cast<std::ptrdiff_t>(k * dimension),
               features.begin() + static_cast<std::ptrdiff_t>((k + 1) * dimension));
  return out;
}

}  // namespace

void Options::validate() const {
  require(neighbors >= 1, "neighbors", neighbors, "1 or more");
  require(words >= 1, "words", words, "1 or more");
  require(threads >= 0, "threads", threads, "0 or more");
}

std::vector<float> describe(const FeatureView& cloud, const Matrix& words) {
  const auto count = static_cast<Eigen::Index>(words.rows),
             dimension = static_cast<Eigen::Index>(words.columns);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> sums =
      Eigen::MatrixXd::Zero(count, dimension);
  if (cloud.size > 0 && count > 0) {
    if (cloud.dimension != words.columns)
      throw InvalidArgument("the features have dimension " + std::to_string(cloud.dimension) +
                            ", the words " + std::to_string(words.columns));
    const Eigen::Map<const Rows> centres(words.data.data(), count, dimension);
    const Eigen::VectorXf offsets = 0.5f * centres.rowwise().squaredNorm();
    const Rows rows = unit_features(cloud);
    for (Eigen::Index k = 0; k < rows.rows(); ++k) {
      Eigen::Index nearest;
      (centres * rows.row(k).transpose() - offsets).maxCoeff(&nearest);
      sums.row(nearest) += (rows.row(k) - centres.row(nearest)).cast<double>();
    }
  }
  for (Eigen::Index c = 0; c < count; ++c)
    if (const double length = sums.row(c).norm(); length > 0) sums.row(c) /= length;
  if (const double length = sums.norm(); length > 0) sums /= length;
  std::vector<float> out(words.rows * words.columns);
  std::transform(sums.data(), sums.data() + sums.size(), out.begin(),
                 [](double v) { return static_cast<float>(v); });
  return out;
}

std::vector<Pair> nearest_pairs(const Matrix& descriptors, std::uint32_t k, int threads) {
  require(k >= 1, "k", k, "1 or more");
  const auto n = static_cast<Eigen::Index>(descriptors.rows);
  const Eigen::Map<const Rows> all(descriptors.data.data(), n,
                                   static_cast<Eigen::Index>(descriptors.columns));
  const auto tiles = static_cast<std::size_t>((n + kTile - 1) / kTile);
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> found(tiles);
  std::atomic<std::size_t> next{0};
  on_threads(thread_count(threads, tiles), [&](std::size_t) {
    for (std::size_t tile; (tile = next++) < tiles;) {
      const Eigen::Index begin = static_cast<Eigen::Index>(tile) * kTile;
      const Rows products = all.middleRows(begin, std::min(kTile, n - begin)) * all.transpose();
      std::vector<std::pair<float, std::uint32_t>> order(descriptors.rows);
      for (Eigen::Index row = 0; row < products.rows(); ++row) {
        const auto self = static_cast<std::uint32_t>(begin + row);
        order.clear();
        for (Eigen::Index column = 0; column < n; ++column)
          if (column != begin + row)
            order.emplace_back(-products(row, column), static_cast<std::uint32_t>(column));
        const auto last =
            order.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(k, order.size()));
        std::partial_sort(order.begin(), last, order.end());
        for (auto at = order.begin(); at != last; ++at)
          found[tile].push_back(std::minmax({self, at->second}));
      }
    }
  });
  std::set<std::pair<std::uint32_t, std::uint32_t>> unique;
  for (const auto& part : found) unique.insert(part.begin(), part.end());
  std::vector<Pair> pairs;
  for (const auto& [low, high] : unique) pairs.push_back({high, low});
  return pairs;
}

std::vector<Pair> likely_pairs(const std::vector<PreparedCloud>& clouds, const Options& options) {
  options.validate();
  std::vector<std::vector<float>> samples;
  std::vector<FeatureView> views;
  const std::size_t step = std::max<std::size_t>(1, clouds.size() / kSampledClouds);
  for (std::size_t k = 0; k < clouds.size(); k += step)
    samples.push_back(some_of(clouds[k].features(), clouds[k].feature_dimension()));
  for (std::size_t k = 0; k < samples.size(); ++k)
    views.push_back(view_of(samples[k], clouds[k * step].feature_dimension()));
  const Matrix words = learn_words(views, options.words);
  Matrix descriptors;
  descriptors.rows = clouds.size();
  descriptors.columns = words.rows * words.columns;
  descriptors.data.resize(descriptors.rows * descriptors.columns);
  std::atomic<std::size_t> next{0};
  on_threads(thread_count(options.threads, clouds.size()), [&](std::size_t) {
    for (std::size_t k; (k = next++) < clouds.size();) {
      const std::vector<float> features = clouds[k].features();
      const std::vector<float> one =
          describe(view_of(features, clouds[k].feature_dimension()), words);
      std::copy(one.begin(), one.end(),
                descriptors.data.begin() + static_cast<std::ptrdiff_t>(k * descriptors.columns));
    }
  });
  std::set<std::pair<std::uint32_t, std::uint32_t>> unique;
  for (const Pair& pair : nearest_pairs(descriptors, options.neighbors, options.threads))
    unique.insert({pair.target, pair.source});
  for (std::uint32_t k = 0; k < clouds.size(); ++k)
    for (std::uint32_t next_one = k + 1;
         next_one < clouds.size() && next_one - k <= options.consecutive; ++next_one)
      unique.insert({k, next_one});
  std::vector<Pair> pairs;
  for (const auto& [low, high] : unique) pairs.push_back({high, low});
  return pairs;
}

}  // namespace gpureg::pruning
