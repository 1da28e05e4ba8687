// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>

/// What happens to one surfel or pixel, for the CPU and the GPU: + - * / and sqrt alone, so that
/// both give the same bits. After Keller et al., "Real-time 3D Reconstruction in Dynamic Scenes
/// using Point-based Fusion", 3DV 2013.
#if defined(__CUDACC__)
#define SURFEL_HD __host__ __device__ inline
#else
#define SURFEL_HD inline
#endif

namespace surfel {

struct Vec {
  float x, y, z;
};
SURFEL_HD Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
SURFEL_HD Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
SURFEL_HD Vec operator*(float s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
SURFEL_HD float dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
SURFEL_HD Vec cross(Vec a, Vec b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
SURFEL_HD Vec normalized(Vec a) {
  const float length = sqrtf(dot(a, a));
  return length > 0 ? (1 / length) * a : a;
}

/// world_from_camera or the like: p' = R p + t, R row by row.
struct Pose {
  float r[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, t[3] = {0, 0, 0};
};
SURFEL_HD Vec rotate(const Pose& m, Vec p) {
  return {m.r[0] * p.x + m.r[1] * p.y + m.r[2] * p.z, m.r[3] * p.x + m.r[4] * p.y + m.r[5] * p.z,
          m.r[6] * p.x + m.r[7] * p.y + m.r[8] * p.z};
}
SURFEL_HD Vec transform(const Pose& m, Vec p) { return rotate(m, p) + Vec{m.t[0], m.t[1], m.t[2]}; }
SURFEL_HD Vec inverse_transform(const Pose& m, Vec p) {
  const Vec d = p - Vec{m.t[0], m.t[1], m.t[2]};
  return {m.r[0] * d.x + m.r[3] * d.y + m.r[6] * d.z, m.r[1] * d.x + m.r[4] * d.y + m.r[7] * d.z,
          m.r[2] * d.x + m.r[5] * d.y + m.r[8] * d.z};
}

struct Camera {
  float fx, fy, cx, cy;  ///< pixels
};

struct Surfel {
  Vec position, normal;  ///< world, metres; the normal faces the cameras that saw it
  float radius;          ///< metres
  float confidence;      ///< sum of the weights of its measurements
  int first, last;       ///< frames: t0 and tu of the paper
  std::uint32_t colour;  ///< 0xRRGGBB
};

struct Options {
  int stride = 2;               ///< pixels: of stride x stride one is measured
  int active_frames = 150;      ///< a surfel that was not seen for longer takes no part
  float min_confidence = 1.0f;  ///< surfels below do not belong to the map
  int trial_frames = 90;        ///< within which a surfel must reach it, or is removed
};

/// A depth image as the kernels see it.
struct Frame {
  const float* depth;          // metres, 0: none
  const std::uint8_t* colour;  // blue, green, red
  int width, height;           // pixels
  Camera camera;
  Pose world_from_camera;
  int number, stride;
};

constexpr int kReach = 4;           // pixels to both sides from which a normal is taken
constexpr float kJump = 0.05f;      // of the depth: more is an edge, which has no surface
constexpr float kMinCosine = 0.7f;  // between the normals of one surface
constexpr int kCleanEvery = 20;     // fused frames between two cleanings
constexpr unsigned long long kNoSurfel = ~0ull;

SURFEL_HD Vec unproject(const Frame& f, int u, int v) {
  const float z = f.depth[v * f.width + u];
  return {(static_cast<float>(u) - f.camera.cx) / f.camera.fx * z,
          (static_cast<float>(v) - f.camera.cy) / f.camera.fy * z, z};
}

/// The measurement of a pixel in the camera; false where there is no surface.
struct Measured {
  Vec position, normal;  // camera
  float radius, weight;
};
SURFEL_HD bool measure(const Frame& f, int u, int v, Measured& m) {
  if (u < kReach || v < kReach || u + kReach >= f.width || v + kReach >= f.height) return false;
  const Vec right = unproject(f, u + kReach, v), left = unproject(f, u - kReach, v),
            down = unproject(f, u, v + kReach), up = unproject(f, u, v - kReach);
  m.position = unproject(f, u, v);
  const float z = m.position.z;
  if (!(z > 0)) return false;
  for (const float other : {right.z, left.z, down.z, up.z}) {
    const float jump = other - z;
    if (!(other > 0) || jump > kJump * z || -jump > kJump * z) return false;
  }
  m.normal = normalized(cross(down - up, right - left));
  const float cosine = -dot(m.normal, m.position) / sqrtf(dot(m.position, m.position));
  if (!(cosine > 0.15f)) return false;  // seen nearly edge-on: noise
  m.radius = z * static_cast<float>(f.stride) / (1.41421356f * f.camera.fx * cosine);
  // Keller's weight falls with the distance from the centre of the image; the variance of depths
  // grows with the fourth power of the depth, that of their means is bounded by other errors.
  const float x = (static_cast<float>(u) - f.camera.cx) / f.camera.cx,
              y = (static_cast<float>(v) - f.camera.cy) / f.camera.cy;
  m.weight = cosine / ((1 + x * x + y * y) * (z > 1 ? z * z : 1));
  return true;
}

/// Place of a surfel in the index map, or -1: outside, behind, seen from behind. z: its depth.
SURFEL_HD int cell_of(const Frame& f, const Surfel& s, float& z) {
  const Vec p = inverse_transform(f.world_from_camera, s.position);
  z = p.z;
  if (!(p.z > 0.1f)) return -1;
  const Vec origin = {f.world_from_camera.t[0], f.world_from_camera.t[1], f.world_from_camera.t[2]};
  if (!(dot(s.normal, origin - s.position) > 0)) return -1;
  const float stride = static_cast<float>(f.stride);
  const float u = (f.camera.fx * p.x / p.z + f.camera.cx) / stride + 0.5f,
              v = (f.camera.fy * p.y / p.z + f.camera.cy) / stride + 0.5f;
  const int columns = f.width / f.stride, rows = f.height / f.stride;
  if (!(u >= 0) || !(v >= 0) || u >= static_cast<float>(columns) || v >= static_cast<float>(rows))
    return -1;
  return static_cast<int>(v) * columns + static_cast<int>(u);
}

/// Nearest first, then the lower index: one number, so that a minimum decides.
SURFEL_HD unsigned long long index_key(float z, std::uint32_t index) {
  const auto tenth_millimetres = static_cast<unsigned long long>(z * 10000.0f);
  return (tenth_millimetres << 32) | index;
}

SURFEL_HD bool same_surface(const Frame& f, const Measured& m, const Surfel& s) {
  const Vec p = inverse_transform(f.world_from_camera, s.position);
  const float difference = p.z - m.position.z,
              tolerance = 0.01f + 0.01f * m.position.z * m.position.z;
  return difference < tolerance && -difference < tolerance &&
         dot(rotate(f.world_from_camera, m.normal), s.normal) > kMinCosine;
}

SURFEL_HD std::uint32_t colour_at(const Frame& f, int u, int v) {
  if (f.colour == nullptr) return 0x808080u;
  const std::uint8_t* c = f.colour + 3 * (v * f.width + u);
  return static_cast<std::uint32_t>(c[2]) << 16 | static_cast<std::uint32_t>(c[1]) << 8 | c[0];
}

SURFEL_HD void update(const Frame& f, const Measured& m, int u, int v, Surfel& s) {
  const float total = s.confidence + m.weight, old = s.confidence / total, now = m.weight / total;
  s.position = old * s.position + now * transform(f.world_from_camera, m.position);
  s.normal = normalized(old * s.normal + now * rotate(f.world_from_camera, m.normal));
  if (m.radius < s.radius) s.radius = old * s.radius + now * m.radius;
  const std::uint32_t colour = colour_at(f, u, v);
  std::uint32_t mixed = 0;
  for (int shift = 0; shift <= 16; shift += 8) {
    const float c = old * static_cast<float>((s.colour >> shift) & 0xFFu) +
                    now * static_cast<float>((colour >> shift) & 0xFFu) + 0.5f;
    mixed |= static_cast<std::uint32_t>(c) << shift;
  }
  s.colour = mixed;
  s.confidence = total;
  s.last = f.number;
}

SURFEL_HD Surfel born(const Frame& f, const Measured& m, int u, int v) {
  return {transform(f.world_from_camera, m.position),
          rotate(f.world_from_camera, m.normal),
          m.radius,
          m.weight,
          f.number,
          f.number,
          colour_at(f, u, v)};
}

/// What a pixel does: updates the surfel of its cell, gives birth to one, or neither, because a
/// neighbouring pixel sees the surfel of this surface.
enum class Fate : unsigned char { nothing, update, birth };
SURFEL_HD Fate fate_of(const Frame& f, const Measured& m, const unsigned long long* cells,
                       const Surfel* surfels, int column, int row) {
  const int columns = f.width / f.stride, rows = f.height / f.stride;
  const unsigned long long own = cells[row * columns + column];
  if (own != kNoSurfel && same_surface(f, m, surfels[static_cast<std::uint32_t>(own)]))
    return Fate::update;
  for (int y = row > 0 ? row - 1 : 0; y <= row + 1 && y < rows; ++y) {
    for (int x = column > 0 ? column - 1 : 0; x <= column + 1 && x < columns; ++x) {
      const unsigned long long other = cells[y * columns + x];
      if (other != kNoSurfel && same_surface(f, m, surfels[static_cast<std::uint32_t>(other)]))
        return Fate::nothing;
    }
  }
  return Fate::birth;
}

/// Survives the cleaning of unconfirmed surfels.
SURFEL_HD bool stays(const Surfel& s, int frame, const Options& o) {
  return s.confidence >= o.min_confidence || frame - s.first <= o.trial_frames;
}

/// The motion of the keyframes up to each one, summed: 12 numbers of R and t.
struct MotionSum {
  double m[12];
};

/// The paper's correction: the mean motion of the keyframes with t0 < t < tu. A surfel without one
/// follows the keyframe that is nearest in time (the paper would remove it). frames: ascending;
/// sums: one more than frames; sessions: of each keyframe.
SURFEL_HD void correct(Surfel& s, const int* frames, const int* sessions, const MotionSum* sums,
                       int count) {
  int low = 0, high = count;
  while (low < high) {  // the first keyframe after t0
    const int middle = (low + high) / 2;
    if (frames[middle] > s.first)
      high = middle;
    else
      low = middle + 1;
  }
  const int begin = low;
  high = count;
  while (low < high) {  // the first keyframe not before tu
    const int middle = (low + high) / 2;
    if (frames[middle] >= s.last)
      high = middle;
    else
      low = middle + 1;
  }
  int from = begin, to = low;
  if (from == to) {
    // A session starts with a keyframe, so the one before t0 is of the surfel's session.
    from = begin > 0 ? begin - 1 : 0;
    if (begin > 0 && begin < count && sessions[begin] == sessions[from] &&
        frames[begin] - s.first < s.first - frames[from])
      from = begin;
    to = from + 1;
  }
  const double share = 1.0 / (to - from);
  float mean[12];
  for (int k = 0; k < 12; ++k)
    mean[k] = static_cast<float>((sums[to].m[k] - sums[from].m[k]) * share);
  Pose motion;
  for (int k = 0; k < 9; ++k) motion.r[k] = mean[k];
  for (int k = 0; k < 3; ++k) motion.t[k] = mean[9 + k];
  s.position = transform(motion, s.position);
  s.normal = normalized(rotate(motion, s.normal));
}

}  // namespace surfel
