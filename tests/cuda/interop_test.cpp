// SPDX-License-Identifier: BSD-3-Clause
// Clouds in device memory, streams of the program, asynchronous calls.
#include "gpureg/cuda_interop.hpp"

#include <cuda_runtime_api.h>

#include <limits>

#include "cuda/room_scans.hpp"
#include "gpureg/error.hpp"

namespace gpureg {
namespace {

using test::bytes;

/// A host function in a stream that waits until it is let go.
class Gate {
 public:
  explicit Gate(cudaStream_t stream) {
    EXPECT_EQ(cudaLaunchHostFunc(
                  stream, [](void* future) { static_cast<std::future<void>*>(future)->wait(); },
                  &future_),
              cudaSuccess);
  }
  ~Gate() { open(); }
  void open() {
    if (!std::exchange(open_, true)) promise_.set_value();
  }

 private:
  std::promise<void> promise_;
  std::future<void> future_ = promise_.get_future();
  bool open_ = false;
};

class Interop : public test::RoomScans {
 protected:
  void SetUp() override {
    GPUREG_GPU_OR_SKIP();
    ASSERT_EQ(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), cudaSuccess);
  }
  void TearDown() override {
    if (stream) cudaStreamDestroy(stream);
  }
  /// Copied in order of the stream; rows of `stride` floats.
  float* on_device(const std::vector<Eigen::Vector3f>& rows, std::size_t stride) {
    std::vector<float> spread(rows.size() * stride, std::numeric_limits<float>::quiet_NaN());
    for (std::size_t i = 0; i < rows.size(); ++i)
      std::copy_n(rows[i].data(), 3, spread.data() + i * stride);
    float* device = nullptr;
    EXPECT_EQ(cudaMallocAsync(reinterpret_cast<void**>(&device), spread.size() * sizeof(float) + 4,
                              stream),
              cudaSuccess);
    EXPECT_EQ(cudaMemcpyAsync(device, spread.data(), spread.size() * sizeof(float),
                              cudaMemcpyHostToDevice, stream),
              cudaSuccess);
    EXPECT_EQ(cudaStreamSynchronize(stream), cudaSuccess);
    return device;
  }
  static void expect_same(const PreparedCloud& a, const PreparedCloud& b) {
    EXPECT_EQ(a.points(), b.points());
    EXPECT_EQ(a.normals(), b.normals());
    EXPECT_EQ(a.features(), b.features());
    EXPECT_EQ(a.statistics().invalid_points, b.statistics().invalid_points);
  }
  cudaStream_t stream = nullptr;
};

TEST_F(Interop, CloudsOnTheDeviceAreThoseOfTheHost) {
  const Context context = Context::cuda();
  scans[0][7].x() = std::numeric_limits<float>::infinity();
  for (const std::size_t stride : {3u, 4u, 7u}) {
    DevicePointCloudView view;
    view.size = scans[0].size();
    view.point_stride = stride;
    float* points = on_device(scans[0], stride);
    view.points = points;
    const float viewpoint[3] = {0.5f, 1, 2};
    PointCloudView host(scans[0]);
    host.viewpoints = view.viewpoints = viewpoint;
    host.viewpoint_count = view.viewpoint_count = 1;
    expect_same(prepare(context, view, given, stream), prepare(context, host, given));
    // With rows of other things: "normals" and features that are just the points of other scans.
    scans[1].resize(scans[0].size(), {1, 0, 0});
    scans[2].resize(scans[0].size(), {0, 1, 0});
    float *normals = on_device(scans[1], stride), *features = on_device(scans[2], stride);
    view.normals = normals;
    view.normal_stride = stride;
    view.features = features;
    view.feature_dimension = 3;
    view.feature_stride = stride;
    host.normals = scans[1][0].data();
    host.features = scans[2][0].data();
    host.feature_dimension = 3;
    expect_same(prepare(context, view, given, stream), prepare(context, host, given));
    for (float* p : {points, normals, features}) cudaFreeAsync(p, stream);
  }
  expect_same(prepare(context, DevicePointCloudView{}, given, stream),
              prepare(context, PointCloudView{}, given));
}

// The stream of the program is blocked before it writes the cloud: the call returns all the same,
// and later work in the stream does not affect the prepared cloud.
TEST_F(Interop, TheCallWaitsForNothingAndTheStreamKeepsItsOrder) {
  const Context context = Context::cuda();
  const PreparedCloud expected = prepare(context, PointCloudView(scans[0]), given);
  float* points = on_device(scans[0], 3);
  const std::size_t size = scans[0].size() * 3 * sizeof(float);
  float* empty = nullptr;
  ASSERT_EQ(cudaMallocAsync(reinterpret_cast<void**>(&empty), size, stream), cudaSuccess);
  ASSERT_EQ(cudaStreamSynchronize(stream), cudaSuccess);
  DevicePointCloudView view;
  view.points = empty;
  view.size = scans[0].size();
  Gate gate(stream);
  ASSERT_EQ(cudaMemcpyAsync(empty, points, size, cudaMemcpyDeviceToDevice, stream), cudaSuccess);
  std::future<PreparedCloud> prepared = prepare_async(context, view, given, stream);
  ASSERT_EQ(cudaMemsetAsync(empty, 0xff, size, stream), cudaSuccess);
  EXPECT_EQ(prepared.wait_for(std::chrono::milliseconds(200)), std::future_status::timeout)
      << "nothing has written the points yet";
  EXPECT_EQ(cudaStreamQuery(stream), cudaErrorNotReady);
  gate.open();
  expect_same(prepared.get(), expected);
  cudaFreeAsync(points, stream);
  cudaFreeAsync(empty, stream);
}

TEST_F(Interop, FuturesHoldTheResults) {
  for (const Context& context : {Context::cuda(), Context::cpu(2)}) {
    const auto clouds = prepare_batch(context, views, given);
    const auto expected = test::all_bytes(align_batch(context, clouds, pairs, given));
    auto all = align_batch_async(context, clouds, pairs, given);
    std::vector<std::future<RegistrationResult>> one_by_one;
    for (const Pair& pair : pairs)
      one_by_one.push_back(align_async(context, clouds[pair.source], clouds[pair.target], given));
    EXPECT_EQ(test::all_bytes(all.get()), expected);
    for (std::size_t k = 0; k < pairs.size(); ++k)
      EXPECT_EQ(bytes(one_by_one[k].get()), expected[k]);
    EXPECT_THROW(align_async(context, clouds[0], PreparedCloud(), given).get(), InvalidArgument);
  }
}

TEST_F(Interop, ContextsOfSeveralDevicesFindTheCloudsDevice) {
  CudaOptions two;
  int devices = 0;
  ASSERT_EQ(cudaGetDeviceCount(&devices), cudaSuccess);
  two.devices = {0, devices - 1};
  const PreparedCloud expected = prepare(Context::cuda(), PointCloudView(scans[0]), given);
  for (int d = 0; d < devices; d += std::max(1, devices - 1)) {
    ASSERT_EQ(cudaSetDevice(d), cudaSuccess);
    cudaStream_t there = nullptr;
    ASSERT_EQ(cudaStreamCreateWithFlags(&there, cudaStreamNonBlocking), cudaSuccess);
    float* points = nullptr;
    const std::size_t size = scans[0].size() * 3 * sizeof(float);
    ASSERT_EQ(cudaMalloc(reinterpret_cast<void**>(&points), size), cudaSuccess);
    ASSERT_EQ(cudaMemcpyAsync(points, scans[0][0].data(), size, cudaMemcpyHostToDevice, there),
              cudaSuccess);
    DevicePointCloudView view;
    view.points = points;
    view.size = scans[0].size();
    expect_same(prepare(Context::cuda(two), view, given, there), expected);
    if (d > 0) EXPECT_THROW(prepare(Context::cuda(0), view, given, there), InvalidArgument);
    cudaFree(points);
    cudaStreamDestroy(there);
  }
  cudaSetDevice(0);
}

// A stream of the program that waits for the context itself must not hold the context up.
TEST_F(Interop, OtherCallsDoNotWaitForTheStreamOfACloud) {
  const Context context = Context::cuda();
  const auto clouds = prepare_batch(context, views, given);
  const auto expected = test::all_bytes(align_batch(context, clouds, pairs, given));
  float* points = on_device(scans[0], 3);
  DevicePointCloudView view;
  view.points = points;
  view.size = scans[0].size();
  Gate gate(stream);
  std::future<PreparedCloud> prepared = prepare_async(context, view, given, stream);
  // Its thread is in the engine by now.
  EXPECT_EQ(prepared.wait_for(std::chrono::milliseconds(200)), std::future_status::timeout);
  auto aligned = align_batch_async(context, clouds, pairs, given);
  const bool finished = aligned.wait_for(std::chrono::seconds(60)) == std::future_status::ready;
  EXPECT_EQ(cudaStreamQuery(stream), cudaErrorNotReady) << "the stream was not held up";
  gate.open();
  EXPECT_TRUE(finished) << "the alignment waited for the stream of the program";
  EXPECT_EQ(test::all_bytes(aligned.get()), expected);
  expect_same(prepared.get(), clouds[0]);
  cudaFreeAsync(points, stream);
}

TEST_F(Interop, ABatchIsThatOfTheHost) {
  const Context context = Context::cuda();
  const auto expected = prepare_batch(context, views, given);
  cudaStream_t other = nullptr;
  ASSERT_EQ(cudaStreamCreateWithFlags(&other, cudaStreamNonBlocking), cudaSuccess);
  std::vector<DevicePointCloudView> device(views.size());
  std::vector<CudaStream> streams(views.size(), stream);
  for (std::size_t k = 0; k < views.size(); ++k) {
    device[k].points = scans[k].empty() ? nullptr : on_device(scans[k], 3);
    device[k].size = scans[k].size();
    if (k % 2 == 1) streams[k] = other;
  }
  const auto prepared = prepare_batch_async(context, device, given, streams).get();
  ASSERT_EQ(prepared.size(), expected.size());
  for (std::size_t k = 0; k < prepared.size(); ++k) expect_same(prepared[k], expected[k]);
  const auto by_one_stream = prepare_batch_async(context, device, given, {stream}).get();
  for (std::size_t k = 0; k < prepared.size(); ++k) expect_same(by_one_stream[k], expected[k]);
  EXPECT_TRUE(prepare_batch_async(context, {}, given, {stream}).get().empty());
  EXPECT_THROW(prepare_batch_async(context, device, given, {stream, other}), InvalidArgument);
  // A cloud more than 2^20 voxels wide is named.
  const std::vector<Eigen::Vector3f> wide{{0, 0, 0}, {1e9f, 0, 0}};
  device[2].points = on_device(wide, 3);
  device[2].size = wide.size();
  try {
    prepare_batch_async(context, device, given, streams).get();
    ADD_FAILURE() << "a cloud too wide was prepared";
  } catch (const InvalidArgument& error) {
    EXPECT_EQ(std::string(error.what()).rfind("clouds[2]: ", 0), 0u) << error.what();
  }
  for (const DevicePointCloudView& view : device)
    if (view.points) cudaFreeAsync(const_cast<float*>(view.points), stream);
  cudaStreamDestroy(other);
}

// Points, normals and features come from three streams, two of which are late.
TEST_F(Interop, NormalsAndFeaturesOfOtherStreamsAreAwaited) {
  const Context context = Context::cuda();
  scans[1].resize(scans[0].size(), {1, 0, 0});
  scans[2].resize(scans[0].size(), {0, 1, 0});
  PointCloudView host(scans[0]);
  host.normals = scans[1][0].data();
  host.features = scans[2][0].data();
  host.feature_dimension = 3;
  const PreparedCloud expected = prepare(context, host, given);
  const std::size_t size = scans[0].size() * 3 * sizeof(float);
  float *points = on_device(scans[0], 3), *normals = on_device(scans[1], 3),
        *features = on_device(scans[2], 3);
  float* late[2] = {nullptr, nullptr};
  cudaStream_t others[2];
  for (int k = 0; k < 2; ++k) {
    ASSERT_EQ(cudaStreamCreateWithFlags(&others[k], cudaStreamNonBlocking), cudaSuccess);
    ASSERT_EQ(cudaMalloc(reinterpret_cast<void**>(&late[k]), size), cudaSuccess);
    ASSERT_EQ(cudaMemset(late[k], 0xff, size), cudaSuccess);
  }
  ASSERT_EQ(cudaDeviceSynchronize(), cudaSuccess);
  Gate first(others[0]), second(others[1]);
  ASSERT_EQ(cudaMemcpyAsync(late[0], normals, size, cudaMemcpyDeviceToDevice, others[0]),
            cudaSuccess);
  ASSERT_EQ(cudaMemcpyAsync(late[1], features, size, cudaMemcpyDeviceToDevice, others[1]),
            cudaSuccess);
  DevicePointCloudView view;
  view.points = points;
  view.size = scans[0].size();
  view.normals = late[0];
  view.normal_stream = others[0];
  view.features = late[1];
  view.feature_dimension = 3;
  view.feature_stream = others[1];
  std::future<PreparedCloud> prepared = prepare_async(context, view, given, stream);
  // What comes later in these streams changes nothing.
  for (int k = 0; k < 2; ++k)
    ASSERT_EQ(cudaMemsetAsync(late[k], 0xff, size, others[k]), cudaSuccess);
  EXPECT_EQ(prepared.wait_for(std::chrono::milliseconds(200)), std::future_status::timeout);
  first.open();
  second.open();
  expect_same(prepared.get(), expected);
  for (float* p : {points, normals, features}) cudaFreeAsync(p, stream);
  for (int k = 0; k < 2; ++k) {
    cudaFree(late[k]);
    cudaStreamDestroy(others[k]);
  }
}

TEST_F(Interop, DeviceMemoryIsNoHostCloud) {
  const Context context = Context::cuda();
  float* points = on_device(scans[0], 3);
  PointCloudView view(scans[0]), bad_points = view, bad_normals = view, bad_features = view;
  bad_points.points = points;
  bad_normals.normals = points;
  bad_features.features = points;
  bad_features.feature_dimension = 3;
  const std::pair<const char*, PointCloudView> cases[] = {{"cloud.points", bad_points},
                                                          {"cloud.normals", bad_normals},
                                                          {"cloud.features", bad_features}};
  for (const auto& [field, bad] : cases) try {
      prepare(context, bad, given);
      ADD_FAILURE() << field << " in device memory was taken for host memory";
    } catch (const InvalidArgument& error) {
      EXPECT_NE(std::string(error.what()).find(std::string(field) + " is memory of device"),
                std::string::npos)
          << error.what();
    }
  // The host can read managed memory.
  void* managed = nullptr;
  const std::size_t size = scans[0].size() * 3 * sizeof(float);
  ASSERT_EQ(cudaMallocManaged(&managed, size), cudaSuccess);
  std::memcpy(managed, scans[0][0].data(), size);
  view.points = static_cast<const float*>(managed);
  expect_same(prepare(context, view, given), prepare(context, PointCloudView(scans[0]), given));
  cudaFree(managed);
  cudaFreeAsync(points, stream);
}

TEST_F(Interop, WrongMemoryIsAnError) {
  const Context context = Context::cuda();
  DevicePointCloudView view;
  view.points = scans[0][0].data();
  view.size = scans[0].size();
  try {
    prepare_async(context, view, given, stream);
    FAIL() << "host memory was taken for device memory";
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("cloud.points is not device memory"),
              std::string::npos)
        << error.what();
  }
  float* points = on_device(scans[0], 3);
  view.points = points;
  EXPECT_THROW(prepare_async(Context::cpu(), view, given, stream), InvalidArgument);
  view.point_stride = 2;
  EXPECT_THROW(prepare_async(context, view, given, stream), InvalidArgument);
  cudaFreeAsync(points, stream);
}

}  // namespace
}  // namespace gpureg
