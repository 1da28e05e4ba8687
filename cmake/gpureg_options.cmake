# SPDX-License-Identifier: BSD-3-Clause
option(GPUREG_BUILD_TESTS "Build the tests (needs GoogleTest)" ${PROJECT_IS_TOP_LEVEL})
option(GPUREG_BUILD_GOLDEN "Build the test of results byte for byte (needs no test library)" ${GPUREG_BUILD_TESTS})
option(GPUREG_BUILD_BENCHMARKS "Build the benchmarks (needs Google Benchmark)" ${PROJECT_IS_TOP_LEVEL})
option(GPUREG_BUILD_APPS "Build the command gpureg (needs CLI11 and nlohmann-json)" ${PROJECT_IS_TOP_LEVEL})
option(GPUREG_SLAM_DEMO "Build slam_demo with the apps (needs OpenCV and Ceres)" ON)
option(GPUREG_BUILD_PYTHON "Build the Python module (needs pybind11; pip does this)" OFF)
option(GPUREG_WERROR "Treat warnings as errors (for the tests of the project itself)" OFF)
option(GPUREG_PRECOMPILED_LIBRARIES "Compile the libraries with precompiled headers; without, ccache finds objects of other builds" ON)
set(GPUREG_CUDA "AUTO" CACHE STRING "CUDA backend: AUTO (where nvcc and a device are, for that device), ON (for every architecture) or OFF")
set_property(CACHE GPUREG_CUDA PROPERTY STRINGS AUTO ON OFF)
set(GPUREG_SANITIZE "" CACHE STRING "Sanitizers for every target, e.g. address,undefined or thread")

# Only the CPU stages (src/cpu, no Eigen in them) are compiled for this architecture: the public ABI does not depend on it.
# x86-64-v3 is Haswell (2013) and later: hardware fused multiply-add and AVX2. Context::cpu() checks it at run time.
set(_gpureg_arch "")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
  set(_gpureg_arch "x86-64-v3")
endif()
set(GPUREG_CPU_ARCH "${_gpureg_arch}" CACHE STRING "-march of the CPU stages (x86-64-v3, x86-64-v4, native, or empty)")
