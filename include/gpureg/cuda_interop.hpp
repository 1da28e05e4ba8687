// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <future>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gpureg/registration.hpp"

struct CUstream_st;

/// Interoperation with CUDA programs: clouds in device memory, streams of the program, asynchronous
/// calls. Needs no CUDA header. Without a CUDA backend no context fits these functions.
namespace gpureg {

using CudaStream = CUstream_st*;  ///< cudaStream_t; null is the default stream

/// Non-owning view of a point cloud in device memory: float32 rows, strides in floats. The fields
/// have the meaning of those of PointCloudView. Stray points and those at the limits of the
/// sensor's range are not dropped from it (PrepareStatistics).
struct DevicePointCloudView {
  const float* points = nullptr;  ///< device: size rows of x, y, z; metres
  std::size_t size = 0;
  std::size_t point_stride = 3;     ///< >= 3
  const float* normals = nullptr;   ///< device, optional: size rows of nx, ny, nz
  std::size_t normal_stride = 3;    ///< >= 3
  const float* features = nullptr;  ///< device, optional: size rows of feature_dimension floats
  std::size_t feature_dimension = 0;
  std::size_t feature_stride = 0;     ///< 0: feature_dimension
  const float* viewpoints = nullptr;  ///< HOST memory, optional: viewpoint_count rows of x, y, z
  std::size_t viewpoint_count = 0;
  bool infer_viewpoint = true;
  bool model = false;
  double origin[3] = {0, 0, 0};  ///< as that of PointCloudView
  /// Streams that order the reading of normals and features, if another stream than that of the
  /// points wrote them.
  std::optional<CudaStream> normal_stream, feature_stream;

  /// @throws InvalidArgument as PointCloudView::validate() does.
  void validate() const {
    PointCloudView v(points, size);  // checks values only, dereferences nothing
    v.point_stride = point_stride;
    v.normals = normals;
    v.normal_stride = normal_stride;
    v.features = features;
    v.feature_dimension = feature_dimension;
    v.feature_stride = feature_stride;
    v.viewpoints = viewpoints;
    v.viewpoint_count = viewpoint_count;
    v.infer_viewpoint = infer_viewpoint;
    v.model = model;
    v.validate();
  }
};

/// prepare() for a cloud in device memory; the result equals that of the same cloud in host memory
/// bit for bit, but for two things that are looked for in host memory only: scans of 2-D scanners
/// are prepared as any other cloud, and stray points are kept.
///
/// Work in `stream` reads the rows, after everything enqueued there before; work enqueued there
/// later may change or free them. The call waits neither for the stream nor for other work of the
/// context, and other calls of the context do not wait for the stream. Preparation runs on the
/// stream of the context. Thread-safe.
/// @param cloud device memory on a device of the context; viewpoints in host memory.
/// @param stream stream that orders the reading of the rows; null: the default stream.
/// @return future of the prepared cloud; it rethrows errors of the data.
/// @throws InvalidArgument for options or views out of range, for memory on another device, and for
///   a context of another backend.
/// @throws DeviceError if the device has no memory.
std::future<PreparedCloud> prepare_async(const Context& context, const DevicePointCloudView& cloud,
                                         const RegistrationOptions& options, CudaStream stream);

/// prepare_batch() for clouds in device memory: prepare_async() with one thread for all clouds,
/// which are prepared together. Thread-safe.
/// @param streams for each cloud the stream that orders the reading of its rows, or one for all.
/// @param names of the clouds in error messages, or none.
/// @return future of the prepared clouds in order; it rethrows errors of the data.
/// @throws InvalidArgument as prepare_async() does, naming the cloud, and for a wrong number of
///   streams or names.
/// @throws DeviceError if the device has no memory.
std::future<std::vector<PreparedCloud>> prepare_batch_async(
    const Context& context, const std::vector<DevicePointCloudView>& clouds,
    const RegistrationOptions& options, const std::vector<CudaStream>& streams,
    const std::vector<std::string>& names = {});

/// prepare_async() that waits for the result.
/// @throws InvalidArgument as prepare_async() does.
/// @throws DeviceError as its future does.
inline PreparedCloud prepare(const Context& context, const DevicePointCloudView& cloud,
                             const RegistrationOptions& options, CudaStream stream) {
  return prepare_async(context, cloud, options, stream).get();
}

/// align() that returns at once, on any backend. Each pending call has a thread of its own; calls
/// of one context share it or wait for each other (Context). Destroying the future waits for the
/// result, as with std::async. Thread-safe.
/// @return future of the result; it rethrows all errors of align().
inline std::future<RegistrationResult> align_async(const Context& context,
                                                   const PreparedCloud& source,
                                                   const PreparedCloud& target,
                                                   const RegistrationOptions& options = {}) {
  return std::async(std::launch::async, [context, source, target, options] {
    return align(context, source, target, options);
  });
}

/// align_batch() that returns at once, as align_async().
/// @return future of one result per pair; it rethrows all errors of align_batch().
inline std::future<std::vector<RegistrationResult>> align_batch_async(
    const Context& context, std::vector<PreparedCloud> clouds, std::vector<Pair> pairs,
    const RegistrationOptions& options = {}) {
  return std::async(std::launch::async,
                    [context, clouds = std::move(clouds), pairs = std::move(pairs), options] {
                      return align_batch(context, clouds, pairs, options);
                    });
}

}  // namespace gpureg
