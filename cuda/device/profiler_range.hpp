// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace gpureg::cuda {

/// A range with that name on the time line of a profiler (NVTX), while the object lives.
class ProfilerRange {
 public:
  explicit ProfilerRange(const char* name);
  ~ProfilerRange();
  ProfilerRange(const ProfilerRange&) = delete;
  ProfilerRange& operator=(const ProfilerRange&) = delete;
};

}  // namespace gpureg::cuda
