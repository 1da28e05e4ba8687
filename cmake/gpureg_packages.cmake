# SPDX-License-Identifier: BSD-3-Clause
# What the project can use. A missing optional package drops its component with one line.
find_package(Threads REQUIRED)
if(GPUREG_BUILD_PYTHON)
  # pip's build environment holds an Eigen of its own, for machines without one.
  find_package(Eigen3 3.3 QUIET NO_MODULE)
  if(NOT Eigen3_FOUND)
    find_package(Python 3.10 REQUIRED COMPONENTS Interpreter Development.Module)
    execute_process(COMMAND ${Python_EXECUTABLE} -c "import cmeel, pathlib; print(pathlib.Path(cmeel.__file__).parents[1] / 'cmeel.prefix')"
      OUTPUT_VARIABLE _gpureg_cmeel OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    list(APPEND CMAKE_PREFIX_PATH ${_gpureg_cmeel})
  endif()
endif()
find_package(Eigen3 3.3 REQUIRED NO_MODULE)

macro(gpureg_optional have what)
  if(${have})
    set(${have} ON)
  else()
    set(${have} OFF)
    message(STATUS "gpureg: without ${what}")
  endif()
endmacro()

include(cmake/gpureg_cuda.cmake)
gpureg_find_cuda()

find_package(PCL 1.11 QUIET COMPONENTS common io features kdtree search filters registration)
set(GPUREG_HAVE_PCL ${PCL_FOUND})  # the header-only adapter gpureg/pcl.hpp is installed all the same
gpureg_optional(GPUREG_HAVE_PCL "the oracle tests against PCL and the tests of its adapter (needs PCL)")

find_package(nlohmann_json 3.9 QUIET)
find_package(CLI11 2.1 QUIET)
find_package(PNG QUIET)
if(nlohmann_json_FOUND AND CLI11_FOUND AND PNG_FOUND)
  set(GPUREG_HAVE_CLI ON)
endif()
gpureg_optional(GPUREG_HAVE_CLI "the command gpureg (needs CLI11, nlohmann-json and libpng)")

find_package(embree QUIET)  # 3 (Debian 12) or 4 (Ubuntu 24.04)
if(embree_FOUND AND embree_VERSION_MAJOR MATCHES "^[34]$")
  set(GPUREG_HAVE_EMBREE ON)
endif()
gpureg_optional(GPUREG_HAVE_EMBREE "the generator of synthetic rooms (needs Embree 3 or 4)")

find_package(assimp 5 QUIET)
set(GPUREG_HAVE_ASSIMP ${assimp_FOUND})
gpureg_optional(GPUREG_HAVE_ASSIMP "the generator's --building (needs Assimp)")

if(GPUREG_BUILD_TESTS)
  find_package(GTest 1.11 QUIET)
  gpureg_optional(GTest_FOUND "tests (needs GoogleTest)")
  include(GoogleTest)
endif()
if(GPUREG_BUILD_BENCHMARKS)
  find_package(benchmark QUIET)
  gpureg_optional(benchmark_FOUND "benchmarks (needs Google Benchmark)")
endif()
