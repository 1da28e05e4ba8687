// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gpureg/prepared_cloud.hpp"
#include "gpureg/registration.hpp"

/// Which pairs of a large set are worth aligning: those of clouds that look alike. The cost of a
/// set then grows with n * k, not with n * n. Every function is deterministic and thread-safe.
namespace gpureg::pruning {

/// Features of one cloud: size rows of dimension floats without gaps. Rows of zeros are not used.
struct FeatureView {
  const float* data = nullptr;
  std::size_t size = 0, dimension = 0;
};

/// Rows of floats.
struct Matrix {
  std::vector<float> data;  ///< row by row
  std::size_t rows = 0, columns = 0;
};

/// Options of likely_pairs().
struct Options {
  /// Pairs of a cloud on average, >= 1. A cloud that is like many others has more, every cloud at
  /// least a quarter of them: those with its most alike ones.
  std::uint32_t neighbors = 20;
  std::uint32_t consecutive = 0;  ///< also this many clouds that follow each one in their order
  std::uint32_t words = 64;       ///< >= 1
  int threads = 0;                ///< 0: one per core. Results do not depend on it.

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Centres of k-means over features of some clouds, the rarest first. No labels and no training
/// set: the words are those of the scene itself.
/// @param most number of words, >= 1; fewer come back if there are fewer features.
/// @return words x dimension.
/// @throws InvalidArgument for clouds of different dimensions.
Matrix learn_words(const std::vector<FeatureView>& clouds, std::uint32_t most);

/// Global descriptor of a cloud: the residuals of its features from their nearest words, summed per
/// word. Rigid motions change it as little as they change the features.
/// @return words.rows * words.columns floats of unit length; zeros for a cloud without features.
/// @throws InvalidArgument if the dimensions differ.
/// Sources: Jegou et al. 2010 (VLAD); Arandjelovic and Zisserman 2013 (intra-normalisation).
std::vector<float> describe(const FeatureView& cloud, const Matrix& words);

/// What the choice of pairs needs of a cloud: some 15 KB instead of megabytes.
struct Summary {
  std::vector<float> descriptor;  ///< of describe()
  /// At most 256 key points: those whose features have the rarest words, at a distance from each
  /// other.
  std::vector<Eigen::Vector3f> points;
  std::vector<Eigen::Vector3f> normals;  ///< one per key point
  /// One row per key point: signed roots at a length of 127.
  std::vector<std::int8_t> features;
  float feature_radius = 0;  ///< of the cloud's options, metres
};

/// @throws InvalidArgument for an empty handle, and if the dimensions of features and words
///   differ.
Summary summarize(const PreparedCloud& cloud, const Matrix& words);

/// The most alike pairs of clouds, source > target: those that are likely to overlap. Two clouds
/// are alike if their descriptors are, if matches of their key points agree with one motion
/// (only those of the most similar descriptors are compared), and if a third cloud is like both.
/// @return ascending by target, then source.
/// @throws InvalidArgument for options out of range, and for summaries by different words.
std::vector<Pair> likely_pairs(const std::vector<Summary>& clouds, const Options& options = {});

/// All of the above for clouds in memory.
/// @return pairs source > target, ascending by target, then source.
/// @throws InvalidArgument for options out of range, an empty handle, features of different
///   dimensions.
std::vector<Pair> likely_pairs(const std::vector<PreparedCloud>& clouds,
                               const Options& options = {});

}  // namespace gpureg::pruning
