// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>

/// Randomness as a function of its key. The standard distributions differ between libraries, so
/// they are not used.
namespace gpureg::synthetic {

/// The finaliser of splitmix64: a bijection of 64 bits whose every output bit depends on every
/// input bit.
inline std::uint64_t mix64(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

/// Purpose of a random number: part of its key, so that no two uses share a stream.
enum class Purpose : std::uint64_t {
  house,
  furniture,
  path,
  gaze,
  shake,
  pixel,
  hole,
  distortion,
  drift,
  texture,
  rearrangement
};

inline std::uint64_t hash_key(std::uint64_t seed, Purpose purpose, std::uint64_t a = 0,
                              std::uint64_t b = 0) {
  return mix64(mix64(mix64(mix64(seed) ^ static_cast<std::uint64_t>(purpose)) ^ a) ^ b);
}

/// 24 bits to [0, 1).
inline float unit_float(std::uint64_t bits24) {
  return static_cast<float>(bits24 & 0xFFFFFFu) * 0x1p-24f;
}

/// Two independent N(0, 1) from 64 random bits (Box-Muller).
struct NormalPair {
  float a, b;
};
inline NormalPair normal_pair(std::uint64_t bits) {
  const float radius = std::sqrt(-2.0f * std::log(unit_float(bits >> 40) + 0x1p-25f));
  const float angle = 6.2831853f * unit_float(bits >> 16);
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

/// A sequence of random numbers, for code that runs in one thread.
class Random {
 public:
  explicit Random(std::uint64_t key) : key_(key) {}

  std::uint64_t bits() { return mix64(key_ ^ mix64(counter_++)); }
  float uniform() { return unit_float(bits() >> 40); }
  float uniform(float low, float high) { return low + (high - low) * uniform(); }
  int below(int n) { return static_cast<int>((bits() >> 33) % static_cast<std::uint64_t>(n)); }
  int between(int low, int high) { return low + below(high - low + 1); }
  bool chance(float p) { return uniform() < p; }
  float normal() { return normal_pair(bits()).a; }

 private:
  std::uint64_t key_, counter_ = 0;
};

}  // namespace gpureg::synthetic
