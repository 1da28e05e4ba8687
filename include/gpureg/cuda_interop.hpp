// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <future>
#include <utility>
#include <vector>

#include "gpureg/registration.hpp"

struct CUstream_st;

/// For programs that work on the GPU themselves: clouds that already live on the device, streams of
/// the caller, calls that return at once. Needs no CUDA header; without a CUDA backend there is no
/// context that these functions accept.
namespace gpureg {

using CudaStream = CUstream_st*;  ///< cudaStream_t; null is the default stream

/// Non-owning view of a point cloud in device memory: float32 rows, strides in floats. The fields
/// mean what those of PointCloudView do.
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
  double origin[3] = {0, 0, 0};  ///< as that of PointCloudView

  /// Throws InvalidArgument as PointCloudView::validate() does.
  void validate() const {
    PointCloudView v(points, size);  // the same fields; where they point is not looked at
    v.point_stride = point_stride;
    v.normals = normals;
    v.normal_stride = normal_stride;
    v.features = features;
    v.feature_dimension = feature_dimension;
    v.feature_stride = feature_stride;
    v.viewpoints = viewpoints;
    v.viewpoint_count = viewpoint_count;
    v.validate();
  }
};

/// prepare() of a cloud in device memory; the result is that of the same cloud in host memory, bit
/// for bit.
///
/// The rows are read by work in `stream`, after everything enqueued there before: what is enqueued
/// there later may change or free them. The call waits for nothing, neither for the stream nor for
/// other work of the context; preparation itself runs on the context's own stream. Errors of the
/// data come out of the future. Throws InvalidArgument for bad options or views, for memory that is
/// not on the context's device and for a context that is not CUDA's; DeviceError without memory.
/// Thread-safe.
std::future<PreparedCloud> prepare_async(const Context& context, const DevicePointCloudView& cloud,
                                         const PrepareOptions& options, CudaStream stream);

/// The same, waiting for the result.
inline PreparedCloud prepare(const Context& context, const DevicePointCloudView& cloud,
                             const PrepareOptions& options, CudaStream stream) {
  return prepare_async(context, cloud, options, stream).get();
}

/// align() that returns at once, on any backend. Everything that align() throws comes out of the
/// future. Each pending call has a thread of its own; calls of one context take turns. Destroying
/// the future waits for the result, as that of std::async does. Thread-safe.
inline std::future<RegistrationResult> align_async(const Context& context,
                                                   const PreparedCloud& source,
                                                   const PreparedCloud& target,
                                                   const RegistrationOptions& options = {}) {
  return std::async(std::launch::async, [context, source, target, options] {
    return align(context, source, target, options);
  });
}

/// The same for many pairs.
inline std::future<std::vector<RegistrationResult>> align_batch_async(
    const Context& context, std::vector<PreparedCloud> clouds, std::vector<Pair> pairs,
    const RegistrationOptions& options = {}) {
  return std::async(std::launch::async,
                    [context, clouds = std::move(clouds), pairs = std::move(pairs), options] {
                      return align_batch(context, clouds, pairs, options);
                    });
}

}  // namespace gpureg
