# SPDX-License-Identifier: BSD-3-Clause
# Everything that all targets share: warnings, exact floating point, sanitizers, tests, benchmarks.

# Where libraries are shared, what is installed finds them wherever the prefix lies.
if(NOT DEFINED CMAKE_INSTALL_RPATH AND NOT APPLE)
  file(RELATIVE_PATH _gpureg_lib_from_bin ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
  set(CMAKE_INSTALL_RPATH "$ORIGIN;$ORIGIN/${_gpureg_lib_from_bin}")
endif()

# Eigen adds up in an order that depends on the width of the registers, and fuses on ARM: its scalar code does neither.
# The alignment stays that of Eigen's default, so that programs which vectorise can pass its types.
set(GPUREG_EIGEN_DEFINITIONS EIGEN_DONT_VECTORIZE EIGEN_MAX_ALIGN_BYTES=16 EIGEN_MAX_STATIC_ALIGN_BYTES=16)

# The contract "same bits on the CPU and on the GPU" needs the compiler to contract nothing by itself: where a fused
# multiply-add is wanted, the shared code says fmaf.
function(gpureg_target target)
  target_compile_features(${target} PUBLIC cxx_std_17)
  target_compile_definitions(${target} PRIVATE ${GPUREG_EIGEN_DEFINITIONS})
  target_compile_options(${target} PRIVATE
    $<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off -fno-fast-math -Wall -Wextra -Wpedantic -Wshadow -Wno-psabi>
    # Branches cost more than the comparisons: & of conditions is meant.
    $<$<COMPILE_LANG_AND_ID:CXX,Clang,AppleClang>:-Wno-unknown-warning-option -Wno-bitwise-instead-of-logical
      -Wno-bitwise-conditional-parentheses>
    $<$<COMPILE_LANGUAGE:CUDA>:-fmad=false -prec-div=true -prec-sqrt=true -ftz=false --expt-relaxed-constexpr
      -Xcompiler=-ffp-contract=off,-Wall,-Wextra,-Wno-dangling-else>)
  if(GPUREG_WERROR)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Werror>)
  endif()
  if(GPUREG_SANITIZE)
    target_compile_options(${target} PRIVATE
      $<$<COMPILE_LANGUAGE:CXX>:-fsanitize=${GPUREG_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all>)
    target_link_options(${target} PRIVATE -fsanitize=${GPUREG_SANITIZE})
  endif()
endfunction()

# A family of targets with the same flags shares one precompiled header: of foreign headers only, so that an edit here does not compile
# everything. The sources include what they use all the same; the presets of the sanitizers build without.
# gpureg_precompiled(family EXECUTABLES|LIBRARIES HEADERS <Eigen/Core> ... LIBS ...)
function(gpureg_precompiled family kind)
  cmake_parse_arguments(arg "" "" "HEADERS;LIBS" ${ARGN})
  set(_source ${PROJECT_BINARY_DIR}/precompiled/${family}.cpp)
  file(CONFIGURE OUTPUT ${_source} CONTENT "int main() {}\n")
  # Position-independent code of libraries and that of executables cannot share a header.
  if(kind STREQUAL "EXECUTABLES")
    add_executable(${family} EXCLUDE_FROM_ALL ${_source})
    set_target_properties(${family} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/precompiled)
  else()
    add_library(${family} OBJECT EXCLUDE_FROM_ALL ${_source})
  endif()
  target_link_libraries(${family} PRIVATE ${arg_LIBS})
  target_precompile_headers(${family} PRIVATE ${arg_HEADERS})
endfunction()

function(gpureg_use_precompiled target family)
  set_target_properties(${target} PROPERTIES DEFINE_SYMBOL "")  # its macros are those of the family
  get_target_property(_type ${family} TYPE)
  if(GPUREG_PRECOMPILED_LIBRARIES OR NOT _type STREQUAL "OBJECT_LIBRARY")
    target_precompile_headers(${target} REUSE_FROM ${family})
  endif()
endfunction()

# A library of loops over Eigen's types, which then become vector instructions.
function(gpureg_numeric_target target)
  gpureg_target(${target})
  target_compile_definitions(${target} PRIVATE EIGEN_MPL2_ONLY)  # only what Eigen licenses under the MPL 2
  target_compile_options(${target} PRIVATE -fno-math-errno -fno-trapping-math)
endfunction()

function(gpureg_test_flags target)
  target_compile_options(${target} PRIVATE $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release>>:-O1>)
endfunction()

# add_gpureg_test(name SOURCES a_test.cpp ... LIBS gpureg::gpureg ...): one executable, each of its cases a ctest test.
# NOT_PRECOMPILED: where a library of it adds flags. EXHAUSTIVE: compares with searches of its own, which the optimiser makes faster; the
# other tests run once per compilation, and share a header that was compiled with their flags.
function(add_gpureg_test name)
  cmake_parse_arguments(arg "NOT_PRECOMPILED;EXHAUSTIVE" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  gpureg_target(${name})
  if(NOT arg_EXHAUSTIVE)
    gpureg_test_flags(${name})
    if(NOT arg_NOT_PRECOMPILED)
      gpureg_use_precompiled(${name} gpureg_test_headers)
    endif()
  endif()
  # GoogleTest's macros are an if-else of their own.
  target_compile_options(${name} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wno-dangling-else>)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${name} PRIVATE ${arg_LIBS} Eigen3::Eigen GTest::gtest GTest::gtest_main)
  gtest_discover_tests(${name} TEST_PREFIX ${name}. DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 900)
endfunction()

function(add_gpureg_bench name)
  cmake_parse_arguments(arg "" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  gpureg_target(${name})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${name} PRIVATE ${arg_LIBS} benchmark::benchmark benchmark::benchmark_main)
endfunction()
