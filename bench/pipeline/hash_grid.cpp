// SPDX-License-Identifier: BSD-3-Clause
#include "hash_grid.hpp"

#include <cuda_runtime_api.h>

#include "cpu/common/stages.hpp"
#include "cuda/device/check.hpp"

namespace gpureg::bench {

HashGrid::HashGrid(const PreparedState& cloud) {
  cpu::Exec exec(1);
  std::vector<cpu::DownsampledCloud> clouds(1);
  clouds[0].points = cloud.copy_points();
  clouds[0].radius = cloud.radius;
  const auto grid = cpu::build_closest_grids(
      exec, clouds, cpu::build_grids(exec, clouds, cloud.options), cloud.options)[0];
  view_ = grid->view();
  std::size_t bytes = 0;
  const auto place = [&](const auto& span) {
    const std::size_t at = bytes;
    bytes += (span.size * sizeof(span.data[0]) + 255) / 256 * 256;
    return at;
  };
  const std::size_t table = place(view_.table), starts = place(view_.cell_start),
                    candidates = place(view_.candidates);
  cuda::check(cudaMalloc(&memory_, bytes + 1), "cudaMalloc");
  const auto upload = [&](auto& span, std::size_t at) {
    char* to = static_cast<char*>(memory_) + at;
    cuda::check(cudaMemcpy(to, span.data, span.size * sizeof(span.data[0]), cudaMemcpyHostToDevice),
                "cudaMemcpy");
    span.data = reinterpret_cast<decltype(span.data)>(to);
  };
  upload(view_.table, table);
  upload(view_.cell_start, starts);
  upload(view_.candidates, candidates);
}

HashGrid::~HashGrid() { cudaFree(memory_); }

}  // namespace gpureg::bench
