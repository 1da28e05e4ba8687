// SPDX-License-Identifier: BSD-3-Clause
// src/math and src/algorithm: the same bits from one source on the host and on the device. Every
// function runs over random inputs on both sides; outputs are compared as bytes.
#include <cuda_runtime.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithm/closest_build.hpp"
#include "algorithm/fit.hpp"
#include "algorithm/fpfh.hpp"
#include "algorithm/icp.hpp"
#include "algorithm/inlier.hpp"
#include "algorithm/moments.hpp"
#include "algorithm/normal.hpp"
#include "algorithm/quadruple.hpp"
#include "algorithm/voxel.hpp"

namespace gpureg {
namespace {

constexpr int kItems = 1 << 20;

void check(cudaError_t error, const char* what) {
  if (error != cudaSuccess)
    throw std::runtime_error(std::string(what) + ": " + cudaGetErrorString(error));
}

template <typename Item, typename In, typename Out>
__global__ void run_items(Item item, const In* in, Out* out, int count) {
  const int k =
      static_cast<int>(blockIdx.x) * static_cast<int>(blockDim.x) + static_cast<int>(threadIdx.x);
  if (k < count) out[k] = item(in[k]);
}

/// Element: a struct with Out operator()(In) const, host and device. Outputs are zeroed first, so
/// that padding compares equal.
template <typename Item, typename Out, typename In>
void expect_same_bits(const std::vector<In>& in) {
  const int count = static_cast<int>(in.size());
  std::vector<Out> host(in.size()), device(in.size());
  std::memset(static_cast<void*>(host.data()), 0, host.size() * sizeof(Out));
  for (int k = 0; k < count; ++k)
    host[static_cast<std::size_t>(k)] = Item()(in[static_cast<std::size_t>(k)]);
  In* in_device = nullptr;
  Out* out_device = nullptr;
  cudaStream_t stream;
  check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
  check(cudaMalloc(&in_device, in.size() * sizeof(In)), "cudaMalloc");
  check(cudaMalloc(&out_device, in.size() * sizeof(Out)), "cudaMalloc");
  check(cudaMemsetAsync(out_device, 0, in.size() * sizeof(Out), stream), "cudaMemsetAsync");
  check(
      cudaMemcpyAsync(in_device, in.data(), in.size() * sizeof(In), cudaMemcpyHostToDevice, stream),
      "cudaMemcpyAsync");
  run_items<<<(count + 127) / 128, 128, 0, stream>>>(Item(), in_device, out_device, count);
  check(cudaGetLastError(), "launch");
  check(cudaMemcpyAsync(device.data(), out_device, in.size() * sizeof(Out), cudaMemcpyDeviceToHost,
                        stream),
        "cudaMemcpyAsync");
  check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
  check(cudaFree(in_device), "cudaFree");
  check(cudaFree(out_device), "cudaFree");
  check(cudaStreamDestroy(stream), "cudaStreamDestroy");
  int different = 0;
  for (std::size_t k = 0; k < in.size(); ++k)
    different += std::memcmp(&host[k], &device[k], sizeof(Out)) != 0;
  EXPECT_EQ(different, 0) << "of " << in.size();
}

class Items : public ::testing::Test {
 protected:
  void SetUp() override {
    int devices = 0;
    const cudaError_t error = cudaGetDeviceCount(&devices);
    if (error != cudaSuccess || devices == 0)
      GTEST_SKIP() << "no CUDA device: " << cudaGetErrorString(error);
  }
  float value(float scale = 1) { return scale * normal(random); }
  Vec3 point(float scale = 1) { return {value(scale), value(scale), value(scale)}; }
  Vec3 unit() { return normalized_or_zero(point()); }
  Pose<float> pose() {
    Pose<float> p{value(), value(), value(), value(), value(2), value(2), value(2)};
    const float n = std::sqrt(p.w * p.w + p.x * p.x + p.y * p.y + p.z * p.z);
    p.w /= n;
    p.x /= n;
    p.y /= n;
    p.z /= n;
    return p;
  }
  template <typename T, typename Make>
  std::vector<T> many(Make&& make, int count = kItems) {
    std::vector<T> out(static_cast<std::size_t>(count));
    for (T& item : out) item = make();
    return out;
  }
  std::mt19937 random{1};
  std::normal_distribution<float> normal;
};

struct Draw {
  GPUREG_HD Quadruple operator()(std::uint64_t v) const {
    return draw_quadruple(static_cast<std::uint32_t>(v), v * 0x9E3779B97F4A7C15ull, 4999);
  }
};
TEST_F(Items, Quadruples) {
  std::uint64_t k = 0;
  expect_same_bits<Draw, Quadruple>(many<std::uint64_t>([&] { return k++; }));
}

struct YX {
  float y, x;
};
struct Atan {
  GPUREG_HD float operator()(YX v) const { return exact_atan2(v.y, v.x); }
};
TEST_F(Items, Atan2) {
  expect_same_bits<Atan, float>(many<YX>([&] { return YX{value(), value()}; }));
}

struct FourPairs {
  Vec3 p[4], q[4];
};
struct Fitted {
  Pose<float> pose;
  int valid;
};
struct Fit {
  GPUREG_HD Fitted operator()(const FourPairs& v) const {
    Fitted out{{0, 0, 0, 0, 0, 0, 0}, 0};
    out.valid = fit_rigid(v.p, v.q, out.pose) ? 1 : 0;
    return out;
  }
};
TEST_F(Items, FitOfFourPairs) {
  expect_same_bits<Fit, Fitted>(many<FourPairs>([&] {
    FourPairs v;
    const Rigid m = to_rigid(pose());
    for (int k = 0; k < 4; ++k) {
      v.p[k] = point();
      v.q[k] = apply(m, v.p[k]) + point(0.03f);
    }
    return v;
  }));
}

struct TwoOriented {
  Vec3 p, n, q, m;
};
struct FeatureBins {
  int b[4];
};
struct FeatureItem {
  GPUREG_HD FeatureBins operator()(const TwoOriented& v) const {
    const PairFeature f = pair_feature(v.p, v.n, v.q, v.m);
    return {{f.bins[0], f.bins[1], f.bins[2], f.valid ? 1 : 0}};
  }
};
TEST_F(Items, PairFeatures) {
  expect_same_bits<FeatureItem, FeatureBins>(
      many<TwoOriented>([&] { return TwoOriented{point(0.1f), unit(), point(0.1f), unit()}; }));
}

struct Moved {
  Pose<float> pose;
  Vec3 p, n, q, m;
};
struct Residual {
  std::uint32_t fixed;
  std::uint32_t agree;
  Vec3 moved;
};
struct Score {
  GPUREG_HD Residual operator()(const Moved& v) const {
    const Rigid r = to_rigid(v.pose);
    const Vec3 moved = apply(r, v.p);
    const float d2 = squared_norm(moved - v.q) * 1e-4f;
    return {fixed_residual(d2, 1.0f), normals_agree(rotate(r, v.n), v.m, 0.5f) ? 1u : 0u, moved};
  }
};
TEST_F(Items, MovedPointsAndResiduals) {
  expect_same_bits<Score, Residual>(
      many<Moved>([&] { return Moved{pose(), point(), unit(), point(), unit()}; }));
}

struct Sums {
  Vec3 arm[8], normal[8];
  float residual[8];
};
struct Stepped {
  IcpStep step;
  Pose<double> pose;
};
struct Icp {
  GPUREG_HD Stepped operator()(const Sums& v) const {
    IcpSums sums{{0}};
    for (int k = 0; k < 8; ++k)
      add_icp_term(v.arm[k], v.normal[k], v.residual[k], robust_weight(v.residual[k], 0.3f), sums);
    Stepped out;
    out.step = solve_icp(sums, 2.0f, 0.075f);
    out.pose = compose_small(out.step.omega, out.step.shift, identity_pose<double>());
    return out;
  }
};
// IcpStep ends in a bool: its padding must not take part.
struct StepBits {
  double v[13];
  std::int64_t valid;
};
struct IcpItem {
  GPUREG_HD StepBits operator()(const Sums& v) const {
    const Stepped s = Icp()(v);
    return {
        {s.step.omega[0], s.step.omega[1], s.step.omega[2], s.step.shift[0], s.step.shift[1],
         s.step.shift[2], s.pose.w, s.pose.x, s.pose.y, s.pose.z, s.pose.tx, s.pose.ty, s.pose.tz},
        s.step.valid ? 1 : 0};
  }
};
TEST_F(Items, IcpSteps) {
  expect_same_bits<IcpItem, StepBits>(many<Sums>(
      [&] {
        Sums v;
        for (int k = 0; k < 8; ++k) {
          v.arm[k] = point(0.5f);
          v.normal[k] = unit();
          v.residual[k] = value(0.3f);
        }
        return v;
      },
      1 << 17));
}

struct Symmetric {
  float a[6];
};
struct Eigen3 {
  float v[12];
};
struct EigenItem {
  GPUREG_HD Eigen3 operator()(const Symmetric& s) const {
    float a[3][3] = {{s.a[0], s.a[1], s.a[2]}, {s.a[1], s.a[3], s.a[4]}, {s.a[2], s.a[4], s.a[5]}},
          v[3][3];
    jacobi_eigen<3, 5>(a, v);
    Eigen3 out;
    for (int i = 0; i < 3; ++i) {
      out.v[i] = a[i][i];
      for (int j = 0; j < 3; ++j) out.v[3 + 3 * i + j] = v[i][j];
    }
    return out;
  }
};
TEST_F(Items, JacobiOfCovariances) {
  expect_same_bits<EigenItem, Eigen3>(many<Symmetric>([&] {
    const Vec3 a = point(), b = point(0.3f), c = point(0.05f);
    return Symmetric{{a.x * a.x + b.x * b.x + c.x * c.x, a.x * a.y + b.x * b.y + c.x * c.y,
                      a.x * a.z + b.x * b.z + c.x * c.z, a.y * a.y + b.y * b.y + c.y * c.y,
                      a.y * a.z + b.y * b.z + c.y * c.z, a.z * a.z + b.z * b.z + c.z * c.z}};
  }));
}

struct CellBits {
  std::uint64_t key;
  std::uint32_t dominated, reached;
};
struct CellItem {
  GPUREG_HD CellBits operator()(const TwoOriented& v) const {
    const Cell c = cell_of(v.p, 40.0f);
    const ClosestGeometry g = closest_geometry(0.075f, 2.0f);
    const Vec3 center = cell_center(c, g.cell_size);
    return {cell_key(c), dominated_in_cell(center, v.p, v.q, g) ? 1u : 0u,
            can_reach_cell(norm(v.q - center), g) ? 1u : 0u};
  }
};
TEST_F(Items, CellsAndCandidates) {
  expect_same_bits<CellItem, CellBits>(
      many<TwoOriented>([&] { return TwoOriented{point(0.1f), unit(), point(0.1f), unit()}; }));
}

struct MomentItem {
  GPUREG_HD Moments operator()(Vec3 p) const {
    Moments m{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
    add_moment(p, m);
    return m;
  }
};
TEST_F(Items, FixedPointMoments) {
  expect_same_bits<MomentItem, Moments>(many<Vec3>([&] { return unit(); }));
}

}  // namespace
}  // namespace gpureg
