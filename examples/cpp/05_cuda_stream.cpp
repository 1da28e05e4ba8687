// SPDX-License-Identifier: BSD-3-Clause
// Clouds on the GPU: prepares them in order of a CUDA stream of your own, and waits only for the
// result.
//
//   05_cuda_stream SOURCE.ply TARGET.ply
//
// Exit status: 0 aligned, 1 not aligned, 2 an error, such as no usable GPU.
#include <cuda_runtime_api.h>

#include <gpureg/cuda_interop.hpp>
#include <gpureg/io.hpp>
#include <iostream>

void check(cudaError_t error) {
  if (error != cudaSuccess) throw gpureg::DeviceError(cudaGetErrorString(error));
}

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: 05_cuda_stream SOURCE.ply TARGET.ply\n";
    return 2;
  }
  const gpureg::Context context = gpureg::Context::cuda();  // throws where there is no usable GPU
  const gpureg::RegistrationOptions options{0.05f};
  cudaStream_t stream = nullptr;
  check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));

  const auto prepare = [&](const char* file) {
    const gpureg::PointCloud cloud = gpureg::io::read_point_cloud(file);
    // Stands for a program whose points are already on the device.
    const std::size_t bytes = cloud.points.size() * sizeof(Eigen::Vector3f);
    void* points = nullptr;
    check(cudaMallocAsync(&points, bytes, stream));
    check(cudaMemcpyAsync(points, cloud.points.data(), bytes, cudaMemcpyHostToDevice, stream));

    gpureg::DevicePointCloudView view;
    view.points = static_cast<const float*>(points);
    view.size = cloud.points.size();
    auto prepared = gpureg::prepare_async(context, view, options, stream);
    // The rows are read before this frees them: it is enqueued later in the same stream.
    check(cudaFreeAsync(points, stream));
    return prepared;
  };
  std::future<gpureg::PreparedCloud> source = prepare(argv[1]), target = prepare(argv[2]);
  auto pending = gpureg::align_async(context, source.get(), target.get(), options);
  // Here a program does other work.
  const gpureg::RegistrationResult result = pending.get();
  check(cudaStreamDestroy(stream));

  std::cout << context.description() << ": " << explain(result.reason) << "\n"
            << "confidence " << result.confidence << "\n";
  if (!result.aligned()) return 1;
  std::cout << "target_from_source\n" << result.target_from_source.matrix() << "\n";
  return 0;
} catch (const gpureg::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 2;
}
