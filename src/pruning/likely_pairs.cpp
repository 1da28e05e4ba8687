// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iterator>
#include <string>

#include "common/for_each_on.hpp"
#include "common/validate.hpp"
#include "gpureg/pruning.hpp"
#include "pruning/likeness.hpp"

namespace gpureg::pruning {
namespace {

/// Clouds that words are learnt from, and features of each.
constexpr std::size_t kSampledClouds = 256, kSampledFeatures = 400;
/// The key points of each cloud are compared with those of so many others per neighbour that is
/// asked for, and of at least so many.
constexpr std::size_t kComparedPerNeighbor = 3, kLeastCompared = 100;

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

void check_same_words(const std::vector<Summary>& clouds) {
  for (std::size_t k = 0; k < clouds.size(); ++k)
    if (clouds[k].descriptor.size() != clouds.front().descriptor.size())
      throw InvalidArgument("clouds[" + std::to_string(k) + "].descriptor has length " +
                            std::to_string(clouds[k].descriptor.size()) + ", that of clouds[0] " +
                            std::to_string(clouds.front().descriptor.size()) +
                            "; they are of different words");
}

void merge(const std::vector<Edge>& more, std::vector<Edge>& edges) {
  std::vector<Edge> both;
  std::set_union(edges.begin(), edges.end(), more.begin(), more.end(), std::back_inserter(both));
  edges = std::move(both);
}

}  // namespace

void Options::validate() const {
  require(neighbors >= 1, "neighbors", neighbors, "1 or more");
  require(words >= 1, "words", words, "1 or more");
  require(threads >= 0, "threads", threads, "0 or more");
}

std::vector<Pair> likely_pairs(const std::vector<Summary>& clouds, const Options& options) {
  options.validate();
  check_same_words(clouds);
  const std::size_t n = clouds.size(),
                    threads = static_cast<std::size_t>(thread_count(options.threads));
  const std::size_t compared =
      std::max(kLeastCompared, kComparedPerNeighbor * std::size_t{options.neighbors});
  const LikenessModel model(clouds, threads);
  const std::vector<Edge> first = edges_of(pairs_of(model.similar(compared)));
  std::vector<Likeness> known = model.compare(first);
  // Clouds that a third one suggests are compared, too.
  std::vector<Edge> second,
      suggested = edges_of(with_third_clouds(known, known, n, compared, threads));
  std::set_difference(suggested.begin(), suggested.end(), first.begin(), first.end(),
                      std::back_inserter(second));
  for (const Likeness& pair : model.compare(second)) known.push_back(pair);
  // What third clouds tell makes them better third clouds.
  std::vector<Likeness> steps = with_third_clouds(known, known, n, compared, threads);
  for (Likeness& pair : steps) pair.value /= 2;
  std::vector<Edge> edges =
      choose(with_third_clouds(known, steps, n, compared, threads), n, options.neighbors);
  std::vector<Edge> consecutive;
  for (std::uint32_t k = 0; k < n; ++k)
    for (std::uint32_t other = k + 1; other < n && other - k <= options.consecutive; ++other)
      consecutive.emplace_back(k, other);
  merge(consecutive, edges);
  std::vector<Pair> pairs;
  for (const auto& [low, high] : edges) pairs.push_back({high, low});
  return pairs;
}

std::vector<Pair> likely_pairs(const std::vector<PreparedCloud>& clouds, const Options& options) {
  options.validate();
  std::vector<std::vector<float>> samples;
  std::vector<FeatureView> views;
  const std::size_t step = std::max<std::size_t>(1, clouds.size() / kSampledClouds);
  for (std::size_t k = 0; k < clouds.size(); k += step)
    samples.push_back(some_of(clouds[k].features(), clouds[k].feature_dimension()));
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const std::size_t dimension = clouds[k * step].feature_dimension();
    views.push_back(
        {samples[k].data(), dimension > 0 ? samples[k].size() / dimension : 0, dimension});
  }
  const Matrix words = learn_words(views, options.words);
  std::vector<Summary> summaries(clouds.size());
  for_each_on(
      static_cast<std::size_t>(thread_count(options.threads)), clouds.size(), [] { return 0; },
      [&](std::size_t k, int) { summaries[k] = summarize(clouds[k], words); });
  return likely_pairs(summaries, options);
}

}  // namespace gpureg::pruning
