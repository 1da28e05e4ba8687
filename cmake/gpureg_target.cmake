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

# add_gpureg_test(name SOURCES a_test.cpp ... LIBS gpureg::gpureg ...): one executable, each of its cases a ctest test.
function(add_gpureg_test name)
  cmake_parse_arguments(arg "" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  gpureg_target(${name})
  # GoogleTest's macros are an if-else of their own.
  target_compile_options(${name} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wno-dangling-else>)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${name} PRIVATE ${arg_LIBS} GTest::gtest GTest::gtest_main)
  gtest_discover_tests(${name} TEST_PREFIX ${name}. DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 900)
endfunction()

function(add_gpureg_bench name)
  cmake_parse_arguments(arg "" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  gpureg_target(${name})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${name} PRIVATE ${arg_LIBS} benchmark::benchmark benchmark::benchmark_main)
endfunction()
