// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/device/group_by_cell.cuh"

namespace gpureg::cuda {
namespace {

__global__ void gather_ranks(const std::uint32_t* offset, const std::uint32_t* rank,
                             std::uint32_t count, std::uint32_t* out) {
  const std::uint32_t e = blockIdx.x * blockDim.x + threadIdx.x;
  if (e < count) out[e] = rank[offset[e]];
}

__global__ void write_starts(const std::uint32_t* rank, std::uint32_t size, std::uint32_t* start) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < size && rank[i + 1] != rank[i]) start[rank[i]] = i;
}

}  // namespace

void detail::write_group_starts(Exec& exec, std::uint32_t total, Groups& groups) {
  if (total == 0) return;
  launch(exec, "write_starts", write_starts, shape_for(total, 256), groups.rank.data(), total,
         groups.start.data());
}

const std::uint32_t* download_group_offsets(Exec& exec, const Segments& segments,
                                            const Groups& groups) {
  const std::uint32_t count = static_cast<std::uint32_t>(segments.offset.size());
  const auto gathered = exec.buffer<std::uint32_t>(count);
  launch(exec, "gather_ranks", gather_ranks, shape_for(count, 128), segments.on_device.data(),
         groups.rank.data(), count, gathered.data());
  return exec.download(gathered.data(), count);
}

}  // namespace gpureg::cuda
