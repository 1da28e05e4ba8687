// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/device/profiler_range.hpp"

#if __has_include(<nvtx3/nvToolsExt.h>)
#include <nvtx3/nvToolsExt.h>
#endif

namespace gpureg::cuda {

#if defined(NVTX_VERSION)
ProfilerRange::ProfilerRange(const char* name) { nvtxRangePushA(name); }
ProfilerRange::~ProfilerRange() { nvtxRangePop(); }
#else  // a toolkit without NVTX, such as NVIDIA's Python wheels of the compiler alone
ProfilerRange::ProfilerRange(const char*) {}
ProfilerRange::~ProfilerRange() = default;
#endif

}  // namespace gpureg::cuda
